"""poolcal check: good sessions stay clean, each planted fault is named, and nothing else beside it."""

import json
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stages.commands.check
from pipeline.checking import excerpts
from pipeline.checking.trial_calibration import TrialCalibration
from tests.support.effort import often
from tests.support.places import edit, poolcal, simulate
from tests.support.roots import SCENARIOS

FINE: dict[str, Any] = {"ins": {"rate_hz": 100.0}, "mbes": {"ping_rate_hz": 10.0}}
Spoilt = Callable[[Path], None]


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Sessions by scenario and changed blocks, each simulated once. Nobody changes them."""
    place = tmp_path_factory.mktemp("checked")
    made: dict[str, Path] = {}

    def session(scenario: str = "default", **blocks: Any) -> Path:
        key = json.dumps([scenario, blocks])
        if key not in made:
            made[key] = simulate(place / f"{len(made)}", base=SCENARIOS / f"{scenario}.yaml", **(FINE | blocks))
        return made[key]

    return session


@pytest.fixture
def spoilt(good: Callable[..., Path], tmp_path: Path) -> Callable[..., Path]:
    """A copy of one's own."""

    def copy(*words: str, **blocks: Any) -> Path:
        folder = tmp_path / "session"
        shutil.copytree(good(*words, **blocks), folder)
        return folder

    return copy


