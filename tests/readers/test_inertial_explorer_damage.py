"""Inertial Explorer exports: damaged rows are left out and counted, and what cannot be read is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import ConfigError, RawDataError
from tests.support.files.build import rows
from tests.support.files.ie_files import LAYOUTS, WEEK, Columns, Row, export, whole
from tests.support.files.ie_truth import ROWS, is_truth, more_of, read


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.txt"


# --- damage ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("layout", LAYOUTS)
def test_line_ends_blanks_and_footers(layout: str, file: Path) -> None:
    lines = whole(layout).splitlines()
    lines[40:40] = [b"", b"   \t "]
    text = b"\r\n".join([*lines, b"", b"End of export", b""]) + b"   12 13"
    file.write_bytes(text)
    columns, dropped = read(file, **more_of(layout))
    is_truth(columns)
    assert dropped == {"row with another number of columns": 1, "last line without line end": 1}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_rows_of_another_length_and_words(layout: str, file: Path) -> None:
    lines = whole(layout).splitlines(keepends=True)
    first = len(lines) - len(ROWS)
    cut, word = lines[first + 20], lines[first + 30].replace(b"0.", b"*.")
    lines[first + 20], lines[first + 30] = cut[: len(cut) // 2] + b"\n", word
    file.write_bytes(b"".join(lines))
    columns, dropped = read(file, **more_of(layout))
    is_truth(columns, [row for k, row in enumerate(ROWS) if k not in (20, 30)])
    assert dropped == {"row with another number of columns": 1, "word where a number should be": 1}


def test_last_line_that_was_cut_off(file: Path) -> None:
    file.write_bytes(whole("degrees")[:-1])
    columns, dropped = read(file)
    is_truth(columns, ROWS[:-1])
    assert dropped == {"last line without line end": 1}


@pytest.mark.parametrize(
    ("column", "value"),
    [("Latitude", "91.0000000000"), ("Longitude", "nan"), ("H-Ell", "1e9"), ("Pitch", "90.5"), ("Roll", "-181"),
     ("Heading", "inf"), ("GPSTime", "-1.0"), ("GPSTime", "1e12"), ("Week", "12"), ("Week", "2366.5")],
)  # fmt: skip
def test_impossible_values(column: str, value: str, file: Path) -> None:
    unit, show = LAYOUTS["degrees"][column]
    bad = LAYOUTS["degrees"] | {column: (unit, lambda row: value if row is ROWS[9] else show(row))}
    file.write_bytes(export(bad, ROWS))
    columns, dropped = read(file)
    is_truth(columns, ROWS[:9] + ROWS[10:])
    assert sum(dropped.values()) == 1


@pytest.mark.parametrize("date", ["2/30/2025", "13/01/2025", "0/00/0000", "5/17/25", "5/17/2525"])
def test_impossible_dates(date: str, file: Path) -> None:
    show = LAYOUTS["utc"]["UTCDate"][1]
    layout = LAYOUTS["utc"] | {"UTCDate": ("(MDY)", lambda row: date if row is ROWS[3] else show(row))}
    file.write_bytes(export(layout, ROWS))
    columns, dropped = read(file)
    is_truth(columns, ROWS[:3] + ROWS[4:])
    assert dropped == {"impossible time": 1}


# --- refused ---------------------------------------------------------------------------------------------------------
def without(*names: str, layout: str = "degrees") -> Columns:
    return {name: column for name, column in LAYOUTS[layout].items() if name not in names}


def with_unit(name: str, unit: str, layout: str = "degrees") -> Columns:
    return LAYOUTS[layout] | {name: (unit, LAYOUTS[layout][name][1])}


REFUSED: dict[str, tuple[Columns, str]] = {
    "no heading": (without("Heading") | {"COG": ("(deg)", lambda row: "1.0")}, "has no column Heading .*add it"),
    "no time": (without("GPSTime"), "has no column GPSTime"),
    "UTC without a date": (without("UTCDate", layout="utc"), "has no column GPSTime"),
    "no height": (without("H-Ell"), "has no column H-Ell"),
    "above sea level": (without("Undulation", layout="commas"), "H-MSL, is above sea level; export H-Ell"),
    "undulation alone": (without("H-MSL", layout="commas"), "has no column H-Ell"),
    "feet": (with_unit("H-Ell", "(ft)"), r"column H-Ell has the unit \(ft\); export it as one of m, "),
    "gon": (with_unit("Roll", "(gon)"), r"column Roll has the unit \(gon\)"),
    "sigma in a strange unit": (with_unit("HdngSD", "(mil)", "utc"), r"column HdngSD has the unit \(mil\)"),
    "date without order": (with_unit("UTCDate", "", "utc"), r"UTCDate has no unit to tell the day from .*mdy"),
    "dashes between sixtieths": (with_unit("Latitude", "(D-M-S)"), r"column Latitude has the unit \(d-m-s\)"),
    "hours without a date": (
        LAYOUTS["commas"] | {"GPSTime": ("(HMS)", lambda row: "12:00:00.25")}, "without a date; export GPSDate"
    ),
    "unit of three columns over one": (
        with_unit("Latitude", "(dms)") | {"Longitude": ("(dms)", LAYOUTS["degrees"]["Longitude"][1])},
        r"the units of Latitude \(dms\), Longitude \(dms\) stand for three columns each.*export angles in decimal",
    ),
    "hours over seconds": (with_unit("GPSTime", "(HMS)"), r"the units of GPSTime \(hms\) stand for three columns"),
    "few digits": (LAYOUTS["degrees"] | {"Latitude": ("(deg)", lambda row: f"{row.latitude:.6f}")}, "Latitude.*digits"),
    "few digits of a second": (
        LAYOUTS["degrees"] | {"Latitude": ("(D M S)", lambda row: "-0 30 12.44")}, "Latitude.*more digits"
    ),
    "blank column": (LAYOUTS["degrees"] | {"AmbStatus": ("", lambda row: "")}, "names 10 columns, its first row has 9"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_refused(what: str, file: Path) -> None:
    columns, words = REFUSED[what]
    file.write_bytes(export(columns, ROWS))
    with pytest.raises(RawDataError, match=rf"a\.txt: .*{words}") as error:
        read(file, gps_week=WEEK)
    assert "\n" not in str(error.value)


def test_column_twice(file: Path) -> None:
    file.write_bytes(whole("degrees").replace(b"  Q", b"  Roll").replace(b"Latitude  ", b"Latitude"))
    with pytest.raises(RawDataError, match=r"a\.txt: has column Roll twice; take one out"):
        read(file)


def test_week_is_asked_for(file: Path) -> None:
    file.write_bytes(whole("commas"))
    with pytest.raises(ConfigError, match=r"ins\.gps_week is missing: a\.txt"):
        read(file)


def test_time_that_runs_backwards(file: Path) -> None:
    file.write_bytes(whole("degrees", ROWS[:90][::-1]))
    with pytest.raises(RawDataError, match="backwards in 89 of 90 records"):
        read(file)


def float32(row: Row, *names: str) -> Row:
    return replace(row, **{name: float(np.float32(getattr(row, name))) for name in names})


@pytest.mark.parametrize("layout", ["degrees", "sixtieths"])
def test_positions_of_single_precision(layout: str, file: Path) -> None:
    """However many digits are printed: here ten of a degree, seven of a second of arc."""
    far = [replace(row, longitude=120.0 + row.longitude) for row in ROWS]
    file.write_bytes(whole(layout, far))
    assert rows(read(file)[0]) == 400
    file.write_bytes(whole(layout, [float32(row, "longitude") for row in far]))
    with pytest.raises(RawDataError, match=r"a\.txt: .*float32.*double"):
        read(file)


def test_times_of_single_precision(file: Path) -> None:
    steps = [replace(row, seconds=600_000 + k * 0.0625) for k, row in enumerate(ROWS)]  # in thousandths: 0.062, 0.125
    file.write_bytes(whole("degrees", steps))
    with pytest.raises(RawDataError, match=r"a\.txt: .*float32"):
        read(file)
    file.write_bytes(whole("degrees", [replace(row, seconds=600_000 + k * 0.125) for k, row in enumerate(ROWS)]))
    assert rows(read(file)[0]) == 400


@pytest.mark.parametrize("start_s", [0, 1000, 9000, 33_000, 65_000, 530_000])
def test_times_of_double_precision(start_s: int, file: Path) -> None:
    """Early in the week float32 numbers lie as near together as thousandths."""
    file.write_bytes(whole("degrees", [replace(row, seconds=start_s + k / 200) for k, row in enumerate(ROWS)]))
    assert rows(read(file)[0]) == 400
