"""CSV and Parquet files as batches of just the columns that a sensor needs; which those are says ``table.py``."""

import io
from collections import Counter
from collections.abc import Callable, Iterator
from typing import IO, BinaryIO, Literal, cast

import pyarrow as pa

from pipeline.artefacts.streams import BATCH_ROWS
from pipeline.errors import RawDataError
from pipeline.readers.claimed_counts import refuse_claim
from pipeline.readers.raw_file import read_at, size_of

Sensor = Literal["ins", "laser", "mbes"]
TIMES = (("gps_ns",), ("gps_week", "seconds_of_week"))
INS = ("latitude_deg", "longitude_deg", "height_m", "roll_deg", "pitch_deg", "heading_deg")
MBES = ("ping", "beam", "angle_deg", "sound_speed_m_s")
NEEDED = {"ins": ((*INS,),), "laser": (("x_m", "y_m", "z_m"),), "mbes": ((*MBES, "two_way_time_s"), (*MBES, "range_m"))}
OPTIONAL: dict[str, tuple[str, ...]] = {"ins": (), "laser": (), "mbes": ("transmit_tilt_deg",)}
WHOLE = ("gps_ns", "gps_week", "ping", "beam")
KNOWN = frozenset(name for group in (*TIMES, *NEEDED["ins"], *NEEDED["laser"], *NEEDED["mbes"]) for name in group)
EXACT = ("gps_ns", "seconds_of_week", "latitude_deg", "longitude_deg")  # useless as float32
SEPARATORS = (",", ";", "\t")
MAX_LINE = 65_536
CSV_BLOCK = 4 << 20


def column_names(line: str) -> tuple[str, list[str]] | None:
    """Separator and names of a CSV's first line; None where not one name is known."""
    for separator in SEPARATORS:
        names = [name.strip().strip('"').lower() for name in line.strip().split(separator)]
        if KNOWN.intersection(names) and (len(names) > 1):
            return separator, names
    return None


def _wanted(names: list[str], name: str, sensor: Sensor) -> list[str]:
    """Which of the columns to read; RawDataError where some that are needed are not there."""
    chosen: list[str] = []
    for alternatives in (TIMES, NEEDED[sensor]):
        for group in alternatives:
            if set(group) <= set(names):
                chosen += group
                break
        else:
            nearest = max(alternatives, key=lambda group: len(set(group) & set(names)))
            missing = ", ".join(column for column in nearest if column not in names)
            raise RawDataError(f"{name}: has no column {missing} (has: {', '.join(names)[:200]}); add it")
    chosen += [column for column in OPTIONAL[sensor] if column in names]
    twice = [column for column in chosen if names.count(column) > 1]
    if twice:
        raise RawDataError(f"{name}: has column {twice[0]} twice; take one out")
    return chosen


def batches(
    file: BinaryIO, name: str, sensor: Sensor, dropped: Counter[str], max_records: int | None = None
) -> Iterator[pa.RecordBatch]:
    is_parquet = read_at(file, 0, 4) == b"PAR1"
    size = size_of(file)

    def refuse(claimed: int) -> None:
        refuse_claim(claimed, size, max_records, sensor, name)

    try:
        yield from _parquet(file, name, sensor, refuse) if is_parquet else _csv(file, name, sensor, dropped)
    except (pa.ArrowException, ValueError, OverflowError) as error:
        told = str(error).split("\n")[0]
        told = told if len(told) <= 200 else f"{told[:200]}..."  # whole cells stand in it
        raise RawDataError(f"{name}: cannot be read as a table ({told}); check or export it again") from error


def _parquet(file: BinaryIO, name: str, sensor: Sensor, refuse: Callable[[int], None]) -> Iterator[pa.RecordBatch]:
    """``refuse``: raises where so many rows are more than can be."""
    import pyarrow.parquet as pq

    with pq.ParquetFile(file) as table:
        groups = range(table.metadata.num_row_groups)
        refuse(max(table.metadata.num_rows, sum(table.metadata.row_group(k).num_rows for k in groups)))
        schema = table.schema_arrow
        chosen = _wanted(list(schema.names), name, sensor)
        for column in chosen:
            kind = schema.field(column).type
            if column in EXACT and kind in (pa.float32(), pa.float16()):
                raise RawDataError(f"{name}: column {column} is {kind}, which loses digits; write it as double")
            if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
                raise RawDataError(f"{name}: column {column} is {kind}, not a number; write it as a number")
            if column == "gps_ns" and not pa.types.is_integer(kind):
                raise RawDataError(f"{name}: column gps_ns is {kind}, which cannot hold nanoseconds; write it as int64")
        for batch in table.iter_batches(batch_size=BATCH_ROWS, columns=chosen, use_threads=False):
            yield batch.select(chosen)


class _WholeLines(io.RawIOBase):
    """A CSV up to its last line end, as pyarrow reads files."""

    def __init__(self, file: BinaryIO, start: int, stop: int) -> None:
        self.file, self.left = file, stop - start
        file.seek(start)

    def read(self, count: int = -1) -> bytes:
        data = self.file.read(self.left if count < 0 else min(count, self.left))
        self.left -= len(data)
        return data

    def readable(self) -> bool:
        return True


def _csv(file: BinaryIO, name: str, sensor: Sensor, dropped: Counter[str]) -> Iterator[pa.RecordBatch]:
    from pyarrow import csv

    size = size_of(file)
    while (line := file.readline(MAX_LINE)).lstrip(b"\xef\xbb\xbf").startswith((b"#", b"//")) or line.isspace():
        continue
    found = column_names(line.decode("utf-8-sig", "replace"))
    if found is None or not line.endswith(b"\n"):
        raise RawDataError(f"{name}: its first line names no column; name them as README.md has them")
    separator, names = found
    chosen = _wanted(names, name, sensor)
    start, stop = file.tell(), _last_line_end(file, size)
    if stop < size:
        dropped["last line without line end"] += 1
    if stop <= start:
        return

    def skip(row: csv.InvalidRow) -> Literal["skip"]:
        dropped["row with another number of columns"] += 1
        return "skip"

    unique = [column if names.index(column) == k else f"{column} {k}" for k, column in enumerate(names)]
    types = {column: pa.int64() if column in WHOLE else pa.float64() for column in chosen}
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


def _last_line_end(file: BinaryIO, size: int) -> int:
    """One past the last line end; where the last MAX_LINE bytes hold none, the file's size."""
    before = max(size - MAX_LINE, 0)
    tail = read_at(file, before, MAX_LINE)
    return before + tail.rfind(b"\n") + 1 if b"\n" in tail else size
