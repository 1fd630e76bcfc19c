"""What a run may replace: never another session's run unasked."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import ArtefactError
from pipeline.run import runner
from pipeline.run.settings import load_settings
from tests.support.toy_run import Pool


# --- another session -------------------------------------------------------------------------------------------------
def other_session(pool: Pool) -> Path:
    """Copy the session to another folder, under the same name, with other files."""
    other = pool.session.with_name("other")
    shutil.copytree(pool.session, other)
    for path in other.rglob("*.bin"):
        np.random.default_rng(7).normal(size=4000 + len(path.parts[-2])).tofile(path)
    (other / "laser" / "1.bin").unlink()
    return other


def everything(place: Path) -> dict[str, bytes]:
    return {
        path.relative_to(place).as_posix(): path.read_bytes()
        for path in place.rglob("*")
        if path.is_file() and path.name not in (".lock", "digests.json")
    }


def test_another_session_is_refused_and_nothing_changed(judged: Pool) -> None:
    before, first = everything(judged.run_folder), judged.session
    judged.session = other_session(judged)
    with pytest.raises(ArtefactError) as told:
        judged.run()
    for word in (str(judged.run_folder), "'toy'", str(first), str(judged.session), "--overwrite"):
        assert word in str(told.value)
    settings = load_settings(judged.session, judged.config)
    with pytest.raises(ArtefactError, match="another session"):
        runner.run_stage(judged.stages, "take", judged.run_folder, settings=settings)
    assert everything(judged.run_folder) == before


def test_overwriting_is_asked_for_and_keeps_what_was_accepted(judged: Pool) -> None:
    accepted = (judged.run_folder / "tell" / "calibration.json").read_bytes()
    judged.session = other_session(judged)
    given = (judged.stages, judged.session, judged.config, judged.run_folder)
    assert runner.run(*given, overwrite=True) == ["take", "sift", "tell"]
    assert (judged.run_folder / "tell.1" / "calibration.json").read_bytes() == accepted
    assert judged.run() == []  # it is this session's now


def test_an_ins_log_in_common_does_not_make_it_the_same(judged: Pool) -> None:
    other = other_session(judged)
    shutil.copy(judged.session / "ins" / "0.bin", other / "ins" / "0.bin")
    judged.session = other
    with pytest.raises(ArtefactError, match="another session"):
        judged.run()


def test_where_the_laser_is_calibrated_its_own_files_tell(judged: Pool) -> None:
    run = judged.run_folder.with_name("laser")
    runner.run(judged.stages, judged.session, judged.config, run, calibrated="laser")
    other = other_session(judged)
    shutil.copy(judged.session / "mbes" / "0.bin", other / "mbes" / "0.bin")
    with pytest.raises(ArtefactError, match=r"no laser file of .* poolcal laser --overwrite"):
        runner.run(judged.stages, other, judged.config, run, calibrated="laser")
    shutil.copy(judged.session / "laser" / "1.bin", other / "laser" / "7.bin")
    assert runner.run(judged.stages, other, judged.config, run, calibrated="laser") == ["take", "sift", "tell"]


def test_empty_files_have_nothing_in_common(judged: Pool) -> None:
    """A logger that was switched on and off leaves one in each session."""
    (judged.session / "mbes" / "1.bin").write_bytes(b"")
    judged.run()
    judged.session = other_session(judged)
    (judged.session / "mbes" / "1.bin").write_bytes(b"")
    with pytest.raises(ArtefactError, match="another session"):
        judged.run()


def _moved(pool: Pool) -> None:
    pool.session = pool.session.rename(pool.session.with_name("elsewhere"))


def _renamed(pool: Pool) -> None:
    path = pool.session / "session.yaml"
    path.write_text(path.read_text().replace("name: toy", "name: harbour"))


def _moved_and_renamed(pool: Pool) -> None:
    _renamed(pool)
    _moved(pool)


def _one_more_file(pool: Pool) -> None:
    _moved_and_renamed(pool)
    np.ones(3).tofile(pool.session / "mbes" / "1.bin")


def _one_file_less(pool: Pool) -> None:
    np.ones(3).tofile(pool.session / "mbes" / "1.bin")
    pool.run()
    (pool.session / "mbes" / "0.bin").unlink()
    _moved_and_renamed(pool)


def _exported_again(pool: Pool) -> None:
    for number, path in enumerate(sorted(pool.session.rglob("*.bin"))):
        np.arange(100.0 + number).tofile(path)


def _corrected(pool: Pool) -> None:
    path = pool.session / "session.yaml"
    path.write_text(path.read_text().replace("mbes/*", "mbes/0.bin").replace("x_m: 0", "x_m: 0.5"))


def _settings_lost(pool: Pool) -> None:
    _moved_and_renamed(pool)
    (pool.run_folder / "run.yaml").write_text("damaged: [\n")


@pytest.mark.parametrize("change", [value for name, value in sorted(globals().items()) if name.startswith("_") and
                                    getattr(value, "__annotations__", {}).keys() == {"pool", "return"}])  # fmt: skip
def test_the_same_session_is_never_refused(judged: Pool, change: Any) -> None:
    change(judged)
    judged.run()
    assert json.loads((judged.run_folder / "tell" / "calibration.json").read_text())["verdict"] == "accepted"


def test_where_settings_and_manifests_are_lost_the_result_tells_the_session(judged: Pool) -> None:
    """A run folder with nothing but an accepted result in it is no empty one."""
    for path in judged.run_folder.glob("*/manifest.json"):
        path.unlink()
    (judged.run_folder / "run.yaml").write_text("damaged: [\n")
    (judged.run_folder / "report").mkdir()
    result = {"verdict": "accepted", "inputs": {"mbes/0.bin": "a" * 64}}
    (judged.run_folder / "report" / "calibration.json").write_text(json.dumps(result))
    with pytest.raises(ArtefactError, match=r"which its run\.yaml does not tell"):
        judged.run()


def test_a_folder_without_any_result_holds_nobodys_run(judged: Pool) -> None:
    for name in ("take", "sift", "tell"):
        shutil.rmtree(judged.run_folder / name)
    judged.session = other_session(judged)
    assert judged.run() == ["take", "sift", "tell"]
