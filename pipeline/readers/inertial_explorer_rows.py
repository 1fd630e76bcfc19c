"""Read the rows of an Inertial Explorer export as columns of numbers, with the layout from its header."""

import io
import re
from collections import Counter
from collections.abc import Iterator
from typing import Any, BinaryIO, Literal

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.inertial_explorer_layout import ExportLayout
from pipeline.readers.inertial_explorer_names import export_column_names
from pipeline.readers.inertial_explorer_times import SECOND_GPS_TIME, combine_gps_times, unix_days
from pipeline.readers.row_filter import Columns
from pipeline.readers.table_files import CSV_BLOCK, MAX_LINE

_NUMBER = r"^-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$"


def read_blocks(file: BinaryIO, layout: ExportLayout, name: str, dropped: Counter[str]) -> Iterator[Columns]:
    """Yield the needed columns in degrees, metres and seconds, block by block.

    Parameters
    ----------
    file : BinaryIO
        The export.
    layout : ExportLayout
        Its layout.
    name : str
        Its path in the session folder, for messages.
    dropped : Counter
        Counts of rows that are left out, by reason; changed in place.

    Raises
    ------
    RawDataError
        The rows do not fit the header, or a second header follows.
    """
    file.seek(layout.start)
    rest, any_row = b"", False
    while data := file.read(CSV_BLOCK):
        lines, end, rest = (rest + data).rpartition(b"\n")
        if len(rest) > MAX_LINE:
            dropped["line without end"] += 1
            rest = b""
        _refuse_second_header(lines, name)
        rows = _normalised(lines + end, layout.separators)
        if not rows.strip():
            continue
        table = _parsed(rows, layout, dropped)
        if not (any_row or table.num_rows):
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
        any_row = True
        yield _columns(table, layout)
    if rest.strip():
        dropped["last line without line end"] += 1


def _refuse_second_header(block: bytes, name: str) -> None:
    """Refuse a second line of names: the rows below it would be read with the order and units of the first line."""
    letters, end = block.lower(), 0
    while (place := letters.find(b"latitude", end)) >= 0:
        start, end = block.rfind(b"\n", 0, place) + 1, block.find(b"\n", place) % (len(block) + 1)
        if export_column_names(block[start:end].decode("latin-1").strip()) is not None:
            raise RawDataError(
                f"{name}: has a second line of column names: it is several exports, one after the other; give each in "
                "a file of its own"
            )


def _normalised(block: bytes, separators: bytes) -> bytes:
    """Return a block's rows with one blank between columns, and none at the ends of rows.

    Empty rows at the start, and plus signs before numbers, are removed. Bytes that are not printable ASCII become '?'.
    """
    blanks, end = b" \t\v\f\r" + separators, ord("\n")
    letters = bytes(
        32 if code in blanks else code if 32 < code < 127 or code == end else ord("?") for code in range(256)
    )
    codes = np.frombuffer(block.translate(letters), np.uint8)
    blank = codes == ord(" ")
    follows = np.concatenate([[True], (blank | (codes == end))[:-1]])
    kept = codes[~(blank & follows)]
    rows = kept[~((kept == ord(" ")) & np.append(kept[1:] == end, True))].tobytes().lstrip(b"\n")
    return re.sub(rb"(?:(?<=[ \n])|\A)\+", b"", rows) if b"+" in rows else rows


def _parsed(rows: bytes, layout: ExportLayout, dropped: Counter[str]) -> pa.Table:
    """Return the needed columns as doubles; leave out rows that do not fit the layout, and count them."""
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
    """Return the rows that hold only numbers, from columns of words."""
    import pyarrow.compute as pc

    numeric = np.ones(table.num_rows, dtype=bool)
    for column in table.columns:
        numeric &= pc.match_substring_regex(column, _NUMBER).to_numpy()
    wrong["word where a number should be"] += int(np.count_nonzero(~numeric))
    words_by_column = table.filter(pa.array(numeric)).to_pydict()
    return pa.table(
        {name: pa.array([float(word) for word in words], pa.float64()) for name, words in words_by_column.items()}
    )


def _columns(table: pa.Table, layout: ExportLayout) -> Columns:
    """Return the columns in degrees, metres and seconds; dates as days since 1970."""
    raw = {name: [table[str(place)].to_numpy() for place in places] for name, places in layout.places.items()}
    columns = {name: layout.scales[name] * values[0] for name, values in raw.items() if len(values) == 1}
    for name, values in raw.items():
        if len(values) == 3 and name not in ("gpsdate", "utcdate"):
            columns[name] = _from_sixtieths(*values)
    for date in {"gpsdate", "utcdate"} & raw.keys():
        parts = dict(zip(layout.order, raw[date], strict=True))
        columns[date] = unix_days(parts["y"], parts["m"], parts["d"])
    for time in {"gpstime", "utctime", SECOND_GPS_TIME} & raw.keys():
        if len(raw[time]) == 3:
            columns[time] *= 3600  # from hours to seconds
    combine_gps_times(columns)
    return columns


@np.errstate(all="ignore")
def _from_sixtieths(whole: NDArray[np.float64], minutes: NDArray[Any], seconds: NDArray[Any]) -> NDArray[np.float64]:
    """Return degrees or hours (n,) with the sign of the first column, even of -0; NaN for impossible values."""
    possible = (minutes >= 0) & (minutes < 60) & (seconds >= 0) & (seconds <= 60) & (whole == np.rint(whole))
    value = np.copysign(np.abs(whole) + minutes / 60 + seconds / 3600, whole)
    return np.where(possible, value, np.nan)
