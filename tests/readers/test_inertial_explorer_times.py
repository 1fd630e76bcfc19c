"""Times of Inertial Explorer's exports in the field: two columns of time, seconds of the day, a date."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import PoolcalError, RawDataError
from tests.support.files.ie_files import (
    QUALITY,
    WEEK,
    WEEK_SECONDS,
    Columns,
    Row,
    export,
)
from tests.support.files.ie_truth import DAY_S, POSE, ROWS, has_times, poses_are, read, rows_of_day


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.txt"


def gps(row: Row) -> datetime:
    start = datetime(1980, 1, 6, tzinfo=UTC) + timedelta(weeks=WEEK)
    return start + timedelta(milliseconds=round(1000 * row.seconds))


DATE = ("(MDY)", lambda row: f"{gps(row):%m/%d/%Y}")
OF_WEEK = WEEK_SECONDS["GPSTime"][1]


def of_day(row: Row) -> str:
    return f"{row.seconds % DAY_S:.3f}"


def hms(row: Row) -> str:
    return f"{gps(row):%H:%M:%S}.{gps(row).microsecond // 1000:03d}"


# --- other names -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("time", ["GPSTime", "CorrTime"])
@pytest.mark.parametrize(
    ("unit", "form"), [("(MDY)", "%m/%d/%Y"), ("(DMY)", "%d/%m/%Y"), ("(YMD)", "%Y/%m/%d"), ("", "%Y/%m/%d")]
)
@pytest.mark.parametrize("show", [OF_WEEK, of_day])
def test_date_beside_the_time(time: str, unit: str, form: str, show: Callable[[Row], str], file: Path) -> None:
    """Wednesday, fifth of March or third of May: the unit alone tells."""
    given = [Row(**{**vars(row), "seconds": row.seconds - 73 * DAY_S}) for row in rows_of_day(3)]
    columns = {time: ("(sec)", show), "Date": (unit, lambda row: f"{gps(row):{form}}"), **POSE}
    file.write_bytes(export(columns, given))
    found, dropped = read(file)
    assert not dropped
    has_times(found, given)
    poses_are(found, given)


def test_a_date_and_seconds_of_the_week_that_contradict_each_other(file: Path) -> None:
    """As at the end of a week, where a date runs on: such rows are left out, under their own reason."""
    given = rows_of_day(3)
    wrong = given[20]
    date = ("(MDY)", lambda row: f"{gps(row) + timedelta(days=row is wrong):%m/%d/%Y}")
    file.write_bytes(export({"GPSTime": ("(sec)", OF_WEEK), "Date": date, **POSE}, given))
    found, dropped = read(file)
    has_times(found, [row for row in given if row is not wrong])
    assert dropped == {"date and seconds of the week that contradict each other": 1}


# --- a time twice ----------------------------------------------------------------------------------------------------
def twice(first: tuple[str, Callable[[Row], str]], second: tuple[str, Callable[[Row], str]]) -> Columns:
    return {"GPSTime": first, "GPSTime.1": second, **POSE, "AmbStatus": ("", lambda row: "Fixed"), **QUALITY}


@pytest.mark.parametrize("day", [0, 3])
@pytest.mark.parametrize("commas", [True, False])
@pytest.mark.parametrize(
    ("first", "second"),
    [(("(sec)", OF_WEEK), ("(sec)", of_day)), (("(sec)", of_day), ("(sec)", OF_WEEK)),
     (("(sec)", OF_WEEK), ("(HMS)", hms)), (("(HMS)", hms), ("(sec)", OF_WEEK))],
)  # fmt: skip
def test_gps_time_of_the_week_and_of_the_day(first: Any, second: Any, commas: bool, day: int, file: Path) -> None:
    """As CHC's trajectory.csv has it; both orders, on Sunday and on Wednesday, over midnight."""
    given = [Row(**{**vars(row), "seconds": (day + 1) * DAY_S - 3 + k / 10}) for k, row in enumerate(ROWS[:60])]
    file.write_bytes(export(twice(first, second), given, commas, header="").replace(b"GPSTime.1", b"  GPSTime"))
    found, dropped = read(file, gps_week=WEEK)
    assert not dropped
    has_times(found, given)
    poses_are(found, given)


def test_gps_times_that_contradict_each_other(file: Path) -> None:
    other = ("(sec)", lambda row: f"{row.seconds % DAY_S + 18:.3f}")
    file.write_bytes(export(twice(("(sec)", OF_WEEK), other), rows_of_day(3)))
    with pytest.raises(RawDataError, match=r"a\.txt: has column GPSTime twice, .* differ by 18.00 s.*take one"):
        read(file, gps_week=WEEK)


def test_one_row_whose_times_contradict_each_other(file: Path) -> None:
    given = rows_of_day(3)
    other = ("(sec)", lambda row: f"{row.seconds % DAY_S + 5 * (row is given[40]):.3f}")
    file.write_bytes(export(twice(("(sec)", OF_WEEK), other), given))
    found, dropped = read(file, gps_week=WEEK)
    has_times(found, given[:40] + given[41:])
    assert dropped == {"two times that contradict each other": 1}


