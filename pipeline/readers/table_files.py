"""CSV and Parquet files of tables, read as batches of the columns that a sensor needs."""

import io
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, BinaryIO, Literal, cast

import pyarrow as pa

from pipeline.artefacts.streams import BATCH_ROWS
from pipeline.errors import RawDataError
from pipeline.readers.claimed_counts import refuse_claim
from pipeline.readers.raw_file import opened, read_at, size_of
from pipeline.readers.table_columns import FLOAT64_ONLY, WHOLE_NUMBERS, TableSensor, choose_columns, csv_header

MAX_LINE = 65_536  # bytes
CSV_BLOCK = 4 << 20  # bytes
TABLE_SENSORS: tuple[TableSensor, ...] = ("ins", "laser", "mbes")


def record_batches(
    file: BinaryIO, name: str, sensor: TableSensor, dropped: Counter[str], max_records: int | None = None
) -> Iterator[pa.RecordBatch]:
    """Yield the columns that a sensor needs, batch by batch.

    Parameters
    ----------
    file : BinaryIO
        CSV or Parquet file.
    name : str
        Its path in the session folder, for messages.
    sensor : TableSensor
        The sensor of the table.
    dropped : Counter
        Counts of rows that are left out, by reason; changed in place.
    max_records : int or None
        ``max_records`` of session.yaml.

    Yields
    ------
    pyarrow.RecordBatch
        At most BATCH_ROWS rows.

    Raises
    ------
    RawDataError
        The file cannot be read as a table, lacks a column, has a column of the wrong type, or claims too many rows.
    """
    is_parquet = read_at(file, 0, 4) == b"PAR1"
    size = size_of(file)

    def refuse(claimed: int) -> None:
        refuse_claim(claimed, size, max_records, sensor, name)

    try:
        yield from _parquet(file, name, sensor, refuse) if is_parquet else _csv(file, name, sensor, dropped)
    except (pa.ArrowException, ValueError, OverflowError) as error:
        reason = str(error).split("\n")[0]
        reason = reason if len(reason) <= 200 else f"{reason[:200]}..."  # the error may quote whole cells
        raise RawDataError(f"{name}: cannot be read as a table ({reason}); check or export it again") from error


def _parquet(file: BinaryIO, name: str, sensor: TableSensor, refuse: Callable[[int], None]) -> Iterator[pa.RecordBatch]:
    """Yield the needed columns of a Parquet file; ``refuse`` raises if the claimed number of rows is too large."""
    import pyarrow.parquet as pq

    with pq.ParquetFile(file) as table:
        groups = range(table.metadata.num_row_groups)
        refuse(max(table.metadata.num_rows, sum(table.metadata.row_group(k).num_rows for k in groups)))
        schema = table.schema_arrow
        chosen = choose_columns(list(schema.names), name, sensor)
        for column in chosen:
            kind = schema.field(column).type
            if column in FLOAT64_ONLY and kind in (pa.float32(), pa.float16()):
                raise RawDataError(f"{name}: column {column} is {kind}, which loses digits; write it as double")
            if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
                raise RawDataError(f"{name}: column {column} is {kind}, not a number; write it as a number")
            if column == "gps_ns" and not pa.types.is_integer(kind):
                raise RawDataError(f"{name}: column gps_ns is {kind}, which cannot hold nanoseconds; write it as int64")
        for batch in table.iter_batches(batch_size=BATCH_ROWS, columns=chosen, use_threads=False):
            yield batch.select(chosen)


class _WholeLines(io.RawIOBase):
    """The bytes ``start`` to ``stop`` of a CSV file as a file, with the methods that pyarrow needs."""

    def __init__(self, file: BinaryIO, start: int, stop: int) -> None:
        self.file, self.left = file, stop - start
        file.seek(start)

    def read(self, count: int = -1) -> bytes:
        data = self.file.read(self.left if count < 0 else min(count, self.left))
        self.left -= len(data)
        return data

    def readable(self) -> bool:
        return True


def _csv(file: BinaryIO, name: str, sensor: TableSensor, dropped: Counter[str]) -> Iterator[pa.RecordBatch]:
    from pyarrow import csv

    size = size_of(file)
    separator, names = _csv_names(file, name)
    chosen = choose_columns(names, name, sensor)
    start, stop = file.tell(), _last_line_end(file, size)
    if stop < size:
        dropped["last line without line end"] += 1
    if stop <= start:
        return

    def skip(row: csv.InvalidRow) -> Literal["skip"]:
        dropped["row with another number of columns"] += 1
        return "skip"

    unique = [column if names.index(column) == k else f"{column} {k}" for k, column in enumerate(names)]
    types = {column: pa.int64() if column in WHOLE_NUMBERS else pa.float64() for column in chosen}
    reader = csv.open_csv(
        cast(IO[bytes], _WholeLines(file, start, stop)),
        csv.ReadOptions(use_threads=False, block_size=CSV_BLOCK, column_names=unique),
        csv.ParseOptions(delimiter=separator, invalid_row_handler=skip),
        csv.ConvertOptions(column_types=types, include_columns=chosen),
    )
    with reader:
        for batch in reader:
            for start in range(0, batch.num_rows, BATCH_ROWS):
                yield batch.slice(start, BATCH_ROWS)


def _csv_names(file: BinaryIO, name: str) -> tuple[str, list[str]]:
    """Return separator and column names of a CSV file, which is then at the line behind them."""
    while (line := file.readline(MAX_LINE)).lstrip(b"\xef\xbb\xbf").startswith((b"#", b"//")) or line.isspace():
        continue
    header = csv_header(line.decode("utf-8-sig", "replace"))
    if header is None or not line.endswith(b"\n"):
        raise RawDataError(f"{name}: its first line names no column; name them as docs/your-files.md has them")
    return header


def sensors_of_table(path: Path, name: str) -> list[TableSensor]:
    """Return the sensors whose columns a table has; ``name`` is the file's name in messages.

    Raises
    ------
    RawDataError
        The file cannot be read as a table, or has the columns of no sensor. The message names those that are missing of
        the sensor that lacks fewest.
    """
    import pyarrow.parquet as pq

    with opened(path, name) as file:
        try:
            parquet = read_at(file, 0, 4) == b"PAR1"
            size_of(file)
            names = list(pq.read_schema(file).names) if parquet else _csv_names(file, name)[1]
        except (pa.ArrowException, ValueError, OverflowError, OSError) as error:
            raise RawDataError(f"{name}: cannot be read as a table; check or export it again") from error
    sensors: list[TableSensor] = []
    refusals: list[RawDataError] = []
    for sensor in TABLE_SENSORS:
        try:
            choose_columns(names, name, sensor)
            sensors.append(sensor)
        except RawDataError as error:
            refusals.append(error)
    if not sensors:
        raise min(refusals, key=lambda error: str(error).partition(" (has")[0].count(","))
    return sensors


def _last_line_end(file: BinaryIO, size: int) -> int:
    """Return the byte after the last line end; the file's size if the last MAX_LINE bytes have no line end."""
    before = max(size - MAX_LINE, 0)
    tail = read_at(file, before, MAX_LINE)
    return before + tail.rfind(b"\n") + 1 if b"\n" in tail else size
