"""A stage called without files, and what a stage must not do."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import pytest

from pipeline.artefacts.parquet import read_table
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import EMPTY_STREAM, BatchResult, Chunk, MemoryPart, Stream
from pipeline.config.pool import Segment
from pipeline.run.manifest import read_manifest
from pipeline.run.stage_protocol import declared, inputs_in, run_in_memory
from pipeline.run.verify import problems_of_run
from tests.support import toys
from tests.support.toy_run import Pool

SETTINGS = toys.SiftConfig(Segment())


def _points(*sizes: int) -> Stream:
    rng = np.random.default_rng(3)
    return Stream(tuple(MemoryPart(str(n), {"t_ns": np.arange(n), "x_m": rng.normal(size=n)}) for n in sizes))


def test_memory_gives_what_files_give(pool: Pool) -> None:
    pool.run()
    parts = tuple(
        MemoryPart(path.name, {"t_ns": np.arange(5000), "x_m": np.fromfile(path)})
        for path in sorted((pool.session / "laser").iterdir())
    )
    outputs = run_in_memory(pool.stages[1], toys.SiftInputs(Stream(parts)), SETTINGS)
    pd.testing.assert_frame_equal(outputs.means, read_table(pool.run_folder / "sift" / "means.parquet", toys.MEANS))
    assert outputs.means["face"].dtype == np.int16
    (batch, _) = outputs.near.batches()
    assert batch["face"].dtype == np.int16


def test_a_part_without_rows_is_left_out() -> None:
    outputs = run_in_memory(toys.stages()[1], toys.SiftInputs(_points(10, 0, 10)), SETTINGS)
    assert [part.name for part in outputs.near.parts] == ["part-00000-000", "part-00002-000"]


def test_a_stream_without_any_row(pool: Pool) -> None:
    pool.margin(1e6)
    pool.run()
    assert [p.name for p in (pool.run_folder / "sift" / "near").iterdir()] == ["part-00000-000.parquet"]
    assert run_in_memory(toys.stages()[1], toys.SiftInputs(_points(0)), SETTINGS).near.parts == ()


def test_only_named_sources_are_mapped() -> None:
    stage = toys.stages()[1]
    stage.SOURCES = ()  # type: ignore[attr-defined]
    stage.combine = lambda prepared, partials, config: toys.SiftOutputs(  # type: ignore[attr-defined]
        pd.DataFrame({"face": [0], "mean_m": [float(len(partials))]})
    )
    assert run_in_memory(stage, toys.SiftInputs(_points(10)), SETTINGS).means["mean_m"][0] == 0.0


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("run_batch", lambda source, chunk, prepared, config: BatchResult({"far": chunk.columns}, 0), "far"),
        (
            "run_batch",
            lambda source, chunk, prepared, config: BatchResult({"near": chunk.columns}, 0),
            "missing columns",
        ),
        ("combine", lambda prepared, partials, config: None, "must return its Outputs"),
        ("combine", lambda prepared, partials, config: toys.SiftOutputs(pd.DataFrame({"a": [1]})), "missing columns"),
        (
            "combine",
            lambda prepared, partials, config: toys.SiftOutputs(pd.DataFrame(), _points(1)),
            "leave it EMPTY_STREAM",
        ),
    ],
)
def test_a_stage_that_breaks_the_protocol_is_a_bug(name: str, value: object, message: str) -> None:
    stage = toys.stages()[1]
    setattr(stage, name, value)
    with pytest.raises((TypeError, KeyError), match=message):
        run_in_memory(stage, toys.SiftInputs(_points(10)), SETTINGS)


def test_every_field_names_its_artefact() -> None:
    assert declared(toys.SiftOutputs) == {"means": toys.MEANS, "near": toys.NEAR}

    class Outputs:
        means: pd.DataFrame

    with pytest.raises(TypeError, match="means must be annotated"):
        declared(Outputs)


@dataclass(frozen=True)
class OptionalInputs:
    near: Annotated[Stream, toys.NEAR]
    means: Annotated[pd.DataFrame | None, toys.MEANS] = None
    points: Annotated[Stream, toys.POINTS] = EMPTY_STREAM


@dataclass(frozen=True)
class OptionalOutputs:
    calibration_json: Annotated[str, toys.TEXT_OUT]
    counts: Annotated[pd.DataFrame | None, toys.TAKE_COUNTS] = None


def _stage_of_options(pool: Pool) -> None:
    """Let the last stage take the means only if there are any, and write counts only then."""

    def tell(inputs: OptionalInputs, config: toys.TellConfig) -> OptionalOutputs:
        counts = None if inputs.means is None else pd.DataFrame({"source": ["a"], "reason": ["b"], "count": [1]})
        return OptionalOutputs(f"{inputs.means is not None}\n", counts)

    last = pool.stages[2]
    last.Inputs, last.Outputs, last.run = OptionalInputs, OptionalOutputs, tell  # type: ignore[attr-defined]


def test_an_optional_table_is_left_out_where_no_stage_makes_it(pool: Pool) -> None:
    _stage_of_options(pool)
    stage = pool.stages[2]
    assert list(inputs_in(("take", "sift"), stage)) == ["near", "means", "points"]
    assert list(inputs_in(("take",), stage)) == ["near", "points"]  # what is not optional is missed later
    outputs = stage.run(OptionalInputs(EMPTY_STREAM), None)
    assert run_in_memory(stage, OptionalInputs(EMPTY_STREAM), None) == outputs
    assert outputs.counts is None


def test_an_optional_table_is_read_and_written_where_there_is_one(pool: Pool) -> None:
    _stage_of_options(pool)
    pool.run()
    assert (pool.run_folder / "tell" / "calibration.json").read_text() == "True\n"
    assert (pool.run_folder / "tell" / "counts.parquet").is_file()
    assert "sift/means" in read_manifest(pool.run_folder / "tell").key.inputs


def test_without_it_nothing_is_written_and_the_stage_is_current(pool: Pool) -> None:
    elsewhere = Artefact("another", "means", "table", "means", toys.MEANS.columns)

    @dataclass(frozen=True)
    class Inputs:
        near: Annotated[Stream, toys.NEAR]
        means: Annotated[pd.DataFrame | None, elsewhere] = None

    _stage_of_options(pool)
    pool.stages[2].Inputs = Inputs  # type: ignore[attr-defined]
    pool.run()
    assert (pool.run_folder / "tell" / "calibration.json").read_text() == "False\n"
    assert not (pool.run_folder / "tell" / "counts.parquet").exists()
    assert list(read_manifest(pool.run_folder / "tell").key.inputs) == ["sift/near"]
    assert pool.run() == []
    assert problems_of_run(pool.stages, pool.run_folder) == []


def test_dropped_records_reach_the_stage() -> None:
    seen: list[int] = []
    stage = toys.stages()[0]

    def keep(source: str, chunk: Chunk, prepared: None, config: object) -> BatchResult:
        seen.append(chunk.dropped["bad"])
        return BatchResult({}, 0)

    stage.run_batch = keep  # type: ignore[attr-defined]
    path = Path(toys.__file__).with_name("nothing.bin")
    with pytest.raises(FileNotFoundError):
        run_in_memory(stage, toys.TakeInputs(Stream((toys.RawPart(path),))), None)
    assert run_in_memory(stage, toys.TakeInputs(EMPTY_STREAM), None).points.parts == ()
    assert seen == []