def test_gps_time_is_taken_where_corr_time_stands_beside_it(file: Path) -> None:
    columns = {"CorrTime": ("(sec)", lambda row: f"{row.of_week + 0.001:.3f}"), **WEEK_SECONDS, **POSE}
    file.write_bytes(export(columns, ROWS))
    has_times(read(file)[0], ROWS)


# --- seconds of the day ----------------------------------------------------------------------------------------------
WEEKS: Columns = {"Week": WEEK_SECONDS["Week"], "GPSTime": ("(sec)", of_day)}
WITNESSES: dict[str, Columns] = {
    "date": {"Date": DATE},
    "UTC": {"UTCDate": ("(MDY)", lambda row: f"{row.utc:%m/%d/%Y}"), "UTCTime": ("(HMS)", lambda row: (
        f"{row.utc:%H:%M:%S}.{row.utc.microsecond // 1000:03d}"))},
    "day of the week": {"D": ("d", lambda row: f"{int(row.seconds // DAY_S)}")},
    "Date with the unit d": {"Date": ("d", lambda row: f"{int(row.seconds // DAY_S)}")},
}  # fmt: skip


@pytest.mark.parametrize("day", [0, 3, 6])
@pytest.mark.parametrize("witness", WITNESSES)
def test_seconds_of_the_day_by_another_column(witness: str, day: int, file: Path) -> None:
    """Sunday is a day like others: there the two are the same."""
    file.write_bytes(export({**WEEKS, **WITNESSES[witness], **POSE}, rows_of_day(day)))
    found, dropped = read(file)
    assert not dropped
    has_times(found, rows_of_day(day))


@pytest.mark.parametrize("witness", WITNESSES)
def test_seconds_of_the_week_beside_the_same_columns(witness: str, file: Path) -> None:
    file.write_bytes(export({**WEEKS, "GPSTime": ("(sec)", OF_WEEK), **WITNESSES[witness], **POSE}, rows_of_day(3)))
    found, dropped = read(file)
    assert not dropped
    has_times(found, rows_of_day(3))


def unix(row: Row) -> str:
    return f"{row.utc.timestamp():.3f}"


@pytest.mark.parametrize("show", [unix, lambda row: f"{row.of_week - 18:.3f}"])
def test_seconds_of_the_day_by_utc_time_alone(show: Callable[[Row], str], file: Path) -> None:
    file.write_bytes(export({**WEEKS, "UTCTime": ("(sec)", show), **POSE}, rows_of_day(3)))
    with pytest.raises(RawDataError, match=r"a\.txt: GPSTime is in seconds of the day: .*export GPSTime in seconds"):
        read(file)
    file.write_bytes(export({**WEEKS, "UTCTime": ("(sec)", show), **POSE}, rows_of_day(0)))
    has_times(read(file)[0], rows_of_day(0))


def test_a_sunday_that_nothing_else_tells_of(file: Path) -> None:
    """What Week says is taken: on a Sunday it is the truth, and ``poolcal check`` sees where it is not."""
    file.write_bytes(export({**WEEKS, **POSE}, rows_of_day(0)))
    has_times(read(file)[0], rows_of_day(0))


@pytest.mark.parametrize("day", ["7", "-1", "2.5"])
def test_days_of_the_week_that_cannot_be(day: str, file: Path) -> None:
    given = rows_of_day(3)
    show = ("d", lambda row: day if row is given[9] else "3")
    file.write_bytes(export({**WEEKS, "D": show, **POSE}, given))
    found, dropped = read(file)
    has_times(found, given[:9] + given[10:])
    assert dropped == {"impossible time": 1}


SPLIT: Columns = {
    "UTCDate": ("(MDY)", lambda row: f"{row.utc:%m/%d/%Y}"), "UT": ("ho", lambda row: f"{row.utc:%H}"),
    "UT ": ("mi", lambda row: f"{row.utc:%M}"), "UTCTim": ("(sec)", lambda row: f"{row.utc:%S}.0"),
}  # fmt: skip
DAMAGED: dict[str, Columns] = {
    "twice": twice(("(sec)", of_day), ("(HMS)", hms)),
    "split": {**SPLIT, **POSE},
    **{name: {**WEEKS, **columns, **POSE} for name, columns in WITNESSES.items()},
}


@pytest.mark.parametrize("what", DAMAGED)
@pytest.mark.parametrize("commas", [True, False])
def test_damage_is_refused_or_counted(what: str, commas: bool, file: Path) -> None:
    """Bytes changed in header and rows, and files cut off: rows of one order in time, or one line, nothing else."""
    rng = np.random.default_rng(11)
    good = export(DAMAGED[what], rows_of_day(3, 30), commas, header="").replace(b"GPSTime.1", b"  GPSTime")
    for _ in range(40):
        bad = bytearray(good[: rng.integers(len(good) // 3, len(good) + 1)])
        reach = len(bad) if rng.random() < 0.5 else 300  # half of them in the two lines of names and units
        for place in rng.integers(0, reach, rng.integers(0, 6)):
            bad[place] = rng.choice(list(b"0159 -.,:/()adGPSTimeHMS\n\t\xe4"))
        file.write_bytes(bytes(bad))
        try:
            found, _ = read(file, gps_week=WEEK)
        except PoolcalError as error:
            assert "\n" not in str(error)
        else:
            assert np.all(np.diff(found["t_ns"]) > 0) if found else True
