"""poolcal check-entry on a small run: soundings by an independent model of a survey software, right and wrong."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stages.commands.check_entry
from pipeline.entry_check.check import EntryCheck, check_entry
from pipeline.results.finished_run import FinishedRun
from tests.support.effort import often
from tests.support.files.gsf_survey import write_gsf
from tests.support.places import poolcal
from tools.survey_software import Entry, Recording, georeferenced, in_crs, write_points

UTM = "EPSG:32651"


@pytest.fixture(autouse=True)
def compared_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """What JSON, text and the signs of a program tell of the same file is one comparison, which takes seconds."""
    kept: dict[object, EntryCheck] = {}

    def compared(run: FinishedRun, path: Path, crs: str | None, other_heights: bool) -> EntryCheck:
        question = (path.read_bytes(), crs, other_heights)
        if question not in kept:
            kept[question] = check_entry(run, path, crs, other_heights)
        return kept[question]

    monkeypatch.setattr(stages.commands.check_entry, "check_entry", compared)


def asked(finished: Path, file: Path, *more: object) -> tuple[int, dict[str, Any]]:
    told = poolcal("check-entry", finished, file, "--json", *more)
    assert told.err == ""
    return told.status, json.loads(told.out)


@pytest.mark.parametrize(
    ("name", "crs", "decimals", "geographic"),
    [
        ("测深.xyz", UTM, 3, False),
        ("a.csv", "EPSG:4979", 3, True),
        pytest.param("a.laz", UTM, 3, False, marks=pytest.mark.thorough),
        ("a.las", "EPSG:4978", 3, False),
        ("a.xyz", "EPSG:4549", 2, False),
    ],
)
def test_a_right_entry_passes(
    finished: Path, recorded: Recording, thinned: Recording, entry: Entry, tmp_path: Path,
    name: str, crs: str, decimals: int, geographic: bool,
) -> None:  # fmt: skip
    """The first form with all soundings."""
    roll, pitch, heading = (round(angle, 2) for angle in entry.angles_deg)  # as typed in
    exported = recorded if name == "测深.xyz" else thinned
    placed = georeferenced(exported, replace(entry, angles_deg=(roll, pitch, heading)))
    write_points(tmp_path / name, in_crs(placed, crs), decimals, geographic)
    status, found = asked(finished, tmp_path / name, "--crs", crs)
    assert (status, found["answer"]) == (0, "right")
    assert found["difference_deg"] < 0.01
    assert max(map(abs, found["difference_m"])) < 0.001


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        pytest.param({"angles_deg": (1, 1, -1)}, "sign_yaw", marks=pytest.mark.thorough),
        pytest.param({"angles_deg": (-1, 1, 1)}, "sign_roll", marks=pytest.mark.thorough),
        ({"order": "rph"}, "order_roll_pitch_yaw"),
        pytest.param({"lever_arm_m": (1, 1, -1)}, "sign_z", marks=pytest.mark.thorough),
    ],
)
def test_a_mistake_is_named(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path, changed: dict[str, Any], code: str
) -> None:
    signs = {key: value for key, value in changed.items() if isinstance(value, tuple)}
    values = {key: tuple(np.multiply(getattr(entry, key), value)) for key, value in signs.items()}
    file = tmp_path / "a.xyz"
    write_points(file, in_crs(georeferenced(thinned, replace(entry, **(changed | values))), UTM), 3)
    status, found = asked(finished, file)
    assert status == 1
    assert [set(one["codes"]) - {"right", "plain"} for one in found["explanations"]] == [{code}]
    text = poolcal("check-entry", finished, file)
    assert text.status == 1
    assert text.out.startswith("Not entered rightly: ")


@pytest.mark.parametrize(
    ("changed", "code", "said"),
    [
        ({"level_lever_arm": True}, "level_lever_arm", "the software adds the lever arm without roll and pitch"),
        pytest.param(
            {"range_factor": 1.003}, "sound_speed", "the software's ranges are +0.30 % longer",
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            {"shift_m": (0.31, -0.12, 0.0)}, "shift", "all soundings are shifted by +0.310 m east, -0.120 m north",
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            {"delay_s": 0.5}, "delay", "the software's poses are +0.5000 s late", marks=pytest.mark.thorough
        ),
    ],
)
def test_a_right_entry_with_something_else_wrong(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path, changed: dict[str, Any], code: str, said: str
) -> None:
    file = tmp_path / "a.xyz"
    write_points(file, in_crs(georeferenced(thinned, replace(entry, **changed)), UTM), 3)
    status, found = asked(finished, file)
    assert (status, found["answer"]) == (1, "right_but")
    assert [set(one["codes"]) - {"right", "plain"} for one in found["explanations"]] == [{code}]
    text = poolcal("check-entry", finished, file)
    assert " ".join(text.out.split()).startswith(f"Entered rightly, but {said}")


@pytest.mark.parametrize(
    ("wrong", "other"),
    [
        pytest.param({}, {"gradient_per_s": -3.0}, marks=pytest.mark.thorough),
        pytest.param({"lever_arm_m": (0.0, 0.012, 0.0)}, {"wander_m": 0.03}, marks=pytest.mark.thorough),
        ({"angles_deg": (0.04, 0.0, 0.0)}, {"steer_factor": 1.003}),
    ],
)
def test_other_rays_or_positions_prove_nothing_and_accuse_nobody(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path, wrong: dict[str, Any], other: dict[str, Any]
) -> None:
    values = {key: tuple(np.add(getattr(entry, key), value)) for key, value in wrong.items()}
    file = tmp_path / "a.xyz"
    write_points(file, in_crs(georeferenced(thinned, replace(entry, **(other | values))), UTM), 3)
    status, found = asked(finished, file)
    assert (status, found["answer"]) == (1, "uncertain")
    text = poolcal("check-entry", finished, file).out
    assert text.startswith("Cannot be told closely enough")
    assert "mm beyond rounding" in text


PARTS = ["half of each fan", "first pass", "every third ping", "without a fifth of the beams"]


@pytest.mark.parametrize("kept", often(PARTS[:1], PARTS))
def test_parts_of_the_soundings_will_do(
    finished: Path, recorded: Recording, thinned: Recording, entry: Entry, tmp_path: Path, kept: str
) -> None:
    """Half of each fan of every third ping."""
    recorded = thinned if kept == PARTS[0] else recorded
    t_s = (recorded.t_ns - recorded.t_ns[0]) / 1e9
    ping = np.unique(recorded.t_ns, return_inverse=True)[1]
    wanted = {
        "first pass": t_s < np.where(np.diff(t_s) > 5, t_s[:-1], np.inf).min() + 1,
        "half of each fan": np.median(recorded.points_m[:, 1]) < recorded.points_m[:, 1],
        "every third ping": ping % 3 == 0,
        "without a fifth of the beams": np.random.default_rng(1).random(len(t_s)) > 0.2,
    }[kept]
    file, placed = tmp_path / "a.xyz", georeferenced(recorded, entry)
    write_points(file, in_crs(placed[wanted], UTM), 3)
    assert asked(finished, file)[1]["answer"] == "right"
    (r, p, h) = entry.angles_deg
    write_points(file, in_crs(georeferenced(recorded, replace(entry, angles_deg=(r, p, -h)))[wanted], UTM), 3)
    status, found = asked(finished, file)
    assert (status, found["answer"]) == (1, "wrong")
    assert found["explanations"][0]["codes"][0] == "sign_yaw"


def test_lines_with_other_values_are_no_right_entry(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path
) -> None:
    file, placed, late = tmp_path / "a.xyz", georeferenced(thinned, entry), thinned.t_ns > np.median(thinned.t_ns)
    other = georeferenced(thinned, replace(entry, angles_deg=tuple(np.add(entry.angles_deg, 0.8))))
    write_points(file, in_crs(np.where(late[:, None], other, placed), UTM), 3)
    assert asked(finished, file)[0] == 1
    assert "or not all were placed with the same mount" in " ".join(poolcal("check-entry", finished, file).out.split())


def test_heights_of_another_surface(finished: Path, thinned: Recording, entry: Entry, tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    points = in_crs(georeferenced(thinned, entry), UTM, lift_m=-8.312)
    write_points(file, points * [1, 1, -1], 3, header="E,N,Depth")
    told = poolcal("check-entry", finished, file)
    assert told.status == 0
    assert "z is known to 0.0" in told.out.splitlines()[1]
    write_points(file, points, 3)
    told = poolcal("check-entry", finished, file)
    assert told.status == 1
    assert told.out.startswith("Entered rightly, but all heights are -8.3")
    assert poolcal("check-entry", finished, file, "--other-heights").status == 0


def test_a_gsf_file_names_signs_but_proves_no_hundredth_of_a_degree(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path
) -> None:
    file, water_m = tmp_path / "a.gsf", float(np.median(thinned.ins["height_m"])) - 1.3
    write_gsf(file, thinned, georeferenced(thinned, entry), water_m)
    status, found = asked(finished, file)
    assert (status, found["answer"]) == (1, "uncertain")
    assert found["limit_deg"] < 0.2
    assert "rounds its places to a centimetre" in poolcal("check-entry", finished, file).out
    (r, p, h) = entry.angles_deg
    write_gsf(file, thinned, georeferenced(thinned, replace(entry, angles_deg=(-r, p, h))), water_m)
    status, found = asked(finished, file)
    assert (status, found["answer"]) == (1, "wrong")
    assert {one["codes"][0] for one in found["explanations"]} == {"sign_roll"}


def test_the_values_stand_in_the_signs_of_the_program_too(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path
) -> None:
    """Qimera's heading is + to starboard: what stands there wrongly is poolcal's number, and looks entry."""
    file, (roll, pitch, heading) = tmp_path / "a.xyz", entry.angles_deg
    write_points(file, in_crs(georeferenced(thinned, replace(entry, angles_deg=(roll, pitch, -heading))), UTM), 3)
    told = poolcal("check-entry", finished, file, "--to", "qimera")
    assert (told.status, told.err) == (1, "")
    (line,) = [line for line in told.out.splitlines() if line.startswith("yaw (bow to starboard +")]
    to_be_entered, found = map(float, line.rpartition(")")[2].split()[:2])
    assert to_be_entered == pytest.approx(heading, abs=1e-4)
    assert found == pytest.approx(-heading, abs=1e-3)
    assert "add --to NAME" not in told.out
    told = poolcal("check-entry", finished, file)
    assert "These are poolcal's signs; your program may have others: add --to NAME" in told.out
    for program, said in (("qimera2", "is no program known here"), ("pdal", "takes the laser's mount")):
        told = poolcal("check-entry", finished, file, "--to", program)
        assert (told.status, told.err.count("\n")) == (2, 1)
        assert said in told.err
