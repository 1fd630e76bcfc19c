"""A run folder after crashes, in use by another process, on a disk that refuses, or where it must not be."""

import errno
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from pipeline.artefacts import parquet
from pipeline.errors import ArtefactError, ConfigError
from pipeline.run.verify import problems_of_run
from pipeline.run.workers import workers
from tests.support.toy_run import Pool

Contents = Callable[[Path], dict[str, bytes]]


def _half(folder: Path) -> None:
    """Like a stage killed at work: some files, no manifest."""
    folder.mkdir()
    (folder / "means.parquet").write_bytes(b"PAR1")


def _killed_before_the_swap(stage: Path) -> None:
    _half(stage.with_name("sift.partial"))


def _killed_between_the_renames(stage: Path) -> None:
    shutil.copytree(stage, stage.with_name("sift.partial"))
    stage.rename(stage.with_name("sift.old"))


def _killed_between_them_and_the_new_one_lost(stage: Path) -> None:
    stage.rename(stage.with_name("sift.old"))


def _killed_before_the_old_one_was_removed(stage: Path) -> None:
    shutil.copytree(stage, stage.with_name("sift.old"))


def _killed_while_the_old_one_was_removed(stage: Path) -> None:
    _half(stage.with_name("sift.old"))


def _killed_before_the_first_rename(stage: Path) -> None:
    shutil.copytree(stage, stage.with_name("sift.partial"))


def _killed_after_a_half_result_and_the_first_rename(stage: Path) -> None:
    stage.rename(stage.with_name("sift.old"))
    _half(stage.with_name("sift.partial"))


@pytest.mark.parametrize("crash", [value for name, value in sorted(globals().items()) if name.startswith("_killed")])
def test_a_complete_result_survives_every_crash(pool: Pool, contents: Contents, crash: Callable[[Path], None]) -> None:
    pool.run()
    before = contents(pool.run_folder)
    crash(pool.run_folder / "sift")
    assert pool.run() == []
    assert contents(pool.run_folder) == before
    assert not list(pool.run_folder.glob("*.old")) + list(pool.run_folder.glob("*.partial"))


def test_the_newest_complete_result_stands(pool: Pool) -> None:
    pool.run()
    shutil.copytree(pool.run_folder / "sift", pool.run_folder / "kept")
    pool.margin(0.5)
    pool.run()
    (pool.run_folder / "kept").rename(pool.run_folder / "sift.old")
    (pool.run_folder / "sift").rename(pool.run_folder / "sift.partial")
    assert pool.run() == []


# --- the lock --------------------------------------------------------------------------------------------------------
@pytest.fixture
def holder(pool: Pool) -> Iterator[subprocess.Popen[bytes]]:
    """Another process that holds the run folder."""
    pool.run_folder.mkdir(parents=True)
    code = (
        "import fcntl, os, sys, time\n"
        "f = open(sys.argv[1], 'a'); fcntl.flock(f, fcntl.LOCK_EX)\n"
        "f.write(f'{os.getpid()}\\n'); f.flush(); print('held', flush=True); time.sleep(60)"
    )
    command = [sys.executable, "-c", code, str(pool.run_folder / ".lock")]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process
        process.kill()


def test_a_folder_in_use_is_refused_and_free_after_a_kill(pool: Pool, holder: subprocess.Popen[bytes]) -> None:
    with pytest.raises(ArtefactError, match=f"in use by process {holder.pid}"):
        pool.run()
    holder.kill()
    holder.wait()
    assert pool.run() == ["take", "sift", "tell"]


