"""The calibrated points as LAS and LAZ: places and distances by a model of their own, marks, and memory."""

import resource
import tracemalloc
from pathlib import Path

import laspy
import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation, Slerp

from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.results import DRIFT, SURFACES
from pipeline.artefacts.catalogue.target import FACES, LASER_LABELLED, SOUNDINGS_LABELLED, TARGET_POSE
from pipeline.artefacts.parquet import PartWriter, to_arrow, write_table
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import BATCH_ROWS
from pipeline.errors import ArtefactError, ConfigError
from pipeline.exports.cloud import write_cloud
from pipeline.exports.cloud_frame import CloudFrame, cloud_frame
from pipeline.exports.cloud_points import CalibratedPoints
from pipeline.maths.target.model import TargetFrame
from pipeline.mount import Mounted
from pipeline.run.results import Tables
from tests.support.mountings import ORIGIN, mounted

POOL = CloudFrame("pool", None, np.zeros(3), lambda points: points)
T0 = 1_462_608_000 * 10**9
STEP_NS = 10 * 10**9
MOUNTS: dict[str, Mounted] = {
    "laser": mounted(1.0, 2.0, 3.0, 0.2, 0.5, 1.1),
    "mbes": mounted(-48.8, 1.2, -2.0, 0.3, 0.2, -2.0),
}
NORMAL = np.array([-0.6, 0.8, 0.0])
DRIFTED = {
    "shift": np.array([[0.01, 0.0, -0.02], [0.03, 0.02, 0.0]]),
    "turn": np.array([[0.0, 0.1, 0.0], [0.2, 0.1, -0.3]]),
}
POSITIONS = np.array([[-4.0, -3.0, 1.0], [-4.2, 3.0, 1.1]])
ATTITUDES = Rotation.from_euler("ZXY", [[-163.0, 1.0, 2.0], [-160.0, -1.0, 3.0]], degrees=True)


def table(run: Path, artefact: Artefact, content: dict[str, object]) -> None:
    path = run / artefact.owner / f"{artefact.name}.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    filled = {column.name: content.get(column.name) for column in artefact.columns}
    rows = len(next(value for value in filled.values() if value is not None))
    write_table(path, to_arrow(pd.DataFrame({
        name: value if value is not None else _none(artefact, name, rows) for name, value in filled.items()
    }), artefact))  # fmt: skip


def _none(artefact: Artefact, name: str, rows: int) -> list[object]:
    kind = str(next(column.type for column in artefact.columns if column.name == name))
    empty = {"string": "", "bool": False, "list<item: double>": [0.0]}
    return [empty.get(kind, 0)] * rows


