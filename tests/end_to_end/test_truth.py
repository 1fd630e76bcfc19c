"""The truth of a simulated session is known to the simulator and to the demo's comparison, and to nobody else."""

import shutil
from pathlib import Path

import pytest

from tests.support.places import Place, digests, poolcal_process
from tests.support.roots import ROOT


@pytest.mark.thorough
def test_without_the_truth_the_result_is_the_same(small: Path, tmp_path: Path, right: dict[str, str]) -> None:
    """The session alone, copied to where no truth is beside it, calibrated by a process of its own."""
    place = Place(small, tmp_path)
    place.mend()
    assert not list(tmp_path.rglob("*truth*"))
    assert poolcal_process(*place.words()).status == 0
    assert digests(place.run) == right


def test_a_false_truth_beside_the_session_changes_nothing(place: Place, right: dict[str, str]) -> None:
    place.session.with_name("session.truth.json").write_text("{}", encoding="utf-8")
    shutil.copy(place.session.with_name("session.truth.json"), place.session / "session.truth.json")
    assert place.calibrate().status == 0
    assert digests(place.run) == right


def test_no_other_module_names_the_truth() -> None:
    for path in [*(ROOT / "pipeline").rglob("*.py"), *(ROOT / "stages").rglob("*.py")]:
        name = path.relative_to(ROOT).as_posix()
        text = path.read_text(encoding="utf-8")
        if name.startswith("pipeline/simulation/") or name == "stages/commands/compare.py":
            continue
        if name.startswith("stages/cli/"):  # the help names the file; stages.commands.compare alone gets the path
            assert text.count("read_truth") == 0
            continue
        assert "truth.json" not in text, name
        assert "truth_path" not in text, name