@pytest.fixture(autouse=True)
def _calibrated(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Seconds are spent on calibrating a sample only where it is asked what that tells."""
    if not request.node.get_closest_marker("calibrates"):
        monkeypatch.setattr(stages.commands.check, "_calibrated", lambda *_: TrialCalibration())


def checked(session: Path) -> tuple[int, list[dict[str, Any]]]:
    told = poolcal("check", session, "--config", session / "pool.yaml", "--json")
    assert told.status in (0, 1), told.err
    return told.status, json.loads(told.out)["findings"]


def only(session: Path, question: str, *words: str, severity: str = "fault") -> None:
    """One kind of finding alone, in these words."""
    status, found = checked(session)
    assert {one["question"] for one in found} == {question}, found
    assert {one["severity"] for one in found} == {severity}
    assert status == (severity == "fault")
    said = " ".join(one["words"] for one in found)
    for word in words:
        assert word in said, said
    assert all("\n" not in one["words"] for one in found)


@pytest.mark.calibrates
@pytest.mark.parametrize("scenario", ["default", "drift", "messy", "small_target", "azimuth_163"])
def test_a_good_session_is_clean(good: Callable[..., Path], scenario: str) -> None:
    assert checked(good(scenario)) == (0, [])


@pytest.mark.calibrates
def test_a_good_session_of_which_only_pieces_are_read(
    good: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    session = good()
    monkeypatch.setattr(excerpts, "POINTS", 16_000)
    monkeypatch.setattr(excerpts, "STRETCH", 500)
    monkeypatch.setattr(excerpts, "BYTES", {"ins": 150_000, "mbes": 200_000})
    monkeypatch.setattr(excerpts, "LEAST", {"ins": 10_000, "mbes": 20_000})
    monkeypatch.setattr(excerpts, "HEAD", 20_000)
    told = poolcal("check", session, "--config", session / "pool.yaml", "--json")
    content = json.loads(told.out)
    assert content["findings"] == []
    assert all(file["share_read"] < 1.0 for file in content["files"]), content["files"]
    assert all(passed["ran"] == {"laser": 1.0, "mbes": 1.0} for passed in content["passes"])


def test_a_good_session_with_points_in_a_crs_and_odd_names(spoilt: Callable[..., Path]) -> None:
    session = spoilt(laser={"frame": "EPSG:4978", "format": "las", "point_rate_hz": 2000.0})
    path = session / "laser" / "pass_0.las"
    path.rename(path.with_name("pass #0.las"))
    assert checked(session) == (0, [])


@pytest.mark.parametrize(("ins_s", "severity"), [((2.0, 100.0), "look"), ((40.0, 100.0), "fault")])
def test_sensors_that_ran_before_the_ins_are_no_clocks(
    spoilt: Callable[..., Path], ins_s: tuple[float, float], severity: str
) -> None:
    """Switched on a little sooner: nothing lost. A pass without it: its file is missing."""
    session = spoilt(**SBET)
    path = session / "ins" / "ins.sbet"
    records = np.fromfile(path, "<f8").reshape(-1, 17)
    since = records[:, 0] - records[0, 0]
    records[(since >= ins_s[0] + 8.0) & (since <= ins_s[1])].tofile(path)
    status, found = checked(session)
    assert {one["severity"] for one in found if one["question"] == "ins missing"} <= {severity}
    assert not [one for one in found if one["question"] == "clock"], found
    assert status == (severity == "fault")


def test_people_see_files_passes_and_that_nothing_was_found(good: Callable[..., Path]) -> None:
    told = poolcal("check", good(), "--config", good() / "pool.yaml")
    lines = told.out.splitlines()
    assert [line.split()[:2] for line in lines[1:4]] == [
        ["ins", "ins/ins.gps"], ["laser", "laser/pass_0.las"], ["laser", "laser/pass_1.las"],
    ]
    assert "100 Hz" in lines[1]
    assert lines[-1] == "Nothing found."
    assert sum("100%    100%" in line for line in lines) == 2
    unasked = poolcal("check", good()).out.splitlines()
    assert unasked[-2] == "Nothing found."
    assert unasked[-1].startswith("Target, mounts and soundings were not checked: give")


@pytest.mark.calibrates
def test_soundings_are_as_many_as_the_passes_should_give(good: Callable[..., Path]) -> None:
    told = poolcal("check", good("small_target"), "--config", good("small_target") / "pool.yaml", "--json")
    faces = json.loads(told.out)["soundings"]
    assert {face["family"] for face in faces} == {"P1", "P2", "P3", "H"}
    by_family = {name: [face for face in faces if face["family"] == name] for name in ("P1", "P2", "P3")}
    for name, some in by_family.items():
        expected, found = (sum(face[key] for face in some) for key in ("expected", "found"))
        assert expected > 300
        assert found == pytest.approx(expected, rel=0.3), name


def test_without_a_config_nothing_is_asked_of_the_target(good: Callable[..., Path]) -> None:
    told = poolcal("check", good(), "--json")
    assert told.status == 0
    assert json.loads(told.out)["passes"] == []


def _shift_ins(session: Path, seconds: float) -> None:
    """SBET: the first of 17 doubles is the time."""
    path = session / "ins" / "ins.sbet"
    records = np.fromfile(path, "<f8").reshape(-1, 17)
    records[:, 0] += seconds
    records.tofile(path)


SBET = {"ins": {"rate_hz": 100.0, "format": "sbet"}}


def test_utc_taken_for_gps_shows_in_when_sensors_ran(spoilt: Callable[..., Path]) -> None:
    session = spoilt(**SBET)
    _shift_ins(session, -18.0)  # the INS in UTC
    only(session, "clock", "ins: its clock is 18 s behind both sensors'", "UTC and GPS time are mixed up")


def test_a_clock_is_told_from_the_target_where_all_ran_on(spoilt: Callable[..., Path]) -> None:
    """With sensors that run without pause when they ran tells nothing."""
    session = spoilt("messy")
    edit(session / "session.yaml", "laser", latency_s=7.0)  # taken off: the laser is 7 s behind
    only(session, "clock", "laser: its points hit the target if its clock is", " s behind the INS's")
    said = checked(session)[1][0]["words"]
    assert abs(float(said.split("clock is ")[1].split(" s")[0]) - 7.0) < 1.0  # the origin is 0.2 m off along the track


@pytest.mark.parametrize(("weeks", "said"), [(-1, "1 week behind"), (2, "2 weeks ahead of")])
def test_a_wrong_week(spoilt: Callable[..., Path], weeks: int, said: str) -> None:
    session = spoilt(**SBET)
    edit(session / "session.yaml", "ins", gps_week=2418 + weeks)
    week = f"write ins.gps_week: 2418 in place of {2418 + weeks}"
    only(session, "clock", f"ins: its clock is {said} both sensors'", week)


def test_a_time_zone(spoilt: Callable[..., Path]) -> None:
    session = spoilt(**SBET)
    _shift_ins(session, 8 * 3600.0)
    only(session, "clock", "8 hours ahead of both sensors'", "time zone")


@pytest.mark.parametrize(
    ("days", "said"),
    [(-2, ("2 days behind", "all of a Sunday and seem to be")), (1, ("1 day ahead", "check the clocks"))],
)
def test_whole_days(spoilt: Callable[..., Path], days: int, said: tuple[str, ...]) -> None:
    """Seconds of the day in place of the week are those of a Sunday; the session is of a Tuesday."""
    session = spoilt(**SBET)
    _shift_ins(session, days * 86_400.0)
    only(session, "clock", *said)


@pytest.mark.calibrates
@pytest.mark.parametrize(
    ("sensor", "latency_ms"), [("mbes", -16), ("ins", 20), *often([], [("laser", 12), ("mbes", 100)])]
)
def test_a_clock_off_by_milliseconds(spoilt: Callable[..., Path], sensor: str, latency_ms: int) -> None:
    """Latency is taken off: a clock of which too much is taken off is behind."""
    session = spoilt(**FINE)
    edit(session / "session.yaml", sensor, latency_s=latency_ms / 1000)
    only(session, "latency", f"{sensor}: its clock is", "ahead of" if latency_ms < 0 else "behind", " ms ")
    said = checked(session)[1][0]["words"]
    assert abs(float(said.split(" is ")[1].split(" ms")[0]) - abs(latency_ms)) < 8
    low, high = (float(number) for number in said.split(" (")[1].split(" ms, 95 %")[0].split(" to "))
    assert low - 8 < abs(latency_ms) < high + 8
    if sensor == "ins":
        assert abs(float(said.split("about ")[1].split(" s,")[0]) + latency_ms / 1000) < 0.008
    else:
        assert f"{sensor}_latency]" in said


def test_one_recording_twice(spoilt: Callable[..., Path]) -> None:
    session = spoilt()
    shutil.copy(session / "mbes" / "pass_1.xtf", session / "mbes" / "pass_9.xtf")
    only(session, "twice", "mbes/pass_9.xtf: is the same recording as mbes/pass_1.xtf")


@pytest.mark.parametrize("sensor", ["mbes", "laser"])
def test_a_missing_pass(spoilt: Callable[..., Path], sensor: str) -> None:
    session = spoilt()
    sorted((session / sensor).iterdir())[1].unlink()
    only(session, "missing pass", f"{sensor}: did not run in the pass of 2026-05-12T08:01", "at 7.0 m")


def test_a_slow_ins(spoilt: Callable[..., Path]) -> None:
    only(spoilt(ins={"rate_hz": 20.0}), "ins rate", "logged at 20.0 Hz", "100 Hz or more")


def test_a_hole_in_the_ins(spoilt: Callable[..., Path]) -> None:
    session = spoilt(**SBET)
    path = session / "ins" / "ins.sbet"
    records = np.fromfile(path, "<f8").reshape(-1, 17)
    np.delete(records, np.s_[1000:1200], axis=0).tofile(path)  # 10 s after it began, in the first pass: 2 s
    only(session, "ins hole", "1 hole", "2.0 s")


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
    only(session, question, words)


def test_a_target_turned_round(spoilt: Callable[..., Path]) -> None:
    session = spoilt()
    edit(session / "pool.yaml", "target", azimuth_deg=180.0)
    only(session, "side", "behind the target", "180")


def test_a_wrong_sign_of_the_mount(spoilt: Callable[..., Path]) -> None:
    session = spoilt()
    edit(session / "session.yaml", "mbes", mount={"roll_deg": 48.0})
    only(session, "target", "mbes.mount.roll_deg = -48 in place of 48")


def test_passes_at_one_distance(spoilt: Callable[..., Path]) -> None:
    track = {"distances_m": [5.0, 5.1], "half_length_m": 3.6}
    only(spoilt(track=track), "distances", "5.1 m from the wall (within 0.1 m)", severity="look")


def test_different_sound_speeds(spoilt: Callable[..., Path]) -> None:
    slow = {"sound_speed_true_m_s": 1380.0, "sound_speed_recorded_m_s": 1380.0, "ping_rate_hz": 10.0}
    only(spoilt(mbes=slow), "sound speed", "1380.0 m/s", "outside 1400 to 1560")


@pytest.mark.calibrates
def test_a_fan_that_does_not_reach_the_lower_blocks(spoilt: Callable[..., Path]) -> None:
    """4.3 m reach from the nearer pass (the head 3.7 m from the wall, 0.7 m deep) to 2.2 m below the head."""
    short = {"ping_rate_hz": 10.0, "max_range_m": 4.3}
    only(spoilt(mbes=short), "faces", "lower half of the water", "the fan does not reach them")


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
    only(session, "frame", "laser.frame is laser", "georeferenced")


def test_an_ins_that_never_aligned(spoilt: Callable[..., Path]) -> None:
    session = spoilt(ins={"rate_hz": 50.0, "aligning_s": 3500.0})
    only(session, "alignment", "no solution in most of its records", "INS_ALIGNING")


def test_a_session_that_cannot_be_looked_at(tmp_path: Path) -> None:
    told = poolcal("check", tmp_path)
    assert told.status == 2
    assert "session.yaml" in told.err
