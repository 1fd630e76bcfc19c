"""A run folder from somebody else: what lies in it is neither followed out of it, nor waited for, nor a bug."""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.atomic_files import remove
from pipeline.errors import ArtefactError
from pipeline.run import manifest
from pipeline.run.results import calibration
from pipeline.run.verify import problems_of_run
from tests.support.limits import limited
from tests.support.toy_run import Pool


@pytest.fixture(autouse=True)
def limits() -> Iterator[None]:
    with limited():
        yield


def test_a_lock_that_is_a_link_is_not_followed(pool: Pool, tmp_path: Path) -> None:
    pool.run()
    mine = tmp_path / "thesis.tex"
    mine.write_text("two years of work")
    lock = pool.run_folder / ".lock"
    lock.unlink()
    lock.symlink_to(mine)
    with pytest.raises(ArtefactError, match=r"\.lock: cannot be written .*remove the symbolic link"):
        pool.run()
    assert mine.read_text() == "two years of work"
    assert problems_of_run(pool.stages, pool.run_folder) == []  # which only reads
    lock.unlink()
    lock.symlink_to(tmp_path / "new")
    with pytest.raises(ArtefactError, match=r"\.lock: cannot be written"):
        pool.run()
    assert not (tmp_path / "new").exists()


def test_fifos_are_not_waited_for(pool: Pool) -> None:
    pool.run()
    (pool.run_folder / ".lock").unlink()
    os.mkfifo(pool.run_folder / ".lock")
    assert problems_of_run(pool.stages, pool.run_folder) == []
    with pytest.raises(ArtefactError, match=r"\.lock: cannot be written .*move what is in the way"):
        pool.run()
    (pool.run_folder / ".lock").unlink()
    for name in ("digests.json", "take/manifest.json"):
        (pool.run_folder / name).unlink()
        os.mkfifo(pool.run_folder / name)
    assert pool.run() == ["take"]
    (pool.run_folder / "run.yaml").unlink()
    os.mkfifo(pool.run_folder / "run.yaml")
    with pytest.raises(ArtefactError, match="so it is no run folder"):
        problems_of_run(pool.stages, pool.run_folder)


@pytest.mark.parametrize("content", ["[" * 100_000, "{" * 100_000, "\0", '"' + "a" * 100, "1e999", "[]"])
def test_json_that_nobody_wrote(pool: Pool, content: str) -> None:
    pool.run()
    (pool.run_folder / "digests.json").write_text(content)
    (pool.run_folder / "take" / "manifest.json").write_text(content)
    assert pool.run() == ["take"]
    (pool.run_folder / "report").mkdir()
    (pool.run_folder / "report" / "calibration.json").write_text(content)
    with pytest.raises(ArtefactError, match=r"cannot be read|holds no verdict"):
        calibration(pool.run_folder)


@pytest.mark.parametrize(
    "change",
    [
        {"rows": {"points": "many"}}, {"rows": {"points": None}}, {"rows": []}, {"counts": [{}]}, {"counts": 3},
        {"counts": [{"source": "laser", "reason": "used"}]}, {"counts": [{"source": 1, "reason": "", "count": 1}]},
        {"counts": [3]},
    ],
    ids=str,
)  # fmt: skip
def test_a_manifest_with_other_types_in_it_only_costs_a_rerun(pool: Pool, change: dict[str, object]) -> None:
    pool.run()
    path = pool.run_folder / "take" / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    assert manifest.read_manifest(path.parent) is None
    assert pool.run() == ["take"]


def test_what_cannot_be_removed_is_told_with_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "run" / "adjust.old"
    place.mkdir(parents=True)
    (place / "surfaces.parquet").write_bytes(b"")

    def refuse(name: str, **_: object) -> None:
        raise PermissionError(13, "Permission denied", name)

    monkeypatch.setattr(os, "unlink", refuse)
    with pytest.raises(ArtefactError) as told:
        remove(place)
    assert str(told.value).startswith(f"{place} (its surfaces.parquet): cannot be written (Permission denied); ")
