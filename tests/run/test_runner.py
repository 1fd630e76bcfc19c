"""What is run again, and why; and that the result is the same however it is worked out."""

import json
import multiprocessing
import os
import shutil
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import ArtefactError, RawDataError
from pipeline.run import provenance, runner
from pipeline.run.workers import Workers, workers
from tests.support import toys
from tests.support.toy_run import Pool

Contents = Callable[[Path], dict[str, bytes]]


def test_first_run_runs_everything_and_the_second_nothing(pool: Pool) -> None:
    assert pool.run() == ["take", "sift", "tell"]
    assert pool.run() == []
    assert pool.said == ["take: up to date", "sift: up to date", "tell: up to date"]


def test_nothing_to_do_leaves_make_nothing_to_do(pool: Pool) -> None:
    pool.run()
    for stage in ("take", "sift", "tell"):
        os.utime(pool.run_folder / stage / "manifest.json", (0, 0))
    pool.run()
    times = [(pool.run_folder / stage / "manifest.json").stat().st_mtime_ns for stage in ("take", "sift", "tell")]
    assert times == sorted(times)
    assert times[0] > 0


def test_a_changed_threshold_reruns_from_its_stage_on_and_says_so(pool: Pool) -> None:
    pool.run()
    pool.margin(0.5)
    assert pool.run() == ["sift", "tell"]
    assert "sift: segment.margin_m 0.05 -> 0.5" in pool.said
    assert "tell: its input sift/means was changed" in pool.said


def test_an_identical_result_stops_the_rerun_there(pool: Pool) -> None:
    pool.run()
    pool.margin(0.05 + 1e-12)
    assert pool.run() == ["sift"]


def test_a_result_that_comes_back_makes_no_work_later(pool: Pool) -> None:
    pool.run()
    pool.margin(0.5)
    pool.run()
    pool.margin(0.05)
    assert pool.run() == ["sift", "tell"]


def test_touching_or_moving_changes_nothing(pool: Pool) -> None:
    pool.run()
    for path in pool.session.rglob("*.bin"):
        os.utime(path)
    pool.session = pool.session.rename(pool.session.with_name("elsewhere"))
    pool.config = pool.config.rename(pool.config.with_name("other.yaml"))
    pool.run_folder = pool.run_folder.rename(pool.run_folder.with_name("b"))
    assert pool.run() == []


def test_raw_files_changed_new_and_gone_are_named(pool: Pool) -> None:
    pool.run()
    np.ones(10).tofile(pool.session / "laser" / "0.bin")
    np.ones(11).tofile(pool.session / "laser" / "2.bin")
    assert pool.run() == ["take", "sift", "tell"]
    assert "take: laser/0.bin changed" in pool.said
    assert "take: laser/2.bin is new" in pool.said
    (pool.session / "laser" / "2.bin").unlink()
    pool.run()
    assert "take: laser/2.bin is gone" in pool.said


def test_an_edited_file_of_the_same_size_and_time_is_seen(pool: Pool) -> None:
    pool.run()
    path = pool.run_folder / "sift" / "near" / "part-00001-000.parquet"
    status, content = path.stat(), bytearray(path.read_bytes())
    content[100] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert pool.run() == ["sift"]
    assert "sift: its result near/part-00001-000.parquet was edited" in pool.said


def test_a_deleted_result_is_made_again(pool: Pool) -> None:
    pool.run()
    (pool.run_folder / "take" / "counts.parquet").unlink()
    shutil.rmtree(pool.run_folder / "tell")
    assert pool.run() == ["take", "tell"]
    assert "take: its result counts.parquet is gone" in pool.said
    assert "tell: has no result yet" in pool.said


