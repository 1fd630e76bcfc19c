"""poolcal check-entry on a small run: soundings by an independent model of a survey software, right and wrong."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.places import Place, Told, poolcal, result_of
from tools.survey_software import Entry, Recording, entry_of, georeferenced, in_crs, recording, write_points

UTM = "EPSG:32651"


@pytest.fixture(scope="module")
def recorded(small: Path) -> Recording:
    return recording(small)


@pytest.fixture(scope="module")
def right(undisturbed: tuple[Path, Told]) -> Entry:
    return entry_of(result_of(undisturbed[0]))


@pytest.fixture(scope="module")
def run(undisturbed: tuple[Path, Told]) -> Path:
    return undisturbed[0]


def asked(run: Path, file: Path, *more: object) -> tuple[int, dict[str, Any]]:
    told = poolcal("check-entry", run, file, "--json", *more)
    assert told.err == ""
    return told.status, json.loads(told.out)


@pytest.mark.parametrize(
    ("name", "crs", "decimals", "geographic"),
    [
        ("测深.xyz", UTM, 3, False),
        ("a.csv", "EPSG:4979", 3, True),
        ("a.laz", UTM, 3, False),
        ("a.las", "EPSG:4978", 3, False),
        ("a.xyz", "EPSG:4549", 2, False),
    ],
)
def test_a_right_entry_passes(
    run: Path, recorded: Recording, right: Entry, tmp_path: Path, name: str, crs: str, decimals: int, geographic: bool
) -> None:
    roll, pitch, heading = (round(angle, 2) for angle in right.angles_deg)  # as typed in
    placed = georeferenced(recorded, replace(right, angles_deg=(roll, pitch, heading)))
    write_points(tmp_path / name, in_crs(placed, crs), decimals, geographic)
    status, found = asked(run, tmp_path / name, "--crs", crs)
    assert (status, found["answer"]) == (0, "right")
    assert found["difference_deg"] < 0.01
    assert max(map(abs, found["difference_m"])) < 0.001


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"angles_deg": (1, 1, -1)}, "sign_yaw"),
        ({"angles_deg": (-1, 1, 1)}, "sign_roll"),
        ({"order": "rph"}, "order_roll_pitch_yaw"),
        ({"lever_arm_m": (1, 1, -1)}, "sign_z"),
        ({"level_lever_arm": True}, "level_lever_arm"),
        ({"range_factor": 1.003}, "sound_speed"),
    ],
)
def test_a_mistake_is_named(
    run: Path, recorded: Recording, right: Entry, tmp_path: Path, changed: dict[str, Any], code: str
) -> None:
    signs = {key: value for key, value in changed.items() if isinstance(value, tuple)}
    values = {key: tuple(np.multiply(getattr(right, key), value)) for key, value in signs.items()}
    file = tmp_path / "a.xyz"
    write_points(file, in_crs(georeferenced(recorded, replace(right, **(changed | values))), UTM), 3)
    status, found = asked(run, file)
    assert status == 1
    assert [set(one["codes"]) - {"right", "plain"} for one in found["explanations"]] == [{code}]
    text = poolcal("check-entry", run, file)
    assert text.status == 1
    assert text.out.startswith("Not entered rightly: ")


def test_heights_of_another_surface(run: Path, recorded: Recording, right: Entry, tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    points = in_crs(georeferenced(recorded, right), UTM, lift_m=-8.312)
    write_points(file, points * [1, 1, -1], 3, header="E,N,Depth")
    told = poolcal("check-entry", run, file)
    assert told.status == 0
    assert "z not judged" in told.out.splitlines()[0]
    write_points(file, points, 3)
    assert poolcal("check-entry", run, file).status == 1
    assert poolcal("check-entry", run, file, "--other-heights").status == 0


def test_another_zone_is_named_and_swapped_axes_are_read(
    run: Path, recorded: Recording, right: Entry, tmp_path: Path
) -> None:
    file, placed = tmp_path / "a.xyz", georeferenced(recorded, right)
    write_points(file, in_crs(placed, "EPSG:32650"), 3)
    told = poolcal("check-entry", run, file, "--crs", UTM)
    assert told.status == 2
    assert "they would in EPSG:32650" in told.err
    write_points(file, in_crs(placed, UTM)[:, [1, 0, 2]], 3)
    status, found = asked(run, file, "--crs", UTM)
    assert status == 0
    assert found["swapped"]


@pytest.mark.parametrize(
    ("content", "more", "said"),
    [
        ("", (), "is empty"),
        ("a b c\n", (), "no row of three numbers"),
        ("1 2 3\n" * 100, (), "nothing says in which CRS"),
        ("599000 3988000 5\n" * 100, ("--crs", "EPSG:1"), "no coordinate reference system is known"),
        ("599000 3988000 5\n" * 100, ("--crs", "EPSG:4284"), "is on the ellipsoid"),
        ("599000 3988000 5\n" * 100, ("--crs", UTM), "lie near the run's track"),
    ],
)
def test_bad_input_is_one_line(run: Path, tmp_path: Path, content: str, more: tuple[str, ...], said: str) -> None:
    file = tmp_path / "a.xyz"
    file.write_text(content)
    told = poolcal("check-entry", run, file, *more)
    assert (told.status, told.out) == (2, "")
    assert said in told.err
    assert told.err.count("\n") == 1


def test_a_grid_is_refused(run: Path, recorded: Recording, right: Entry, tmp_path: Path) -> None:
    file = tmp_path / "a.xyz"
    points = in_crs(georeferenced(recorded, right), UTM)
    cells, first = np.unique(np.floor(points[:, :2] / 0.25), axis=0, return_index=True)
    write_points(file, np.column_stack([(cells + 0.5) * 0.25, points[first, 2]]), 3)
    told = poolcal("check-entry", run, file, "--crs", UTM)
    assert told.status == 2
    assert "a grid of 0.25 m" in told.err


def test_a_rejected_run_is_refused(done: Place, tmp_path: Path) -> None:
    path = done.run / "report" / "calibration.json"
    path.write_text(path.read_text(encoding="utf-8").replace('"verdict": "accepted"', '"verdict": "rejected"'), "utf-8")
    told = poolcal("check-entry", done.run, tmp_path / "a.xyz")
    assert told.status == 2
    assert "was rejected" in told.err
