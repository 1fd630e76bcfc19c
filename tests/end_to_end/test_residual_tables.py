"""The residual tables of a run, computed again with scipy alone from the labelled points, the poses and the result."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.spatial.transform import Rotation, Slerp

from pipeline.adjustment.residual_tables import sampling_step
from tests.support.places import Told, result_of

XYZ = [f"{axis}_target_m" for axis in "xyz"]


def table(run: Path, name: str) -> pd.DataFrame:
    path = run / f"{name}.parquet"
    return pd.read_parquet(path if path.is_file() else run / name)


def placed(run: Path, rotation: np.ndarray, lever_arm: np.ndarray) -> np.ndarray:
    """The labelled soundings in the target frame with a mount."""
    soundings, poses = table(run, "segment/soundings_labelled"), table(run, "georeference/poses")
    pose = table(run, "segment/target_pose").iloc[0]
    turn, origin = np.reshape(pose["R_target_from_pool"], (3, 3)), [pose[f"origin_{axis}_pool_m"] for axis in "xyz"]
    t = poses["t_ns"].to_numpy()
    track = poses[[f"{axis}_pool_m" for axis in "xyz"]].to_numpy()
    when = soundings["t_ns"].to_numpy()
    attitude = Slerp(t - t[0], Rotation.from_quat(poses[["qx", "qy", "qz", "qw"]].to_numpy()))(when - t[0])
    at = np.column_stack([np.interp(when - t[0], t - t[0], column) for column in track.T])
    body = soundings[[f"{axis}_mbes_m" for axis in "xyz"]].to_numpy(np.float64) @ rotation.T + lever_arm
    return (at + attitude.apply(body) - origin) @ turn.T


def test_soundings_lie_where_the_two_mounts_put_them(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    found = table(run, "adjust/residuals").query("sensor == 'mbes'")
    assert len(found) == len(table(run, "segment/soundings_labelled"))  # a small session: all of them
    result = result_of(run)["mbes"]
    coarse = yaml.safe_load((run / "run.yaml").read_text(encoding="utf-8"))["session"]["mbes"]["mount"]
    angles = [coarse["yaw_deg"], coarse["pitch_deg"], coarse["roll_deg"]]
    before = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
    for prefix, rotation, lever in (
        ("", np.array(result["R_body_from_mbes"]), result["lever_arm_m"]),
        ("coarse_", before, [coarse[f"{axis}_m"] for axis in "xyz"]),
    ):
        expected = placed(run, rotation, np.array(lever))
        np.testing.assert_allclose(found[[prefix + name for name in XYZ]], expected, atol=2e-6)
        assert np.abs(expected - placed(run, rotation, np.array(lever) + 0.001)).max() > 5e-4


def test_residuals_are_distances_from_the_adjusted_surfaces(undisturbed: tuple[Path, Told]) -> None:
    """Toward the boat, or up; of horizontal faces after their design height.

    With the adjusted mount they are less what the biases explain that the adjustment allows for: some millimetres.
    """
    run = undisturbed[0]
    found, faces = table(run, "adjust/residuals"), table(run, "segment/faces").set_index("face")
    surfaces = table(run, "adjust/surfaces").set_index("family")
    family = faces.loc[found["face"], "family"].to_numpy()
    for name, surface in surfaces.iterrows():
        rows = found[family == name]
        normal = surface[[f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy(dtype=float)
        for prefix in ("", "coarse_"):
            points = rows[[prefix + column for column in XYZ]].to_numpy(np.float64)
            height = np.zeros(len(rows))
            if name == "H":
                face = faces.loc[rows["face"]]
                height = (face["distance_m"] * face["normal_z_target_1"]).to_numpy()
            away = points @ normal - surface["distance_m"] - height
            residual = rows[prefix + "residual_m"].to_numpy()
            exact = (rows["sensor"] == "mbes").to_numpy() & (prefix == "coarse_")
            np.testing.assert_allclose(residual[exact], away[exact], atol=3e-6, err_msg=f"{name} {prefix}")
            np.testing.assert_allclose(residual, away, atol=0.006, err_msg=f"{name} {prefix}")
            assert np.corrcoef(residual, away)[0, 1] > 0.97
    assert surfaces.loc["P2", "normal_x_target_1"] < 0  # toward the boat
    laser = found[found["sensor"] == "laser"]
    np.testing.assert_array_equal(laser["residual_m"], laser["coarse_residual_m"])


def test_angle_and_range_are_the_sensors_own(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    found = table(run, "adjust/residuals")
    soundings = table(run, "segment/soundings_labelled")
    x, y, z = (soundings[f"{axis}_mbes_m"].to_numpy() for axis in "xyz")
    sonar = found[found["sensor"] == "mbes"]
    np.testing.assert_allclose(sonar["angle_deg"], np.degrees(np.arctan2(x, -z)), atol=1e-4)
    np.testing.assert_allclose(sonar["range_m"], np.sqrt(x**2 + y**2 + z**2), atol=1e-5)
    assert sonar["angle_deg"].median() > 0  # the head is rolled to starboard, and still the target lies further up


def test_bins_and_maps_hold_every_point_once(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    found, bins, cells = (table(run, f"adjust/{name}") for name in ("residuals", "residual_bins", "residual_map"))
    total = found.groupby("sensor").size()
    for by in ("angle", "range", "time"):
        assert bins[bins["by"] == by].groupby("sensor")["count"].sum().to_dict() == total.to_dict()
    assert cells.groupby("sensor")["count"].sum().to_dict() == total.to_dict()
    one = bins[(bins["by"] == "time") & (bins["sensor"] == "mbes") & (bins["family"] == "P2")].iloc[3]
    faces = table(run, "segment/faces").set_index("face")
    seconds = found["t_ns"].to_numpy() / 1e9
    inside = (seconds >= one["low"]) & (seconds < one["low"] + one["width"]) & (found["sensor"] == "mbes").to_numpy()
    rows = found[inside & (faces.loc[found["face"], "family"] == "P2").to_numpy()]
    assert len(rows) == one["count"]
    assert one["mean_m"] == pytest.approx(np.average(rows["residual_m"], weights=rows["weight"]), abs=1e-9)


def test_planes_close(undisturbed: tuple[Path, Told]) -> None:
    """Before: the angle between the two sensors' planes of fit_planes; after: a small part of it."""
    run = undisturbed[0]
    planes = table(run, "fit_planes/planes").query("`pass` == -1").set_index(["sensor", "plane"])
    closing = table(run, "report/closing").set_index(["mount", "plane"])
    for name in ("P1", "P2", "P3"):
        normals = [
            planes.loc[(sensor, name), [f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy(dtype=float)
            for sensor in ("laser", "mbes")
        ]
        angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(*normals)), normals[0] @ normals[1]))
        before, after = closing.loc[("coarse", name)], closing.loc[("adjustment", name)]
        assert before["angle_deg"] == pytest.approx(angle, abs=1e-9)
        assert after["angle_deg"] < before["angle_deg"] / (10 if name == "P2" else 2)  # the blocks are small
        assert abs(after["distance_m"]) < 0.004 < abs(before["distance_m"])  # the total sigma of x


def test_steps_are_odd_and_keep_to_the_limit() -> None:
    assert [sampling_step(total, 100) for total in (0, 1, 100, 101, 200, 300, 301)] == [0, 1, 1, 3, 3, 3, 5]


def test_intervals_are_those_of_the_sigmas(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    rows = table(run, "report/calibration").query("method == 'adjustment'").set_index("parameter")
    sigma = result_of(run)["mbes"]["sigma_mount_total"]
    for name, row in rows.iterrows():
        key = f"{name}_deg" if row["unit"] == "deg" else f"{name}_m"
        assert row["sigma_total"] == sigma[key]
        assert row["high_95"] - row["total"] == pytest.approx(1.959964 * sigma[key])
        assert row["total"] - row["low_95"] == pytest.approx(1.959964 * sigma[key])
