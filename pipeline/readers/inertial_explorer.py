"""NovAtel Inertial Explorer's text exports (Waypoint), by the layout that their header tells (``ie_layout.py``).

Its angles are those of this project: z up, y forward, x to the right; R_level_from_body = Rz(-heading) Rx(pitch)
Ry(roll), heading clockwise from true north (Waypoint Software User Manual, OM-20000166: "yaw = -heading"); it may run
from -180 to 180. Heights are ellipsoidal (H-Ell), or H-MSL + Undulation. Times are GPS seconds of week with Week, with
a date, or with ``ins.gps_week`` (the week in which the file begins), or UTC with UTCDate (``ie_times.py``). Angles of
three columns have their sign at the degrees, -0 included.

Q is the quality of the position, from 1 to 6; from 4 on (0.5 to 2 m) it may be worse than the 0.5 m within which the
target is looked for, and such rows are left out. SDNorth, SDEast, SDHeight, RollSD, PitchSD and HdngSD are taken as the
INS's own sigmas. Other columns are ignored. Rows of another number of columns (footers, cut lines), rows with a word
where a number should be and a last line without line end are left out and counted.
"""

import io
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.readers.float32_checks import refuse_float32
from pipeline.readers.inertial_explorer_layout import POSITION, SIGMAS, Layout, read_layout
from pipeline.readers.inertial_explorer_names import column_names
from pipeline.readers.inertial_explorer_times import SECOND, combine, days_of, keep_times
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import (
    INS_COLUMNS,
    Order,
    Sieve,
    chunk,
    keep_possible_poses,
    latency_ns,
    no_rows,
    sigma_rows,
)
from pipeline.readers.sbet import running_weeks
from pipeline.readers.table_columns import CSV_BLOCK, MAX_LINE

WORST_Q = 3
NUMBER = r"^-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$"
Columns = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class InertialExplorerPart:
    """One export; ``gps_week`` is the week of its first row, where it has no other."""

    path: Path
    name: str
    gps_week: int | None
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        layout = read_layout(self.path, self.name)
        dropped: Counter[str] = Counter()
        order, week, last, first = Order(self.name), self.gps_week or 0, -np.inf, True
        with opened(self.path, self.name) as file:
            for columns in _tables(file, layout, self.name, dropped):
                if first:
                    _refuse_float32(columns, layout, self.name)
                    first = False
                if layout.clock == "gps_week" and len(columns["gpstime"]):
                    weeks, week, last = running_weeks(columns["gpstime"], week, last)
                    columns["week"] = weeks.astype(np.float64)
                yield _chunk(columns, layout, order, self.latency_s, dropped)
            if dropped:
                yield no_rows(INS_COLUMNS, dropped)
        order.check()


# --- rows as columns -------------------------------------------------------------------------------------------------
def _tables(file: BinaryIO, layout: Layout, name: str, dropped: Counter[str]) -> Iterator[Columns]:
    """The columns that are read, in degrees, metres and seconds, block by block."""
    file.seek(layout.start)
    held, fitted = b"", False
    while data := file.read(CSV_BLOCK):
        whole, end, held = (held + data).rpartition(b"\n")
        if len(held) > MAX_LINE:
            dropped["line without end"] += 1
            held = b""
        _refuse_second_header(whole, name)
        rows = _separated(whole + end, layout.separators)
        if not rows.strip():
            continue
        table = _parsed(rows, layout, dropped)
        if not (fitted or table.num_rows):
            count = len(rows.split(b"\n", 1)[0].split())
            if count == layout.width:
                raise RawDataError(
                    f"{name}: its first row has a word where a number should be; export numbers alone, with a minus in "
                    "place of S and W"
                )
            raise RawDataError(
                f"{name}: its header names {layout.width} columns, its first row has {count}; export it again, without "
                "columns that may be blank, or have blanks within them"
            )
        fitted = True
        yield _columns(table, layout)
    if held.strip():
        dropped["last line without line end"] += 1


def _refuse_second_header(block: bytes, name: str) -> None:
    """Rows below other names would be read in the order, and the units, of the first."""
    letters, end = block.lower(), 0
    while (found := letters.find(b"latitude", end)) >= 0:
        start, end = block.rfind(b"\n", 0, found) + 1, block.find(b"\n", found) % (len(block) + 1)
        if column_names(block[start:end].decode("latin-1").strip()) is not None:
            raise RawDataError(
                f"{name}: has a second line of column names: it is several exports, one after the other; give each in "
                "a file of its own"
            )


def _separated(block: bytes, separators: bytes) -> bytes:
    """Rows with one blank between columns, and none at their ends; no empty first row; no + before a number, and no
    letters that no number has (a ? in their place)."""
    blanks, end = b" \t\v\f\r" + separators, ord("\n")
    letters = bytes(32 if one in blanks else one if 32 < one < 127 or one == end else ord("?") for one in range(256))
    codes = np.frombuffer(block.translate(letters), np.uint8)
    blank = codes == ord(" ")
    follows = np.concatenate([[True], (blank | (codes == end))[:-1]])
    kept = codes[~(blank & follows)]
    rows = kept[~((kept == ord(" ")) & np.append(kept[1:] == end, True))].tobytes().lstrip(b"\n")
    return re.sub(rb"(?:(?<=[ \n])|\A)\+", b"", rows) if b"+" in rows else rows


