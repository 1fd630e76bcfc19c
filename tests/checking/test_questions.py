"""Questions of poolcal check to what a survey has seen, each by itself: the INS's own quality, clocks, soundings."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.checking import clocks, expected_soundings, file_checks, ins_quality, rendering
from pipeline.checking.check_session import SessionCheck
from pipeline.checking.file_survey import SurveyedFile, survey_files
from pipeline.checking.latency import latency_findings
from pipeline.checking.track import Leg
from pipeline.config.session import SessionConfig
from pipeline.config.target import Letters, Origin
from pipeline.gps_time import NS, WEEK_NS
from pipeline.target.design import target_of

START = 2418 * WEEK_NS + 200_000 * NS
SIGMAS = {"north_m": 0.01, "east_m": 0.01, "up_m": 0.02, "roll_deg": 0.01, "pitch_deg": 0.01, "heading_deg": 0.04}
MOUNT = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.2, "y_m": 0.5, "z_m": 1.0}


def _ins(status: np.ndarray, sigmas: dict[str, float] | None = None, **more: Any) -> SurveyedFile:
    """An INS at 100 Hz with these states of its records."""
    t_ns = START + np.arange(len(status), dtype=np.int64) * (NS // 100)
    told = {} if sigmas is None else {"t_ns": t_ns} | {k: np.full(len(t_ns), v) for k, v in sigmas.items()}
    states = {"status": status.astype(np.uint8)} | more
    return SurveyedFile("ins", "ins/a.gps", 1, records=len(t_ns), epochs_ns=t_ns, columns={"t_ns": t_ns}, states=states,
                sigmas=told)  # fmt: skip


def _leg(first: int, last: int) -> Leg:
    ran = {"laser": 1.0, "mbes": 1.0}
    return Leg(START + first * NS // 100, START + last * NS // 100, 5.0, 0.4, 1.0, 1.3, True, ran)


def _judged(seen: SurveyedFile, legs: list[Leg]) -> list[tuple[str, str]]:
    quality = ins_quality.assess_ins_quality([seen], legs)
    return [(finding.severity, finding.words) for finding in ins_quality.quality_findings(quality)]


GOOD, COMPLETE, FREE = 3, 7, 6


def test_an_ins_that_is_good_in_the_passes_is_not_doubted() -> None:
    """That it was aligning before them is as it should be."""
    status = np.r_[np.full(900, COMPLETE), np.full(1100, GOOD)]
    assert _judged(_ins(status, SIGMAS), [_leg(1000, 1999)]) == []
    quality = ins_quality.assess_ins_quality([_ins(status)], [_leg(1000, 1999)])
    assert quality.by_file["ins/a.gps"]["status"] == {"INS_ALIGNMENT_COMPLETE": 900, "INS_SOLUTION_GOOD": 1100}
    assert quality.together["status"] == {"INS_SOLUTION_GOOD": 1000}


@pytest.mark.parametrize(("number", "severity"), [(90, None), (110, "fault")])
def test_alignment_in_the_passes(number: int, severity: str | None) -> None:
    status = np.full(1000, GOOD)
    status[:number] = COMPLETE
    found = _judged(_ins(status), [_leg(0, 999)])
    assert [one for one, _ in found] == ([severity] if severity else [])
    for _, words in found:
        assert "INS_ALIGNMENT_COMPLETE in 11% of its records in the passes" in words
        assert "figures of eight" in words


def test_alignment_without_known_passes_is_to_be_looked_at() -> None:
    ((severity, words),) = _judged(_ins(np.full(500, COMPLETE)), [])
    assert severity == "look"
    assert "in the whole log" in words


def test_alignment_with_a_heading_that_is_told_to_be_good_is_to_be_looked_at() -> None:
    assert [one for one, _ in _judged(_ins(np.full(500, COMPLETE), SIGMAS), [_leg(0, 499)])] == ["look"]


def test_a_solution_without_gnss_is_to_be_looked_at() -> None:
    ((severity, words),) = _judged(_ins(np.full(500, FREE)), [_leg(0, 499)])
    assert severity == "look"
    assert "without GNSS" in words


@pytest.mark.parametrize(
    ("sigma", "value", "severity", "said"),
    [
        ("heading_deg", 0.19, None, ""),
        ("heading_deg", 0.21, "look", "heading is good to 0.21°"),
        ("heading_deg", 14.0, "fault", "heading is good to 14° by the log itself (median in the passes): sail"),
        ("up_m", 0.45, "look", "height is good to 0.45 m"),
        ("up_m", 2.3, "fault", "height is good to 2.3 m"),
    ],
)
def test_the_ins_s_own_sigmas(sigma: str, value: float, severity: str | None, said: str) -> None:
    found = _judged(_ins(np.full(500, GOOD), SIGMAS | {sigma: value}), [_leg(100, 400)])
    assert [one for one, _ in found] == ([severity] if severity else [])
    assert all(said in words for _, words in found)


@pytest.mark.parametrize(("kind", "doubted"), [(53, True), (55, True), (56, False), (74, False)])
def test_the_kind_of_positions(kind: int, doubted: bool) -> None:
    found = _judged(_ins(np.full(500, GOOD), SIGMAS, type=np.full(500, kind, np.uint8)), [_leg(0, 499)])
    assert [one for one, _ in found] == (["look"] if doubted else [])


def test_people_and_programs_see_states_and_sigmas() -> None:
    seen = _ins(np.r_[np.full(100, COMPLETE), np.full(300, GOOD)], SIGMAS)
    examined = SessionCheck((seen,), (), (), quality=ins_quality.assess_ins_quality([seen], []))
    text = rendering.check_text(examined)
    assert "ins/a.gps: INS_SOLUTION_GOOD 75%, INS_ALIGNMENT_COMPLETE 25%" in text
    assert "horizontal 0.01 m" in text
    assert "heading 0.04°" in text
    assert '"INS_ALIGNMENT_COMPLETE": 100' in rendering.check_json(examined)


# --- clocks ----------------------------------------------------------------------------------------------------------
def _epochs(**weeks: int) -> dict[str, np.ndarray]:
    """The INS runs 100 s, both others within it; all shifted by weeks."""
    t_ns = START + np.arange(0, 100, 0.1) * NS
    return {
        sensor: (t_ns if sensor == "ins" else t_ns[100:900]).astype(np.int64) + weeks.get(sensor, 0) * WEEK_NS
        for sensor in ("ins", "laser", "mbes")
    }


@pytest.mark.parametrize("off", [-2, 1])
def test_of_three_clocks_the_odd_one_is_named_with_its_week(off: int) -> None:
    weeks = {"ins": 2418 + off, "laser": None}
    (found,) = clocks.clock_findings(_epochs(ins=off), 5 * NS, [], weeks)
    way = "ahead of" if off > 0 else "behind"
    assert f"ins: its clock is {'1 week' if off == 1 else '2 weeks'} {way} both sensors'" in found.words
    assert f"write ins.gps_week: 2418 in place of {2418 + off}" in found.words


def test_a_laser_off_by_a_week_is_odd_against_ins_and_sonar() -> None:
    (found,) = clocks.clock_findings(_epochs(laser=1), 5 * NS, [], {"ins": 2418, "laser": 2419})
    assert "laser: its clock is 1 week ahead of the INS's and the sonar's" in found.words
    assert "write laser.gps_week: 2418 in place of 2419" in found.words
    (found,) = clocks.clock_findings(_epochs(laser=1), 5 * NS, [], {"ins": None, "laser": None})
    assert "check gps_week, and the GPS time flag" in found.words  # the week is the file's


def test_a_sonar_that_also_missed_the_ins_is_no_witness() -> None:
    """It ran on for a minute after the INS, for no reason that has a name."""
    epochs = _epochs(laser=1)
    epochs["mbes"] = (START + np.arange(10, 160, 0.1) * NS).astype(np.int64)
    laser, _ = clocks.clock_findings(epochs, 5 * NS, [])
    assert "laser: its clock is 1 week ahead of the INS's: " in laser.words


def test_clocks_that_agree() -> None:
    assert list(clocks.clock_findings(_epochs(), 5 * NS, [], {})) == []


# --- soundings -------------------------------------------------------------------------------------------------------
def _blocks() -> Letters:
    return Letters(a=8, b=3, c=1, e=0.5, origin=Origin(latitude_deg=36, longitude_deg=120, height_m=12))


@pytest.mark.parametrize(("share", "severity"), [(0.5, None), (0.38, "look"), (0.16, "look"), (0.1, "fault")])
def test_how_many_soundings_are_too_few(share: float, severity: str | None) -> None:
    model = target_of(_blocks())
    wanted = np.full(len(model.faces), 1000.0)
    found = list(expected_soundings.faces_missed(model, expected_soundings.SoundingCounts(wanted, share * wanted)))
    assert {one.severity for one in found} == ({severity} if severity else set())
    assert all(f"({share:.0%}; usual: 60 to 120 %)" in one.words for one in found)


@pytest.mark.parametrize(("each", "severity"), [(1.0, "look"), (50.0, "look"), (400.0, None)])
def test_a_small_sample_does_not_tell_that_soundings_are_few(each: float, severity: str | None) -> None:
    """Some 4000 in each half: with one in 400 read they are ten soundings, and may as well be twice as many."""
    model = target_of(_blocks())
    wanted = np.full(len(model.faces), 1000.0)
    counts = expected_soundings.SoundingCounts(wanted, 0.3 * wanted, each)
    found = expected_soundings.faces_missed(model, counts)
    assert {one.severity for one in found} == ({severity} if severity else set())


def test_one_face_that_is_bare_is_to_be_looked_at() -> None:
    model = target_of(_blocks())
    wanted = np.full(len(model.faces), 1000.0)
    there = wanted.copy()
    there[3] = 20.0
    (found,) = expected_soundings.faces_missed(model, expected_soundings.SoundingCounts(wanted, there))
    assert found.severity == "look"
    name = model.faces[3].name
    assert f"about 20 soundings on the face {name}, where these pings should give about 1000" in found.words
    wanted[3] = 100.0  # too few to tell
    assert list(expected_soundings.faces_missed(model, expected_soundings.SoundingCounts(wanted, there))) == []


def test_families_of_soundings_stand_in_their_order_with_their_share() -> None:
    model = target_of(_blocks())
    many = np.full(len(model.faces), 1000.0)
    counts = expected_soundings.SoundingCounts(many, 0.8 * many)
    lines = rendering._soundings_lines(SessionCheck((), (), (), model, counts))
    assert [line.split()[0] for line in lines[2:6]] == ["P1", "P2", "P3", "H"]
    assert all(line.endswith("80%") for line in lines[2:6])
    assert lines[6].startswith("~: estimated")
    assert lines[7].startswith("Faces, as seen from the passing boat: P1: ")


def test_a_latency_is_told_as_an_interval() -> None:
    """A guess from a sample: the adjustment of all points finds the amount."""
    row = {"unknown": "mbes_latency", "estimated": False, "value": 0.0156, "sigma": 0.0008, "expected": 0.001}
    (found,) = latency_findings(pd.DataFrame([row]))
    assert "mbes: its clock is 16 ms ahead of the INS's (14.0 to 17.2 ms, 95 %)" in found.words
    assert "adjust.free: [mbes_latency]" in found.words


@pytest.mark.parametrize(("ahead_s", "said"), [(0.020, "behind"), (-0.020, "ahead of")])
def test_a_latency_of_the_ins_is_given_with_its_sign(ahead_s: float, said: str) -> None:
    """Both sensors are ahead of an INS that is behind them; latency is taken off the recorded time."""
    of = {"estimated": False, "value": ahead_s, "sigma": 0.0008, "expected": 0.001}
    (found,) = latency_findings(pd.DataFrame([{"unknown": f"{sensor}_latency"} | of for sensor in ("laser", "mbes")]))
    assert f"ins: its clock is 20 ms {said} both sensors' (18.9 to 21.1 ms, 95 %)" in found.words
    assert f"about {-ahead_s:+.3f} s, to ins.latency_s" in found.words


# --- files -----------------------------------------------------------------------------------------------------------
def _session(folder: Path, **mbes: float) -> SessionConfig:
    return SessionConfig.model_validate({
        "name": "x",
        "ins": {"files": ["ins/*"], "format": "table"},
        "laser": {"files": ["laser/*"], "format": "table", "mount": MOUNT},
        "mbes": {"files": ["mbes/*"], "format": "table", "mount": MOUNT | mbes},
    }, strict=False)  # fmt: skip


@pytest.mark.parametrize(("arm_m", "doubted"), [(4.9, False), (-5.1, True), (38.0, True)])
def test_a_lever_arm_as_long_as_a_boat_is_doubted(tmp_path: Path, arm_m: float, doubted: bool) -> None:
    found = list(file_checks.long_lever_arms(_session(tmp_path, x_m=arm_m)))
    assert [one.severity for one in found] == (["look"] if doubted else [])
    assert all("is it in cm" in one.words for one in found)


def test_points_of_another_zone_are_told_by_how_far_they_lie(tmp_path: Path) -> None:
    def seen(east_m: float) -> list[SurveyedFile]:
        angles = np.radians([[36.0], [120.0]])
        ins = {"latitude_rad": angles[0], "longitude_rad": angles[1], "height_m": np.zeros(1)}
        at = np.array([-2583123.0, 4474100.0, 3728191.0]) + east_m * np.array([-np.sin(angles[1][0]), -0.5, 0.0])
        laser = {f"{axis}_m": at[k : k + 1] for k, axis in enumerate("xyz")}
        points = SurveyedFile("laser", "laser/a.las", 1, records=1, columns=laser)
        return [SurveyedFile("ins", "i", 1, records=1, columns=ins), points]

    settings = _session(tmp_path).laser.model_copy(update={"frame": "EPSG:32650"})
    session = _session(tmp_path).model_copy(update={"laser": settings})
    assert list(file_checks.wrong_frames(seen(100.0), session)) == []
    (found,) = file_checks.wrong_frames(seen(542_000.0), session)
    ins, laser = seen(100.0)
    on_the_road = {name: np.r_[np.full(40, 0.6), values] for name, values in ins.columns.items()}
    assert list(file_checks.wrong_frames([replace(ins, records=41, columns=on_the_road), laser], session)) == []
    assert "its points lie 542 km from the INS's track with laser.frame EPSG:32650: another zone" in found.words


def test_a_file_that_goes_away_meanwhile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pipeline.checking import file_survey as surveying

    for sensor in ("ins", "laser", "mbes"):
        (tmp_path / sensor).mkdir()
        (tmp_path / sensor / "a.csv").write_text("t\n1\n")
    listed: Callable[..., Any] = surveying._parts

    def and_then_gone(sensor: str, settings: Any, folder: Path, names: list[str]) -> Any:
        for name, parts in listed(sensor, settings, folder, names):
            (folder / name).unlink()
            yield name, parts

    monkeypatch.setattr(surveying, "_parts", and_then_gone)
    found, _ = survey_files(_session(tmp_path), tmp_path)
    assert len(found) == 3
    assert all("cannot be read (No such file or directory); was it moved meanwhile?" in one.complaint for one in found)


def test_overlapping_files_are_found_among_many_quickly() -> None:
    """Ten thousand one after the other, and one of them twice: as many pairs as there are, not fifty million."""
    def seen(number: int, name: str) -> SurveyedFile:
        t_ns = START + number * 10 * NS + np.arange(9, dtype=np.int64) * NS
        return SurveyedFile("laser", name, 1, records=9, epochs_ns=t_ns)

    many = [seen(number, f"laser/{number}.las") for number in range(10_000)] + [seen(5_000, "laser/again.las")]
    pairs = list(file_checks._overlapping(many))
    assert [(one.name, other.name) for one, other in pairs] == [("laser/5000.las", "laser/again.las")]
    (found,) = file_checks.duplicate_files(many)
    assert found.words.startswith("laser/again.las: is the same recording as laser/5000.las")
