"""A stream's fold: its parts are read in pieces on this machine, whole on a cluster, and the results are the same."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipeline.artefacts.streams import Batch, MemoryPart, ParquetPart, Stream
from pipeline.errors import ArtefactError

GROUP, ROWS = 10, (25, 0, 7)  # rows of a group; of each file


@pytest.fixture
def parts(tmp_path: Path) -> tuple[ParquetPart, ...]:
    start, found = 0, []
    for number, rows in enumerate(ROWS):
        table = pa.table({"x": np.arange(start, start + rows), "y": np.zeros(rows)})
        pq.write_table(table, tmp_path / f"part-{number}.parquet", row_group_size=GROUP)
        found.append(ParquetPart(tmp_path / f"part-{number}.parquet"))
        start += rows
    return tuple(found)


def columns_and_values(batch: Batch) -> tuple[list[str], list[int]]:
    return sorted(batch), batch["x"].tolist()


def counted(tasks: list[Any], function: Callable[..., Any], *items: Iterable[object]) -> Iterator[Any]:
    """Map, and keep what is mapped."""
    for arguments in zip(*items, strict=True):
        tasks.append(arguments)
        yield function(*arguments)


def test_here_a_task_is_one_row_group_and_on_a_cluster_one_file(parts: tuple[ParquetPart, ...]) -> None:
    here: list[Any] = []
    on_cluster: list[Any] = []
    mapper = partial(counted, here)
    results = [
        list(Stream(parts, mapper, mapper).only(["x"]).fold(columns_and_values)),
        list(Stream(parts, partial(counted, on_cluster)).only(["x"]).fold(columns_and_values)),
    ]
    assert results[0] == results[1]
    assert [values for _, values in results[0]] == [
        list(range(10)),
        list(range(10, 20)),
        list(range(20, 25)),
        list(range(25, 32)),
    ]
    assert all(names == ["x"] for names, _ in results[0])
    assert len(here) == 5  # an empty file has one, empty row group
    assert len(on_cluster) == len(ROWS)


def test_parts_in_memory_stay_whole() -> None:
    part = MemoryPart("points", {"x": np.arange(5)})
    assert list(Stream((part,)).fold(columns_and_values)) == [(["x"], [0, 1, 2, 3, 4])]


def test_a_file_that_cannot_be_read_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "part-0.parquet").write_bytes(b"PAR1 cut")
    with pytest.raises(ArtefactError, match=r"part-0\.parquet: cannot be read .* delete its folder and run again"):
        list(Stream((ParquetPart(tmp_path / "part-0.parquet"),)).fold(columns_and_values))


def odd(batch: Batch) -> Batch:
    return {name: values[batch["x"] % 2 == 1] for name, values in batch.items()}


def test_a_changed_stream_has_the_rows_that_are_left(parts: tuple[ParquetPart, ...]) -> None:
    """In the same order, in pieces or whole, with some columns or all; what keeps nothing has no batch."""
    expected = list(range(1, sum(ROWS), 2))
    stream = Stream(parts).changed(odd)
    assert [x for batch in stream.batches() for x in batch["x"].tolist()] == expected
    for mapper in (map, partial(counted, [])):  # in pieces, and whole
        read = Stream(parts, mapper=mapper, here=map).changed(odd).only(["x"])
        found = list(read.fold(columns_and_values))
        assert [columns for columns, _ in found] == [["x"]] * len(found)
        assert [x for _, values in found for x in values] == expected
    nothing = Stream((MemoryPart("even", {"x": np.array([2, 4])}),)).changed(odd)
    assert list(nothing.batches()) == []
