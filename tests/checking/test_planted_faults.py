"""poolcal check: each planted fault of files, target and settings is named, and nothing else beside it."""

import shutil
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

from tests.support.checks import SBET, assert_only, checked
from tests.support.places import edit, poolcal

pytestmark = pytest.mark.usefixtures("calibrated_where_marked")
Spoilt = Callable[[Path], None]


def test_one_recording_twice(spoilt: Callable[..., Path]) -> None:
    session = spoilt()
    shutil.copy(session / "mbes" / "pass_1.xtf", session / "mbes" / "pass_9.xtf")
    assert_only(session, "twice", "mbes/pass_9.xtf: is the same recording as mbes/pass_1.xtf")


@pytest.mark.parametrize("sensor", ["mbes", "laser"])
def test_a_missing_pass(spoilt: Callable[..., Path], sensor: str) -> None:
    session = spoilt()
    sorted((session / sensor).iterdir())[1].unlink()
    assert_only(session, "missing pass", f"{sensor}: did not run in the pass of 2026-05-12T08:01", "at 7.0 m")


def test_a_slow_ins(spoilt: Callable[..., Path]) -> None:
    assert_only(spoilt(ins={"rate_hz": 20.0}), "ins rate", "logged at 20.0 Hz", "100 Hz or more")


def test_soundings_with_the_times_of_their_echoes(spoilt: Callable[..., Path], tmp_path: Path) -> None:
    """The run refuses them in the same words; that the fan reaches too little is not said, for it does."""
    session = spoilt(mbes={"stamp": "reception", "format": "parquet"})
    first = assert_only(session, "stamps", "mbes/pass_0.parquet", "less their two-way times in", "export one time for")
    told = poolcal("run", session, "--config", session / "pool.yaml", "--run", tmp_path / "run")
    assert told.status == 2
    assert told.complaints[-1].startswith("poolcal: mbes/pass_0.parquet: the soundings do not have the time of")
    assert first.split(": they lie")[0] in told.complaints[-1]


def test_a_hole_in_the_ins(spoilt: Callable[..., Path]) -> None:
    session = spoilt(**SBET)
    path = session / "ins" / "ins.sbet"
    records = np.fromfile(path, "<f8").reshape(-1, 17)
    np.delete(records, np.s_[1000:1200], axis=0).tofile(path)  # 10 s after it began, in the first pass: 2 s
    assert_only(session, "ins hole", "1 hole", "2.0 s")


def _keep_half(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2 + 7])


FILES: Iterable[tuple[str, Spoilt, str, str]] = (
    ("truncated", lambda s: _keep_half(s / "laser/pass_0.las"), "cut off", "laser/pass_0.las"),
    ("empty", lambda s: (s / "mbes/pass_1.xtf").write_bytes(b"") and None, "file", "mbes/pass_1.xtf: is empty"),
    ("kind", lambda s: shutil.copy(s / "ins/ins.gps", s / "mbes/pass_1.xtf") and None, "file", "is a NovAtel log"),
)


@pytest.mark.parametrize(("spoil", "question", "words"), [pytest.param(*one[1:], id=one[0]) for one in FILES])
def test_a_bad_file_does_not_end_the_look(
    spoilt: Callable[..., Path], spoil: Spoilt, question: str, words: str
) -> None:
    session = spoilt()
    spoil(session)
    status, found = checked(session)
    assert status == 1
    assert [one for one in found if one["question"] == question and words in one["words"]]
    assert {one["question"] for one in found} <= {question, "missing pass"}  # without the file its pass is missing


ORIGINS = (
    ({"height_m": 36.5}, "height", "below target.origin.height_m"),
    ({"latitude_deg": -36.0}, "origin", "latitude_deg has the wrong sign"),
    ({"latitude_deg": 36.0, "longitude_deg": -120.1}, "origin", "longitude_deg has the wrong sign"),
)


@pytest.mark.parametrize(("origin", "question", "words"), ORIGINS)
def test_a_wrong_origin(spoilt: Callable[..., Path], origin: dict[str, float], question: str, words: str) -> None:
    session = spoilt()
    edit(session / "pool.yaml", "target", origin=origin)
    assert_only(session, question, words)


def test_a_target_turned_round(spoilt: Callable[..., Path]) -> None:
    session = spoilt()
    edit(session / "pool.yaml", "target", azimuth_deg=180.0)
    assert_only(session, "side", "behind the target", "180")


def test_a_wrong_sign_of_the_mount(spoilt: Callable[..., Path]) -> None:
    session = spoilt()
    edit(session / "session.yaml", "mbes", mount={"roll_deg": 48.0})
    assert_only(session, "target", "mbes.mount.roll_deg = -48 in place of 48")


def test_passes_at_one_distance(spoilt: Callable[..., Path]) -> None:
    track = {"distances_m": [5.0, 5.1], "half_length_m": 3.6}
    assert_only(spoilt(track=track), "distances", "5.1 m from the wall (within 0.1 m)", severity="look")


def test_different_sound_speeds(spoilt: Callable[..., Path]) -> None:
    slow = {"sound_speed_true_m_s": 1380.0, "sound_speed_recorded_m_s": 1380.0, "ping_rate_hz": 10.0}
    assert_only(spoilt(mbes=slow), "sound speed", "1380.0 m/s", "outside 1400 to 1560")


@pytest.mark.calibrates
def test_a_fan_that_does_not_reach_the_lower_blocks(spoilt: Callable[..., Path]) -> None:
    """4.3 m reach from the nearer pass (the head 3.7 m from the wall, 0.7 m deep) to 2.2 m below the head."""
    short = {"ping_rate_hz": 10.0, "max_range_m": 4.3}
    assert_only(spoilt(mbes=short), "faces", "lower half of the water", "the fan does not reach them")


def test_points_in_millimetres(spoilt: Callable[..., Path]) -> None:
    import laspy

    session = spoilt()
    for path in (session / "laser").iterdir():
        cloud = laspy.read(path)
        cloud.header.scales = cloud.header.scales * 1000  # the same whole numbers, in steps a thousand times as large
        path.unlink()
        with laspy.open(path, mode="w", header=cloud.header) as out:
            raw = laspy.ScaleAwarePointRecord(
                cloud.points.array, cloud.point_format, cloud.header.scales, cloud.header.offsets
            )
            out.write_points(raw)
    status, found = checked(session)
    assert status == 1
    assert any("0.001" in one["words"] or "millimetres" in one["words"] or "steps of" in one["words"] for one in found)


def test_georeferenced_points_declared_as_the_scanners_own(spoilt: Callable[..., Path]) -> None:
    session = spoilt(laser={"frame": "EPSG:4978", "format": "las", "point_rate_hz": 2000.0})
    edit(session / "session.yaml", "laser", frame="laser")
    assert_only(session, "frame", "laser.frame is laser", "georeferenced")


def test_an_ins_that_never_aligned(spoilt: Callable[..., Path]) -> None:
    session = spoilt(ins={"rate_hz": 50.0, "aligning_s": 3500.0})
    assert_only(session, "alignment", "no solution in most of its records", "INS_ALIGNING")


def test_a_session_that_cannot_be_looked_at(tmp_path: Path) -> None:
    told = poolcal("check", tmp_path)
    assert told.status == 2
    assert "session.yaml" in told.err