def stream(run: Path, artefact: Artefact, sensor: str, rows: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(rows)
    columns: dict[str, np.ndarray] = {column.name: np.zeros(rows) for column in artefact.columns}
    columns |= {f"{axis}_{sensor}_m": random.uniform(-9, 9, rows).astype(np.float32) for axis in "xyz"}
    columns |= {
        "t_ns": T0 + np.linspace(0, STEP_NS, rows).astype(np.int64),
        "pass": np.arange(rows) % 3,
        "face": np.arange(rows) % 2,
    }
    for name in ("pass", "face", "ping", "beam"):
        if name in columns:
            columns[name] = columns[name].astype(np.int64 if name == "ping" else np.int16)
    folder = run / artefact.owner / artefact.name
    folder.mkdir(parents=True)
    with PartWriter(folder, artefact, 0) as writer:
        for start in range(0, rows, BATCH_ROWS):
            writer.add({name: values[start : start + BATCH_ROWS] for name, values in columns.items()})
    return columns


def made_up(run: Path, rows: int) -> tuple[CalibratedPoints, dict[str, dict[str, np.ndarray]]]:
    quaternions = np.roll(ATTITUDES.as_quat(), 1, axis=1)
    poses = {f"{axis}_pool_m": POSITIONS[:, k] for k, axis in enumerate("xyz")}
    poses |= {f"q{axis}": quaternions[:, k] for k, axis in enumerate("wxyz")} | {"t_ns": [T0, T0 + STEP_NS]}
    table(run, POSES, poses)
    table(run, TARGET_POSE, {"R_target_from_pool": [np.eye(3).ravel().tolist()]})
    planes = {
        "normal_x_target_1": [NORMAL[0], 0.0],
        "normal_y_target_1": [NORMAL[1], 0.0],
        "normal_z_target_1": [NORMAL[2], 1.0],
    }
    table(run, FACES, planes | {"face": [0, 1], "name": ["wall", "top 水"], "family": ["P1", "H"],
                                "sense": [1.0, -1.0], "offset_m": [0.0, -3.5]})  # fmt: skip
    table(run, SURFACES, planes | {"family": ["P1", "H"], "distance_m": [0.25, 0.002]})
    drift = {f"{axis}_target_m": DRIFTED["shift"][:, k] for k, axis in enumerate("xyz")}
    drift |= {f"turn_{axis}_target_deg": DRIFTED["turn"][:, k] for k, axis in enumerate("xyz")}
    table(run, DRIFT, drift | {"t_ns": [T0, T0 + STEP_NS]})
    points = {
        "laser": stream(run, LASER_LABELLED, "laser", rows),
        "mbes": stream(run, SOUNDINGS_LABELLED, "mbes", rows // 4),
    }
    return CalibratedPoints.of(Tables(run), MOUNTS, {"top 水": 0.004}), points


def expected(columns: dict[str, np.ndarray], sensor: str) -> tuple[np.ndarray, np.ndarray]:
    """Place and distance of every point: p + shift + Exp(turn) R (R_mount x + t) to first order in the drift."""
    share = (columns["t_ns"] - T0) / STEP_NS
    x = np.column_stack([columns[f"{axis}_{sensor}_m"] for axis in "xyz"]).astype(float)
    body = x @ MOUNTS[sensor].R_body_from_sensor.T + MOUNTS[sensor].lever_arm_body_m
    r = Slerp([0, 1], ATTITUDES)(share).apply(body)

    def linear(ends: np.ndarray) -> np.ndarray:
        return ends[0] + share[:, None] * (ends[1] - ends[0])

    points = linear(POSITIONS) + r + linear(DRIFTED["shift"]) + np.cross(np.radians(linear(DRIFTED["turn"])), r)
    wall = columns["face"] == 0
    height = -3.5 - 0.004 + 0.002  # surveyed 4 mm outside its place, and its outside is below
    return points, np.where(wall, points @ NORMAL - 0.25, points[:, 2] - height)


@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_places_distances_and_labels(suffix: str, tmp_path: Path) -> None:
    points, columns = made_up(tmp_path / "run", 4000)
    path = tmp_path / f"水.{suffix}"
    assert write_cloud(path, points, POOL, ORIGIN) == 5000
    with laspy.open(path) as file:
        header, read = file.header, file.read()
    assert header.generating_software.startswith("poolcal ")
    assert "1 top 水" in header.vlrs[-1].record_data.decode().splitlines() or any(
        b"top" in getattr(vlr, "record_data", b"") for vlr in header.vlrs
    )
    for sensor, number in (("laser", 1), ("mbes", 2)):
        mine = read.user_data == number
        place, distance = expected(columns[sensor], sensor)
        np.testing.assert_allclose(read.xyz[mine], place, atol=0.00006)
        np.testing.assert_allclose(read["residual_mm"][mine], distance * 1000, atol=0.001 + 1e-6 * 2e4)
        np.testing.assert_array_equal(read["face"][mine], columns[sensor]["face"])
        np.testing.assert_array_equal(read.point_source_id[mine], columns[sensor]["pass"] + 1)
        np.testing.assert_allclose(read.gps_time[mine] + 1e9, columns[sensor]["t_ns"] / 1e9, atol=1e-6)
    first = path.read_bytes()
    write_cloud(path, points, POOL, ORIGIN)
    assert path.read_bytes() == first


def test_memory_does_not_grow_with_the_points(tmp_path: Path) -> None:
    peaks = []
    for rows in (300_000, 1_000_000):
        points, columns = made_up(tmp_path / str(rows), rows)
        del columns
        tracemalloc.start()
        assert write_cloud(tmp_path / f"{rows}.las", points, POOL, ORIGIN) == rows + rows // 4
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < 150e6


@pytest.mark.parametrize("missing", [1, 20_000, -100])  # room for all but a byte; for a part; for 100 bytes alone
@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_a_disk_without_room_is_one_line_and_leaves_no_file(suffix: str, missing: int, tmp_path: Path) -> None:
    """The system's limit of a file's size stands for a full disk."""
    points, _ = made_up(tmp_path / "run", 4000)
    path = tmp_path / f"cloud.{suffix}"
    write_cloud(path, points, POOL, ORIGIN)
    room = path.stat().st_size - missing if missing > 0 else -missing
    path.unlink()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(ArtefactError, match=rf"cloud\.{suffix}: cannot be written \(File too large\)"):
            write_cloud(path, points, POOL, ORIGIN)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [left.name for left in tmp_path.iterdir()] == ["run"]


def test_a_stream_that_ends_early_leaves_no_file(tmp_path: Path) -> None:
    points, _ = made_up(tmp_path / "run", 4000)
    part = next((tmp_path / "run" / "segment" / "soundings_labelled").iterdir())
    part.write_bytes(part.read_bytes()[:-100])
    with pytest.raises(ArtefactError, match="cannot be read"):
        write_cloud(tmp_path / "cloud.las", points, POOL, ORIGIN)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("EPSG:4326", "is no projected CRS in metres"),
        ("EPSG:99999", "no CRS is known by that name"),
        ("EPSG:27700", "is on the ellipsoid"),
        ("EPSG:2263", "is no projected CRS in metres"),
    ],
)
def test_frames_that_cannot_be_are_refused(name: str, said: str) -> None:
    pool = pd.DataFrame({"latitude_deg": [36.0], "longitude_deg": [120.1], "height_m": [12.0], "azimuth_deg": [163.0]})
    with pytest.raises(ConfigError, match=said):
        cloud_frame(name, TargetFrame(np.eye(3), np.zeros(3)), pool)


