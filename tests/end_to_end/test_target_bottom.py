"""poolcal target --bottom: pieces of the bottom beside a found target, what they give, and what is refused."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.atomic_files import read_json
from pipeline.maths.comparison import mount_error
from tests.support.docks import DOCK
from tests.support.places import Told, edit, poolcal, result_of, simulate

MOUNT = {"roll_deg": -1.8, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}
BLOCKS: dict[str, Any] = {
    "track": {"distances_m": [4.0, 4.0, 6.0, 6.0], "courses": ["along", "back"], "half_length_m": 4.0},
    "mbes": {"mount": MOUNT, "sector_deg": 140.0},
    "laser": {"field_deg": [-130.0, 130.0]},
}


@pytest.fixture(scope="module")
def dock(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Told]:
    """The session, a run on the walls that were found, and what it said."""
    folder = tmp_path_factory.mktemp("bottom")
    session = simulate(folder / "session", 3, **DOCK, **BLOCKS)
    config = folder / "found.yaml"
    config.write_text("target: {kind: found, depth_m: 4.0}\nverdict: {purpose: special_order}\n", "utf-8")
    told = poolcal("run", session, "--config", config, "--run", folder / "run", "--no-report", "--no-recordings")
    assert told.status in (0, 1), told.err
    return session, folder / "run", told


def errors_in_sigmas(run: Path, session: Path) -> np.ndarray:
    block, truth = result_of(run)["methods"]["adjustment"], read_json(Path(f"{session}.truth.json"))["mbes"]
    R_true, arm_true = np.array(truth["R_body_from_mbes"]), np.array(truth["lever_arm_m"])
    error = mount_error(R_true, arm_true, np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]))
    return np.abs(error) / np.sqrt(np.diag(block["covariance_total"]))


def test_the_bottom_makes_the_same_session_better(dock: tuple[Path, Path, Told], tmp_path: Path) -> None:
    session, run, _ = dock
    wall = tmp_path / "wall.yaml"
    told = poolcal("target", session, "--bottom", run, "--out", wall)
    assert told.status == 0, told.err
    assert " pieces of the bottom can serve." in told.out
    assert "Apart: by how much the means of passes differ, 60 mm at most." in told.out
    written = yaml.safe_load(wall.read_text("utf-8"))
    pieces = {name: face for name, face in written["target"]["faces"].items() if name.startswith("bottom-")}
    assert len(pieces) >= 4
    assert {face["seen"] for face in pieces.values()} == {"wet"}
    heights = np.array([corner[2] for face in pieces.values() for corner in face["corners"]])
    assert np.abs(heights + 4.3).max() < 0.06  # the floor lies 0.3 m below the wall's foot
    meant = {"purpose": "special_order", "depth_m": 20.0, "swath_deg": 60.0, "mount_share": 0.3}
    assert written["verdict"] == meant  # the rest of the run's config stays

    again = tmp_path / "run"
    told = poolcal("run", session, "--config", wall, "--run", again, "--no-report", "--no-recordings")
    assert told.status == 0, told.err
    before, after = (result_of(one)["methods"]["adjustment"]["sigma_mount"] for one in (run, again))
    assert after["roll_deg"] < 0.5 * before["roll_deg"]
    assert after["pitch_deg"] < before["pitch_deg"]
    assert errors_in_sigmas(again, session).max() < 4.5
    named = [part["part"] for part in result_of(again)["parts"]]
    assert [name for name in named if "bottom" in name] == ["without the soundings on bottom"]  # all pieces at once
    warned = " ".join(result_of(again)["warnings"])
    assert "no horizontal face is seen by both sensors" in warned  # a bottom ties no heights
    assert "bottom-" not in warned  # and was not found in laser points

    told = poolcal("target", session, "--bottom", again, "--out", wall)  # found anew, not added to the old ones
    renewed = yaml.safe_load(wall.read_text("utf-8"))["target"]["faces"]
    count = len([name for name in renewed if name.startswith("bottom-")])
    assert 0.8 * len(pieces) < count < 1.2 * len(pieces)  # one or another piece is refused with the new mount


def test_a_run_whose_mount_may_be_wrong_places_no_bottom(dock: tuple[Path, Path, Told], tmp_path: Path) -> None:
    session, run, _ = dock
    bad = tmp_path / "bad"
    shutil.copytree(run, bad)
    config = tmp_path / "found.yaml"
    config.write_text("target: {kind: found, depth_m: 4.0}\nsegment: {search_mount_deg: 0.1}\n", "utf-8")
    kept = (session / "session.yaml").read_bytes()
    edit(session / "session.yaml", "mbes", **{"mount": MOUNT | {"roll_deg": -1.0}})
    told = poolcal("run", session, "--config", config, "--run", bad, "--no-report", "--no-recordings")
    (session / "session.yaml").write_bytes(kept)
    assert "mount_beyond_search" in result_of(bad)["reason_codes"], told.out
    told = poolcal("target", session, "--bottom", bad)
    assert told.status == 2
    assert "was rejected for mount_beyond_search: its mount may be wrong" in told.err


def test_what_the_bottom_cannot_be_found_with(
    dock: tuple[Path, Path, Told], undisturbed: tuple[Path, Told], tmp_path: Path
) -> None:
    session, run, _ = dock
    other = tmp_path / "other"
    shutil.copytree(session, other)
    told = poolcal("target", other, "--bottom", run)
    assert told.status == 2
    assert f"is of the session {session}; name a run of {other}" in told.err
    letters = undisturbed[0]
    told = poolcal("target", letters.parent.parent, "--bottom", letters)
    assert told.status == 2
    for option, value in (("--depth", "3"), ("--html", str(tmp_path / "page.html"))):
        told = poolcal("target", session, "--bottom", run, option, value)
        assert told.status == 2
        assert f"{option} {value}" in told.err.replace("3.0", "3")
        assert "not with --bottom" in told.err
    told = poolcal("target", session, "--bottom", tmp_path / "none")
    assert told.status == 2
    assert "there is no such folder; name a run folder" in told.err