def _parsed(rows: bytes, layout: Layout, dropped: Counter[str]) -> pa.Table:
    """The needed columns as doubles; rows that do not fit are counted."""
    from pyarrow import csv

    def skip(row: csv.InvalidRow) -> Literal["skip"]:
        wrong["row with another number of columns"] += 1
        return "skip"

    def read(kind: pa.DataType) -> pa.Table:
        wrong.clear()
        return csv.read_csv(
            io.BytesIO(rows),
            csv.ReadOptions(use_threads=False, block_size=len(rows) + 1, column_names=names),
            csv.ParseOptions(delimiter=" ", quote_char=False, invalid_row_handler=skip),
            csv.ConvertOptions(column_types=dict.fromkeys(wanted, kind), include_columns=wanted, null_values=[]),
        )

    wrong: Counter[str] = Counter()
    names = [str(place) for place in range(layout.width)]
    wanted = [str(place) for places in layout.places.values() for place in places]
    try:
        table = read(pa.float64())
    except pa.ArrowInvalid:
        table = _numbers(read(pa.binary()), wrong)
    dropped.update(wrong)
    return table


def _numbers(table: pa.Table, wrong: Counter[str]) -> pa.Table:
    """Rows of numbers alone, out of columns of words."""
    import pyarrow.compute as pc

    good = np.ones(table.num_rows, dtype=bool)
    for column in table.columns:
        good &= pc.match_substring_regex(column, NUMBER).to_numpy()
    wrong["word where a number should be"] += int(np.count_nonzero(~good))
    found = table.filter(pa.array(good)).to_pydict()
    return pa.table({name: pa.array([float(word) for word in words], pa.float64()) for name, words in found.items()})


def _columns(table: pa.Table, layout: Layout) -> Columns:
    raw = {name: [table[str(place)].to_numpy() for place in places] for name, places in layout.places.items()}
    found = {name: layout.scales[name] * values[0] for name, values in raw.items() if len(values) == 1}
    for name, values in raw.items():
        if len(values) == 3 and name not in ("gpsdate", "utcdate"):
            found[name] = _of_sixtieths(*values)
    for date in {"gpsdate", "utcdate"} & raw.keys():
        parts = dict(zip(layout.order, raw[date], strict=True))
        found[date] = days_of(parts["y"], parts["m"], parts["d"])
    for time in {"gpstime", "utctime", SECOND} & raw.keys():
        if len(raw[time]) == 3:
            found[time] *= 3600  # hours
    combine(found)
    return found


@np.errstate(all="ignore")
def _of_sixtieths(whole: NDArray[np.float64], minutes: NDArray[Any], seconds: NDArray[Any]) -> NDArray[np.float64]:
    """Degrees or hours; the sign is the first column's, also of -0. NaN where minutes or seconds are none."""
    good = (minutes >= 0) & (minutes < 60) & (seconds >= 0) & (seconds <= 60) & (whole == np.rint(whole))
    value = np.copysign(np.abs(whole) + minutes / 60 + seconds / 3600, whole)
    return np.where(good, value, np.nan)


# --- columns as poses ------------------------------------------------------------------------------------------------
def _refuse_float32(columns: Columns, layout: Layout, name: str) -> None:
    """As of other formats, of numbers that have been printed: to within half a step they are float32 numbers. Where
    those lie as near together as what is printed, that says nothing."""
    found = {}
    for column, step in layout.steps.items():
        values = columns[layout.time if column == "time" else column]
        with np.errstate(all="ignore"):
            single = values.astype(np.float32)
            rounded = single.astype(np.float64)
            near = (np.abs(values - rounded) <= 0.5001 * step) & (np.spacing(np.abs(single)) > 4 * step)
        found["seconds_of_week" if column == "time" else f"{column}_deg"] = np.where(near, rounded, values)
    refuse_float32(found, name)


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def _chunk(columns: Columns, layout: Layout, order: Order, latency_s: float, dropped: Counter[str]) -> Chunk:
    angles = {f"{name}_rad": np.radians(columns[name]) for name in (*POSITION, "roll", "pitch")}
    height = columns["h-ell"] if "h-ell" in columns else columns["h-msl"] + columns["undulation"]
    sieve = Sieve({"row": np.arange(len(height)), "height_m": height, **angles}, dropped)
    sieve.columns["azimuth_rad"] = np.radians(columns["heading"])
    if "q" in columns:
        sieve.columns["q"] = np.nan_to_num(columns["q"], nan=-1.0)
        _keep_quality(sieve)
    keep_possible_poses(sieve)
    keep_times(sieve, columns, layout.clock, layout.time, len(layout.places[layout.time]) == 3)
    sieve.columns["t_ns"] = sieve["t_ns"] - latency_ns(latency_s)
    order.keep(sieve)
    given = {name: columns[column][sieve["row"]] for name, column in SIGMAS.items() if column in columns}
    sigmas = sigma_rows(sieve["t_ns"], given, dropped)
    return chunk(sieve.columns, INS_COLUMNS, dropped, sigmas)


def _keep_quality(sieve: Sieve) -> None:
    bad = ~((sieve["q"] >= 1) & (sieve["q"] <= WORST_Q))
    for quality in np.unique(sieve["q"][bad])[:10].tolist():  # of damaged ones a few by name
        sieve.keep(sieve["q"] != quality, f"quality Q {quality:g}")
    sieve.keep((sieve["q"] >= 1) & (sieve["q"] <= WORST_Q), "quality Q of another number")
