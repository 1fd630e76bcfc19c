"""What a run may replace: never another session's run unasked, and an accepted result only when a copy is kept."""

import errno
import json
import os
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from pipeline import atomic_files
from pipeline.errors import ArtefactError
from pipeline.run import runner
from pipeline.run.settings import load_settings
from pipeline.run.verify import problems_of_run
from tests.support import toys
from tests.support.effort import often
from tests.support.toy_run import Pool


def _verdict(inputs: Any, config: Any) -> toys.TellOutputs:
    """Accepted up to a sigma of 1 m; the mean makes one result differ from another."""
    verdict = "accepted" if config.verdict.max_sigma_m <= 1 else "rejected"
    found = {"verdict": verdict, "mean": float(inputs.means["mean_m"][0]), "limit": config.verdict.max_sigma_m}
    return toys.TellOutputs(json.dumps(found))


@pytest.fixture
def stages() -> tuple[ModuleType, ...]:
    made = toys.stages()
    made[2].run = _verdict
    return made


@pytest.fixture
def judged(pool: Pool, stages: tuple[ModuleType, ...]) -> Pool:
    """Accepted, with a page."""
    pool.stages = stages
    pool.run()
    (pool.run_folder / "tell" / "report.html").write_text("<p>first</p>")
    (pool.run_folder / "tell" / "calibration.yaml").write_text("first: 1\n")
    return pool


def limit(pool: Pool, max_sigma_m: float) -> None:
    pool.margin(0.05)
    pool.config.write_text(pool.config.read_text() + f"verdict: {{max_sigma_m: {max_sigma_m}}}\n")


def contents(place: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in place.iterdir()}


# --- an accepted result ----------------------------------------------------------------------------------------------
def test_what_was_accepted_is_kept_whatever_replaces_it(judged: Pool) -> None:
    accepted = {name: text for name, text in contents(judged.run_folder / "tell").items() if name != "manifest.json"}
    assert set(accepted) == {"calibration.json", "calibration.yaml", "report.html"}
    limit(judged, 2.0)
    judged.run()
    assert contents(judged.run_folder / "tell.1") == accepted
    assert f"tell: the accepted result that was there is kept in {judged.run_folder / 'tell.1'}" in judged.said
    limit(judged, 0.5)  # what is replaced now was rejected
    judged.run()
    assert not (judged.run_folder / "tell.2").exists()
    limit(judged, 0.6)
    judged.run()
    assert json.loads((judged.run_folder / "tell.2" / "calibration.json").read_text())["limit"] == 0.5
    assert sorted(path.name for path in judged.run_folder.glob("tell*")) == ["tell", "tell.1", "tell.2"]


def test_the_same_result_is_kept_once(judged: Pool) -> None:
    """Back and forth between two settings; a result made anew with nothing changed is none that is replaced."""
    for max_sigma_m in (0.5, 0.6, 0.5, 0.6, 0.5):
        limit(judged, max_sigma_m)
        judged.run()
    assert [path.name for path in sorted(judged.run_folder.glob("tell.*"))] == ["tell.1", "tell.2", "tell.3"]
    (judged.run_folder / "tell" / "manifest.json").unlink()
    assert judged.run() == ["tell"]
    assert len(list(judged.run_folder.glob("tell.*"))) == 3


def test_a_page_that_was_drawn_later_joins_what_is_kept(judged: Pool) -> None:
    for max_sigma_m in (0.5, 0.6, 0.5):
        limit(judged, max_sigma_m)
        judged.run()
    assert not (judged.run_folder / "tell.2" / "report.html").exists()
    (judged.run_folder / "tell" / "report.html").write_text("<p>0.5</p>")
    limit(judged, 0.6)
    judged.run()
    assert (judged.run_folder / "tell.2" / "report.html").read_text() == "<p>0.5</p>"


def test_a_full_disk_while_it_is_kept_loses_nothing(judged: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    before = contents(judged.run_folder / "tell")
    limit(judged, 2.0)

    def full(path: Path, content: bytes) -> None:
        if path.name == "report.html":
            path.write_bytes(content[:3])
            with atomic_files.writing(path):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        path.write_bytes(content)

    with monkeypatch.context() as patch:
        patch.setattr("pipeline.run.kept_results.write_bytes", full)
        with pytest.raises(ArtefactError, match="No space left on device"):
            judged.run()
    assert contents(judged.run_folder / "tell") == before
    assert not (judged.run_folder / "tell.1").exists()
    judged.run()
    assert (judged.run_folder / "tell.1" / "report.html").read_text() == "<p>first</p>"
    assert not (judged.run_folder / "tell.keeping").exists()


@pytest.mark.parametrize("steps", often((2, 5, 7, 8, 9, 11), range(12)))
def test_killed_at_any_step_the_accepted_result_is_there(
    judged: Pool, monkeypatch: pytest.MonkeyPatch, steps: int
) -> None:
    """Every rename and every new folder is a step; the folder after the first n steps is what a kill leaves."""
    before = (judged.run_folder / "tell" / "calibration.json").read_bytes()
    limit(judged, 2.0)
    left = [steps]

    def counted(name: str) -> None:
        real = getattr(Path, name)

        def step(self: Path, *arguments: Any, **options: Any) -> Any:
            if "tell" in str(self):
                if not left[0]:
                    raise KeyboardInterrupt
                left[0] -= 1
            return real(self, *arguments, **options)

        monkeypatch.setattr(Path, name, step)

    with monkeypatch.context():
        for name in ("rename", "replace", "mkdir"):
            counted(name)
        monkeypatch.setattr("pipeline.run.execute._remove_quietly", lambda _: None)
        done = True
        try:
            judged.run()
        except KeyboardInterrupt:
            done = False
    monkeypatch.undo()
    monkeypatch.setattr("pipeline.readers.dispatch.raw_files", toys.raw_files)
    monkeypatch.setattr("pipeline.readers.dispatch.raw_parts", toys.raw_parts)
    found = [path.read_bytes() for path in judged.run_folder.glob("tell*/calibration.json")]
    assert before in found
    assert done or steps < 11
    judged.run()
    assert (judged.run_folder / "tell.1" / "calibration.json").read_bytes() == before
    assert sorted(path.name for path in judged.run_folder.glob("tell*")) == ["tell", "tell.1"]


def test_verify_looks_past_what_is_kept(judged: Pool) -> None:
    limit(judged, 2.0)
    judged.run()
    assert problems_of_run(judged.stages, judged.run_folder) == []
    assert judged.run() == []


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


# --- what the disk holds before a rename says that it is complete ----------------------------------------------------
def test_every_file_is_on_the_disk_before_the_folder_takes_its_place(
    pool: Pool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A power cut after the rename must not leave a manifest beside empty tables."""
    done: list[str] = []
    sync, rename = os.fsync, Path.rename

    def synced(handle: int) -> None:
        done.append(os.readlink(f"/proc/self/fd/{handle}"))
        sync(handle)

    def renamed(self: Path, target: Path) -> Path:
        if self.suffix == ".partial":
            inside = {str(path) for path in (self, *self.rglob("*"))}
            assert len(inside) >= 3
            assert inside <= set(done)
            done.append(f"{self} renamed")
        return rename(self, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "rename", renamed)
    pool.run()
    for stage in ("take", "sift", "tell"):
        assert str(pool.run_folder) in done[done.index(f"{pool.run_folder / stage}.partial renamed") :]
