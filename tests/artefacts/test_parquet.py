"""Bytes on disk: what they hold, and that they depend on the rows alone."""

import itertools
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.artefacts import parquet
from pipeline.artefacts.columns import BOOL, F64, FLOATS, I16, I64, TEXT
from pipeline.artefacts.parquet import PartWriter, from_arrow, read_table, to_arrow, write_table
from pipeline.artefacts.schema import Artefact, Column
from pipeline.artefacts.streams import ParquetPart
from pipeline.errors import ArtefactError

ROWS = Artefact(
    "toy", "rows", "stream", "rows",
    (Column("t_ns", I64, "ns", "time"), Column("beam", I16, "1", "beam"), Column("x_m", F64, "m", "x")),
)  # fmt: skip
MIXED = Artefact(
    "toy", "mixed", "table", "all types",
    (
        Column("name", TEXT, "", "a name"), Column("good", BOOL, "", "a flag"), Column("n", I64, "1", "a number"),
        Column("values", FLOATS, "m", "a row of numbers"), Column("x_m", F64, "m", "x"),
    ),
)  # fmt: skip


def _batch(start: int, stop: int) -> dict[str, np.ndarray]:
    t_ns = np.arange(start, stop)
    return {"x_m": np.sin(t_ns), "t_ns": t_ns, "beam": t_ns % 256}


def _write(folder: Path, cuts: list[int]) -> list[Path]:
    folder.mkdir()
    with PartWriter(folder, ROWS, 7) as part:
        for start, stop in itertools.pairwise(cuts):
            part.add(_batch(start, stop))
    return part.paths


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Row groups of 100 rows, files of 250."""
    monkeypatch.setattr(parquet, "BATCH_ROWS", 100)
    monkeypatch.setattr(parquet, "PART_ROWS", 250)


@given(st.lists(st.integers(0, 720), max_size=12))
def test_batches_do_not_show(tmp_path_factory: pytest.TempPathFactory, cuts: list[int]) -> None:
    folder = tmp_path_factory.mktemp("parts")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parquet, "BATCH_ROWS", 100)
        patch.setattr(parquet, "PART_ROWS", 250)
        whole, pieces = _write(folder / "a", [0, 720]), _write(folder / "b", [0, *sorted(cuts), 720])
    assert [p.name for p in pieces] == ["part-00007-000.parquet", "part-00007-001.parquet", "part-00007-002.parquet"]
    assert [p.read_bytes() for p in pieces] == [p.read_bytes() for p in whole]


def test_row_groups_and_files_are_full(tmp_path: Path, small: None) -> None:
    found = [pq.read_metadata(path) for path in _write(tmp_path / "a", [0, 30, 500, 501])]
    groups = [[file.row_group(k).num_rows for k in range(file.num_row_groups)] for file in found]
    assert groups == [[100, 100, 50], [100, 100, 50], [1]]


def test_a_part_that_just_fills_its_file_opens_no_other(tmp_path: Path, small: None) -> None:
    assert len(_write(tmp_path / "a", [0, 250])) == 1


def test_a_part_without_rows_writes_no_file(tmp_path: Path) -> None:
    assert _write(tmp_path / "a", [0, 0]) == []


def test_a_stream_without_rows_can_be_read(tmp_path: Path) -> None:
    path = parquet.write_empty_part(tmp_path, ROWS)
    assert list(ParquetPart(path).chunks()) == []
    assert pq.read_schema(path).equals(ROWS.schema, check_metadata=True)


def test_rows_come_back_with_types_units_and_without_pandas(tmp_path: Path) -> None:
    (path,) = _write(tmp_path / "a", [0, 10, 1000])
    (chunk,) = ParquetPart(path).chunks()
    assert {name: values.dtype.name for name, values in chunk.columns.items()} == {
        "t_ns": "int64", "beam": "int16", "x_m": "float64",
    }  # fmt: skip
    np.testing.assert_array_equal(chunk.columns["x_m"], np.sin(np.arange(1000)))
    schema = pq.read_schema(path)
    assert schema.field("x_m").metadata == {b"unit": b"m", b"meaning": b"x"} | _id(schema.field("x_m"))
    assert b"pandas" not in (schema.metadata or {})
    column = pq.read_metadata(path).row_group(0).column(2)
    assert column.compression == "LZ4"
    assert "BYTE_STREAM_SPLIT" in column.encodings


def _id(field: "pa.Field[pa.DataType]") -> dict[bytes, bytes]:
    return {key: value for key, value in (field.metadata or {}).items() if key.startswith(b"PARQUET")}


def test_a_damaged_part_is_the_disks_fault(tmp_path: Path) -> None:
    (path,) = _write(tmp_path / "a", [0, 1000])
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(ArtefactError, match="cannot be read"):
        list(ParquetPart(path).chunks())


# --- tables ----------------------------------------------------------------------------------------------------------
def _mixed() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "x_m": [1.5, np.nan],
            "values": [np.array([1.0, 2.0]), [3.0]],
            "n": np.array([1, 2], dtype=np.int32),
            "good": [True, False],
            "name": ["a", "ß"],
        }
    )


def test_a_table_comes_back(tmp_path: Path) -> None:
    table = to_arrow(_mixed(), MIXED)
    write_table(tmp_path / "mixed.parquet", table)
    back = read_table(tmp_path / "mixed.parquet", MIXED)
    pd.testing.assert_frame_equal(back, from_arrow(table))
    assert list(back.columns) == ["name", "good", "n", "values", "x_m"]
    assert list(back["values"][0]) == [1.0, 2.0]
    assert np.isnan(back["x_m"][1])


def test_a_table_without_rows_comes_back(tmp_path: Path) -> None:
    write_table(tmp_path / "mixed.parquet", to_arrow(_mixed().iloc[:0], MIXED))
    assert len(read_table(tmp_path / "mixed.parquet", MIXED)) == 0
    assert len(to_arrow(pd.DataFrame(), MIXED)) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n": [1.5, 2.0]}, "column n"),
        ({"n": [2**70, 1]}, "column n"),
        ({"name": ["a", None]}, "column name has 1 missing"),
        ({"name": [1, 2]}, "column name"),
        ({"x_m": ["1", "2"]}, "column x_m"),
        ({"good": [0.5, 1]}, "column good"),
        ({"values": [[1.0], None]}, "column values has 1 missing"),
        ({"extra": [1, 2]}, "unknown to the artefact .'extra'"),
    ],
)
def test_what_does_not_fit_is_a_bug(change: dict[str, list[object]], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        to_arrow(_mixed().assign(**{name: pd.Series(values, dtype=object) for name, values in change.items()}), MIXED)


def test_a_missing_column_is_a_bug() -> None:
    with pytest.raises(TypeError, match=r"missing columns \['n'\]"):
        to_arrow(_mixed().drop(columns="n"), MIXED)


def test_a_beam_beyond_its_type_is_a_bug() -> None:
    with pytest.raises(TypeError, match="column beam does not fit int16"):
        to_arrow({"t_ns": np.array([1]), "beam": np.array([40000]), "x_m": np.array([0.0])}, ROWS)


def test_another_table_under_this_name_is_refused(tmp_path: Path) -> None:
    write_table(tmp_path / "mixed.parquet", to_arrow(_batch(0, 3), ROWS))
    with pytest.raises(ArtefactError, match="is no toy/mixed"):
        read_table(tmp_path / "mixed.parquet", MIXED)
