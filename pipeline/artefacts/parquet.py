"""Tables and streams as Parquet files. The bytes depend only on the rows, not on batch sizes, workers or threads."""

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import BATCH_ROWS, Batch
from pipeline.atomic_files import writing
from pipeline.errors import ArtefactError

PART_ROWS = 4_000_000  # a longer part of a stream is continued in the next file


def to_arrow(columns: Mapping[str, Any] | pd.DataFrame, artefact: Artefact) -> pa.Table:
    """Return columns as an Arrow table, in the artefact's order and types.

    Raises
    ------
    TypeError
        A column is missing, is unknown, or does not fit its type. (Floats may be rounded to single precision.) This is
        a bug of the stage.
    """
    where = f"{artefact.owner}/{artefact.name}"
    expected = {column.name for column in artefact.columns}
    present = set(columns.keys())
    if not present and not len(columns):
        return artefact.schema.empty_table()
    if present != expected:
        missing, surplus = sorted(expected - present), sorted(present - expected)
        raise TypeError(f"{where}: missing columns {missing}, columns unknown to the artefact {surplus}")
    schema = artefact.schema
    return pa.Table.from_arrays([_to_array(columns[f.name], f, where) for f in schema], schema=schema)


def _to_array(values: Any, field: "pa.Field[Any]", where: str) -> "pa.Array[Any]":
    values = values.to_numpy() if isinstance(values, pd.Series) else np.asarray(values)
    plain = pa.types.is_list(field.type) or pa.types.is_string(field.type)
    if plain:
        values = list(values)
    elif values.dtype == object:
        values = np.array(list(values))
    try:
        if not plain and len(values) and not np.can_cast(values.dtype, field.type.to_pandas_dtype(), "same_kind"):
            raise TypeError(f"these are {values.dtype}")
        if pa.types.is_floating(field.type):
            values = values.astype(field.type.to_pandas_dtype(), copy=False)
        array: Any = pa.array(values, type=field.type, from_pandas=False)
    except (pa.ArrowException, TypeError, OverflowError) as error:
        raise TypeError(f"{where}: column {field.name} does not fit {field.type}: {error}") from error
    if isinstance(array, pa.ChunkedArray):
        array = array.combine_chunks()
    if array.null_count:
        raise TypeError(f"{where}: column {field.name} has {array.null_count} missing values")
    return cast("pa.Array[Any]", array)


def _writer(path: Path, schema: pa.Schema) -> pq.ParquetWriter:
    """Return a writer that stores integers as differences, floats byte by byte: LZ4 compresses them well and fast.

    Of times alone it writes the least and the largest of each group: for other columns nobody asks, and it takes time.
    """
    encodings = {}
    for field in schema:
        inner = field.type.value_type if pa.types.is_list(field.type) else field.type
        leaf = f"{field.name}.list.element" if pa.types.is_list(field.type) else field.name
        if pa.types.is_floating(inner):
            encodings[leaf] = "BYTE_STREAM_SPLIT"
        elif inner in (pa.int32(), pa.int64()):
            encodings[leaf] = "DELTA_BINARY_PACKED"
    return pq.ParquetWriter(
        path, schema, compression="lz4", use_dictionary=False, column_encoding=encodings, write_statistics=["t_ns"]
    )


def write_table(path: Path, table: pa.Table) -> None:
    """Write a table to a file."""
    with writing(path), _writer(path, table.schema) as writer:
        writer.write_table(table, row_group_size=BATCH_ROWS)


def read_table(path: Path, artefact: Artefact, columns: Sequence[str] = ()) -> pd.DataFrame:
    """Return a table of a file, or some of its columns.

    Parameters
    ----------
    path : Path
        The Parquet file.
    artefact : Artefact
        The table that the file must contain.
    columns : sequence of str
        Columns to read; empty: all.

    Raises
    ------
    ArtefactError
        The file cannot be read, or it contains another table.
    """
    try:
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            table = file.read(list(columns) or None, use_threads=False)
    except (OSError, pa.ArrowException) as error:
        raise ArtefactError(f"{path}: cannot be read ({error}); delete {path.parent} and run again") from error
    if not schema.equals(artefact.schema):
        raise ArtefactError(f"{path}: is no {artefact.owner}/{artefact.name}; delete {path.parent} and run again")
    return from_arrow(table)


def from_arrow(table: pa.Table) -> pd.DataFrame:
    """Return an Arrow table as a DataFrame. Metadata that pandas may have stored are ignored."""
    return table.to_pandas(ignore_metadata=True, use_threads=False)


class PartWriter:
    """Writer of one part of a stream.

    For batches of any size it writes row groups of BATCH_ROWS rows, and files of at most PART_ROWS rows.
    """

    def __init__(self, folder: Path, artefact: Artefact, number: int) -> None:
        self.paths: list[Path] = []
        self._folder, self._artefact, self._number = folder, artefact, number
        self._waiting: list[dict[str, np.ndarray]] = []
        self._rows_waiting = 0
        self._rows_in_file = 0
        self._file: pq.ParquetWriter | None = None

    def add(self, batch: Batch) -> None:
        """Append the rows of a batch."""
        rows = len(next(iter(batch.values()))) if batch else 0
        if not rows:
            to_arrow(batch, self._artefact)  # checks the columns
            return
        self._waiting.append({name: np.asarray(values) for name, values in batch.items()})
        self._rows_waiting += rows
        while self._rows_waiting >= self._group_rows():
            self._flush(self._group_rows())

    def close(self) -> None:
        """Write the remaining rows, and close the file."""
        if self._rows_waiting:
            self._flush(self._rows_waiting)
        self._close_file()

    def _group_rows(self) -> int:
        return min(BATCH_ROWS, PART_ROWS - self._rows_in_file)

    def _flush(self, rows: int) -> None:
        names = self._waiting[0].keys()
        if any(batch.keys() != names for batch in self._waiting):
            raise TypeError(f"{self._artefact.owner}/{self._artefact.name}: batches with different columns")
        joined = self._waiting[0]
        if len(self._waiting) > 1:
            joined = {name: np.concatenate([batch[name] for batch in self._waiting]) for name in names}
        group = to_arrow({name: values[:rows] for name, values in joined.items()}, self._artefact)
        self._rows_waiting -= rows
        self._waiting = [{name: values[rows:] for name, values in joined.items()}] if self._rows_waiting else []
        path = self._folder / f"part-{self._number:05d}-{len(self.paths) - bool(self._file):03d}.parquet"
        with writing(path):
            if self._file is None:
                self._file = _writer(path, self._artefact.schema)
                self.paths.append(path)
            self._file.write_table(group, row_group_size=rows)
        self._rows_in_file += rows
        if self._rows_in_file >= PART_ROWS:
            self._close_file()

    def _close_file(self) -> None:
        if self._file is not None:
            file, self._file, self._rows_in_file = self._file, None, 0
            with writing(self.paths[-1]):
                file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        if error is None:
            self.close()
        elif self._file is not None:  # the part is not kept: its file is only closed
            with contextlib.suppress(OSError, pa.ArrowException):
                self._file.close()


def write_empty_part(folder: Path, artefact: Artefact) -> Path:
    """Write a file without rows and return its path. With it the folder of an empty stream can be read."""
    path = folder / "part-00000-000.parquet"
    with writing(path), _writer(path, artefact.schema):
        pass
    return path


def row_count(path: Path) -> int:
    """Return the number of rows of a Parquet file, from its footer."""
    return int(pq.read_metadata(path).num_rows)
