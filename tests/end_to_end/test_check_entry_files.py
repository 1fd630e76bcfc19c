"""poolcal check-entry: files that are read, with what CRS and order, and those that are refused in one line."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.effort import often
from tests.support.files.gsf_survey import write_gsf
from tests.support.places import Place, Told, poolcal
from tools.survey_software import Entry, Recording, georeferenced, in_crs, write_points

UTM = "EPSG:32651"


def test_another_zone_is_named_and_swapped_axes_are_read(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path
) -> None:
    file, placed = tmp_path / "a.xyz", georeferenced(thinned, entry)
    write_points(file, in_crs(placed, "EPSG:32650"), 3)
    told = poolcal("check-entry", finished, file, "--crs", UTM)
    assert (told.status, told.out, told.err.count("\n")) == (2, "", 1)
    assert "they would in EPSG:32650" in told.err
    write_points(file, in_crs(placed, "EPSG:4549"), 3)  # CGCS2000, 3-degree zone at 120 E: another scale and false east
    told = poolcal("check-entry", finished, file, "--crs", UTM)
    assert (told.status, told.out, told.err.count("\n")) == (2, "", 1)
    assert "EPSG:4549" in told.err
    write_points(file, np.add(in_crs(placed, UTM), [1000.0, 0.0, 0.0]), 3)
    told = poolcal("check-entry", finished, file, "--crs", UTM)
    assert told.status == 2
    assert "m from the target; is it another datum, another CRS, or another session?" in told.err
    write_points(file, in_crs(placed, UTM)[:59], 3)
    told = poolcal("check-entry", finished, file)
    assert "too few soundings lie near the run's track (59; 60 are needed)" in told.err
    write_points(file, in_crs(placed, UTM)[:, [1, 0, 2]], 3)
    told = poolcal("check-entry", finished, file, "--crs", UTM)
    assert told.status == 0
    assert "first coordinate north" in told.out


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
def test_bad_input_is_one_line(finished: Path, tmp_path: Path, content: str, more: tuple[str, ...], said: str) -> None:
    file = tmp_path / "a.xyz"
    file.write_text(content)
    told = poolcal("check-entry", finished, file, *more)
    assert (told.status, told.out) == (2, "")
    assert said in told.err
    assert told.err.count("\n") == 1


def test_a_cloud_of_poolcal_itself_proves_nothing(finished: Path, tmp_path: Path) -> None:
    assert poolcal("export", finished, "--to", "laz", "--crs", UTM, "--out", tmp_path / "own.laz").status == 0
    told = poolcal("check-entry", finished, tmp_path / "own.laz")
    assert (told.status, told.out, told.err.count("\n")) == (2, "", 1)
    assert "proves nothing of another program" in told.err


def test_a_grid_is_refused(finished: Path, thinned: Recording, entry: Entry, tmp_path: Path) -> None:
    file = tmp_path / "a.xyz"
    points = in_crs(georeferenced(thinned, entry), UTM)
    cells, first = np.unique(np.floor(points[:, :2] / 0.25), axis=0, return_index=True)
    write_points(file, np.column_stack([(cells + 0.5) * 0.25, points[first, 2]]), 3)
    told = poolcal("check-entry", finished, file, "--crs", UTM)
    assert told.status == 2
    assert "a grid of 0.25 m" in told.err


def test_another_session_is_refused(finished: Path, thinned: Recording, entry: Entry, tmp_path: Path) -> None:
    """The same target and mount, but another track and noise of its own."""
    noise = np.random.default_rng(6).normal(0, 0.01, (len(thinned.t_ns), 1))
    other = replace(
        thinned, points_m=thinned.points_m * (1 + noise / np.linalg.norm(thinned.points_m, axis=1)[:, None])
    )
    file = tmp_path / "a.xyz"
    write_points(file, in_crs(georeferenced(other, replace(entry, wander_m=0.3)), UTM), 3)
    told = poolcal("check-entry", finished, file)
    assert (told.status, told.out) == (2, "")
    assert "is it the same session?" in told.err


@pytest.mark.parametrize("ending", often(["xyz", "gsf"], ["xyz", "las", "laz", "gsf"]))
def test_a_file_that_was_cut_is_used_as_far_as_it_goes_or_refused_in_one_line(
    finished: Path, thinned: Recording, entry: Entry, tmp_path: Path, ending: str
) -> None:
    file, placed = tmp_path / f"a.{ending}", georeferenced(thinned, entry)
    if ending == "gsf":
        write_gsf(file, thinned, placed, float(np.median(thinned.ins["height_m"])) - 1.3)
    else:
        write_points(file, in_crs(placed, UTM), 3)
    content = file.read_bytes()
    file.write_bytes(content[: len(content) * 6 // 10 + 7])
    told = poolcal("check-entry", finished, file, "--crs", *(["EPSG:4979"] if ending == "gsf" else [UTM]))
    assert told.status in (0, 1, 2)
    if told.status == 2:
        assert (told.out, told.err.count("\n")) == ("", 1)
    else:
        assert told.out.startswith(("Entered rightly: within", "Cannot be told closely"))


def test_a_run_without_poses_is_refused(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    old = tmp_path / "old"
    shutil.copytree(undisturbed[0], old)
    shutil.rmtree(old / "ingest")
    told = poolcal("check-entry", old, tmp_path / "a.xyz")
    assert (told.status, told.out, told.err.count("\n")) == (2, "", 1)


def test_a_rejected_run_is_refused(done: Place, tmp_path: Path) -> None:
    path = done.run / "report" / "calibration.json"
    path.write_text(path.read_text(encoding="utf-8").replace('"verdict": "accepted"', '"verdict": "rejected"'), "utf-8")
    told = poolcal("check-entry", done.run, tmp_path / "a.xyz")
    assert told.status == 2
    assert "was rejected" in told.err
