"""An accepted result is replaced only when a copy of it is kept."""

import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest

from pipeline import atomic_files
from pipeline.errors import ArtefactError
from pipeline.run.verify import problems_of_run
from tests.support import toys
from tests.support.effort import often
from tests.support.toy_run import Pool


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