def test_a_projected_frame_has_the_places_of_the_pool() -> None:
    """The target's y axis points at azimuth 163°: 10 m along it go south and a little east."""
    import pyproj

    pool = pd.DataFrame({"latitude_deg": [36.0], "longitude_deg": [120.1], "height_m": [12.0], "azimuth_deg": [163.0]})
    frame = cloud_frame("EPSG:32651", TargetFrame(np.eye(3), np.zeros(3)), pool)
    x, y, z = frame.coordinates(np.array([[0.0, 0.0, 0.0], [0.0, 10.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, -2.0]]))
    longitude, latitude = pyproj.Transformer.from_crs("EPSG:32651", "EPSG:4326", always_xy=True).transform(x, y)
    azimuth, _, length = pyproj.Geod(ellps="WGS84").inv(
        longitude[[0, 0]], latitude[[0, 0]], longitude[1:3], latitude[1:3]
    )
    np.testing.assert_allclose((longitude[0], latitude[0], z[0]), (120.1, 36.0, 12.0), atol=1e-9)
    np.testing.assert_allclose(np.mod(azimuth, 360.0), [163.0, 253.0], atol=1e-3)
    np.testing.assert_allclose(length, 10.0, atol=1e-4)
    np.testing.assert_allclose([x[3] - x[0], y[3] - y[0], z[3] - z[0]], [0.0, 0.0, -2.0], atol=1e-6)