# --- a disk that refuses ---------------------------------------------------------------------------------------------
@pytest.fixture
def small_disk() -> Iterator[None]:
    """No file may grow beyond 20 kB: a refusal from the system itself, through pyarrow."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("jobs", [1, 2])
def test_the_system_refuses_to_write(pool: Pool, small_disk: None, jobs: int) -> None:
    refused = r"part-0000\d-000.parquet: cannot be written \(File too large"
    with workers(jobs) as some, pytest.raises(ArtefactError, match=refused):
        pool.run(some)
    assert not list(pool.run_folder.glob("take*"))


def test_a_full_disk_is_one_line_and_keeps_what_was_complete(
    pool: Pool, contents: Contents, monkeypatch: pytest.MonkeyPatch
) -> None:
    pool.run()
    before = contents(pool.run_folder)
    pool.margin(0.5)

    class Full(parquet.pq.ParquetWriter):
        def write_table(self, *arguments: object, **options: object) -> None:
            raise OSError("Error writing bytes to file. Detail: [errno 28] No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(parquet.pq, "ParquetWriter", Full)
        with pytest.raises(ArtefactError, match=r"written \(No space left on device\); make room and run again"):
            pool.run()
    assert contents(pool.run_folder) == before
    assert pool.run() == ["sift", "tell"]


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES, errno.EDQUOT])
def test_a_refused_swap_keeps_what_was_complete(
    pool: Pool, contents: Contents, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    pool.run()
    before = contents(pool.run_folder)
    pool.margin(0.5)

    def refuse(self: Path, target: Path) -> Path:
        raise OSError(number, "refused", str(self))

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(ArtefactError, match="cannot be written"):
        pool.run()
    assert contents(pool.run_folder) == before


def test_a_file_in_the_way(pool: Pool) -> None:
    pool.run_folder.parent.write_text("")
    with pytest.raises(ArtefactError, match="in the way"):
        pool.run()
    pool.run_folder.parent.unlink()
    pool.run_folder.parent.mkdir()
    pool.run_folder.write_text("")
    with pytest.raises(ArtefactError, match="in the way"):
        pool.run()


def test_a_damaged_table_is_made_again_not_trusted(pool: Pool) -> None:
    pool.run()
    path = pool.run_folder / "sift" / "means.parquet"
    path.write_bytes(path.read_bytes()[:-3])
    assert pool.run() == ["sift"]


# --- where a run folder must not be ----------------------------------------------------------------------------------
@pytest.mark.parametrize("where", ["", "run", "laser", ".."])
def test_results_stay_out_of_the_raw_data(pool: Pool, where: str) -> None:
    pool.run_folder = pool.session / where
    before = sorted(pool.session.rglob("*"))
    with pytest.raises(ConfigError, match="session folder"):
        pool.run()
    assert sorted(pool.session.rglob("*")) == before


def test_a_link_into_the_session_is_seen_through(pool: Pool) -> None:
    pool.run_folder.parent.symlink_to(pool.session)
    with pytest.raises(ConfigError, match="session folder"):
        pool.run()


def test_a_folder_with_other_things_is_left_alone(pool: Pool) -> None:
    (pool.run_folder / "take").mkdir(parents=True)
    (pool.run_folder / "take" / "thesis.tex").write_text("two years of work")
    with pytest.raises(ArtefactError, match=r"holds take but no run\.yaml"):
        pool.run()
    assert (pool.run_folder / "take" / "thesis.tex").read_text() == "two years of work"


# --- verify ----------------------------------------------------------------------------------------------------------
def test_verify_finds_nothing_in_a_whole_run(pool: Pool) -> None:
    pool.run()
    assert problems_of_run(pool.stages, pool.run_folder) == []


def test_verify_reads_everything_again(pool: Pool) -> None:
    pool.run()
    np.ones(5000).tofile(pool.session / "laser" / "0.bin")
    (pool.run_folder / "sift" / "means.parquet").write_bytes(b"")
    (pool.run_folder / "tell" / "manifest.json").unlink()
    found = problems_of_run(pool.stages, pool.run_folder)
    assert found == [
        "take: laser/0.bin changed", "sift: its result means.parquet was edited", "tell: has no complete result",
    ]  # fmt: skip


def test_verify_notices_a_part_slipped_in_and_settings_rewritten(pool: Pool) -> None:
    pool.run()
    near = pool.run_folder / "sift" / "near"
    shutil.copy(near / "part-00000-000.parquet", near / "part-00009-000.parquet")
    text = (pool.run_folder / "run.yaml").read_text()
    (pool.run_folder / "run.yaml").write_text(text.replace("margin_m: 0.05", "margin_m: 0.06"))
    found = problems_of_run(pool.stages, pool.run_folder)
    assert found == [
        "sift: near/part-00009-000.parquet is not its own", "sift: segment is not as in run.yaml",
    ]  # fmt: skip


def test_verify_of_missing_raw_files(pool: Pool) -> None:
    pool.run()
    shutil.rmtree(pool.session)
    assert "take: laser/0.bin is gone" in problems_of_run(pool.stages, pool.run_folder)


def test_two_runs_at_once_end_as_one_error_and_one_result(pool: Pool) -> None:
    """The lock is kept until the end of the run, not only at its start."""
    seen: list[str] = []
    good = pool.stages[0].combine

    def meanwhile(*arguments: object) -> object:
        try:
            Pool(pool.session, pool.config, pool.run_folder).run()
        except ArtefactError as error:
            seen.append(str(error))
        return good(*arguments)

    pool.stages[0].combine = meanwhile
    start = time.monotonic()
    assert pool.run() == ["take", "sift", "tell"]
    assert "in use by process" in seen[0]
    assert time.monotonic() - start < 20