def test_other_libraries_or_source_rerun_everything(pool: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    pool.run()
    versions, source_of = provenance.library_versions(), provenance.source_digests
    monkeypatch.setattr(provenance, "library_versions", lambda: {**versions, "numpy": "0.1"})
    assert pool.run() == ["take", "sift", "tell"]
    assert f"sift: numpy {versions['numpy']} -> 0.1" in pool.said
    monkeypatch.setattr(provenance, "source_digests", lambda stage: {**source_of(stage), "stages/sift.py": "0"})
    assert pool.run() == ["take", "sift", "tell"]
    assert "sift: poolcal changed (stages/sift.py)" in pool.said


@pytest.mark.parametrize("content", ["", "{}", "[]", "null", '{"schema": 1}', '{"schema": 99}', "\0", "[" * 9999])
def test_a_damaged_manifest_only_costs_a_rerun(pool: Pool, content: str) -> None:
    pool.run()
    (pool.run_folder / "sift" / "manifest.json").write_text(content, encoding="utf-8")
    assert pool.run() == ["sift"]


def test_one_job_or_two_give_the_same_bytes(pool: Pool, contents: Contents) -> None:
    pool.run()
    one, pool.run_folder = contents(pool.run_folder), pool.run_folder.with_name("b")
    with workers(2) as two:
        pool.run(two)
    assert contents(pool.run_folder) == one
    assert len(one) == 2 + 1 + 2 + 1 + 1


def test_workers_that_share_no_memory_give_the_same_bytes(pool: Pool, contents: Contents) -> None:
    """As on a cluster: what is sent out is pickled, what comes back are files under the same paths."""
    pool.run()
    one, pool.run_folder = contents(pool.run_folder), pool.run_folder.with_name("b")
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        pool.run(Workers(2, executor, local=False))
        pool.margin(0.5)
        pool.stages[1].run_batch = toys.refuse
        with pytest.raises(RawDataError, match=r"cannot be used"):
            pool.run(Workers(2, executor, local=False))
    assert contents(pool.run_folder) == one


def test_the_size_of_batches_does_not_show_in_the_bytes(
    pool: Pool, contents: Contents, monkeypatch: pytest.MonkeyPatch
) -> None:
    pool.run()
    by_thousand, pool.run_folder = contents(pool.run_folder / "take"), pool.run_folder.with_name("b")
    parts = "pipeline.readers.dispatch.raw_parts"
    monkeypatch.setattr(parts, lambda sensor, settings, folder: _parts(settings, folder, 77))
    pool.run()
    assert {n: b for n, b in contents(pool.run_folder / "take").items() if n.startswith("points")} == {
        n: b for n, b in by_thousand.items() if n.startswith("points")
    }


def _parts(settings: object, folder: Path, step: int) -> tuple[object, ...]:
    return tuple(toys.RawPart(path, step) for path in toys.raw_files(settings, folder))


def test_a_failed_rerun_keeps_the_complete_result(pool: Pool, contents: Contents) -> None:
    pool.run()
    before = contents(pool.run_folder)

    good = pool.stages[1].run_batch
    pool.stages[1].run_batch = toys.refuse
    pool.margin(0.5)
    with workers(2) as two, pytest.raises(RawDataError):
        pool.run(two)
    assert contents(pool.run_folder) == before
    assert sorted(p.name for p in pool.run_folder.iterdir()) == [
        ".lock", "digests.json", "run.yaml", "sift", "take", "tell",
    ]  # fmt: skip
    pool.stages[1].run_batch = good
    pool.margin(0.05)
    assert pool.run() == []


def test_raw_files_that_change_while_they_are_read_are_refused(pool: Pool) -> None:
    good = pool.stages[0].combine

    def late(prepared: object, partials: object, config: object) -> object:
        np.ones(1).tofile(pool.session / "laser" / "0.bin")
        return good(prepared, partials, config)

    pool.stages[0].combine = late
    with pytest.raises(RawDataError, match="changed while they were read"):
        pool.run()
    assert not (pool.run_folder / "take").exists()


def test_a_file_name_that_is_no_text_is_refused(pool: Pool) -> None:
    with open(bytes(pool.session / "laser") + b"/\xff.bin", "wb"):
        pass
    with pytest.raises(RawDataError, match="not UTF-8; rename it"):
        pool.run()


def test_the_manifest_tells_what_was_done(pool: Pool) -> None:
    pool.run()
    told = json.loads((pool.run_folder / "take" / "manifest.json").read_text())
    assert told["rows"] == {"counts": 1, "points": 10000}
    assert told["counts"] == [{"source": "laser", "reason": "used", "count": 10000}]
    assert told["key"]["config"]["ingest"]["max_gap_s"] == 5.0
    assert set(told["key"]["raw"]) == {"laser/0.bin", "laser/1.bin"}
    assert told["outputs"]["counts.parquet"]["bytes"] == (pool.run_folder / "take" / "counts.parquet").stat().st_size
    assert told["wall_s"] >= 0


# --- one stage -------------------------------------------------------------------------------------------------------
def test_one_stage_needs_those_before_it(pool: Pool) -> None:
    pool.run()
    shutil.rmtree(pool.run_folder / "take")
    with pytest.raises(ArtefactError, match="take: has no result yet; run stage take first"):
        runner.run_stage(pool.stages, "sift", pool.run_folder)
    assert runner.run_stage(pool.stages, "take", pool.run_folder)
    assert not runner.run_stage(pool.stages, "sift", pool.run_folder)


def test_one_stage_of_no_run_folder(pool: Pool) -> None:
    with pytest.raises(ArtefactError, match=r"holds no run\.yaml"):
        runner.run_stage(pool.stages, "sift", pool.run_folder)
    assert not pool.run_folder.exists()


def test_run_yaml_is_what_the_stages_are_run_with(pool: Pool) -> None:
    pool.run()
    pool.config.unlink()
    (pool.session / "session.yaml").unlink()
    assert not runner.run_stage(pool.stages, "sift", pool.run_folder)


@pytest.mark.parametrize("local", [True, False])
def test_a_stage_that_wants_one_column_of_its_files_reads_that_alone(pool: Pool, local: bool) -> None:
    read = []

    def prepare(inputs: toys.SiftInputs, config: toys.SiftConfig) -> float:
        read.extend(sorted(batch) for batch in inputs.points.only(["x_m"]).batches())
        return 1.0

    pool.stages[1].prepare = prepare
    pool.run(Workers(1, local=local))
    assert read == [["x_m"], ["x_m"]]
