"""Inertial Explorer's exports as they are in the field: other names of columns, names twice, times in other forms."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import PoolcalError, RawDataError
from tests.support.files import build
from tests.support.files.ie_files import (
    ATTITUDE,
    DEGREES,
    HEADER,
    HEIGHT,
    LAYOUTS,
    QUALITY,
    WEEK,
    WEEK_SECONDS,
    Columns,
    Row,
    dms,
    export,
    truth,
)

NS = 1_000_000_000
DAY_S = 86_400
WEEK_NS = 7 * DAY_S * NS
ROWS = truth()
POSE: Columns = {**DEGREES, **HEIGHT, **ATTITUDE}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.txt"


def read(path: Path, **more: Any) -> tuple[dict[str, np.ndarray], dict[str, int]]:
    return build.read("ins", path, "inertial_explorer", **more)


def on(day: int, count: int = 60) -> list[Row]:
    """Rows from ten o'clock GPS of a day of the week: 0 is Sunday."""
    return [Row(**{**vars(row), "seconds": day * DAY_S + 36_000 + k / 10}) for k, row in enumerate(ROWS[:count])]


def gps(row: Row) -> datetime:
    start = datetime(1980, 1, 6, tzinfo=UTC) + timedelta(weeks=WEEK)
    return start + timedelta(milliseconds=round(1000 * row.seconds))


def has_times(found: dict[str, np.ndarray], given: list[Row]) -> None:
    assert found["t_ns"].tolist() == [WEEK * WEEK_NS + round(row.seconds * 10) * NS // 10 for row in given]


def poses_are(found: dict[str, np.ndarray], given: list[Row]) -> None:
    for name in ("latitude", "longitude"):
        assert found[f"{name}_rad"] == pytest.approx(np.radians([getattr(row, name) for row in given]), abs=2e-12), name
    for name, column in (("roll", "roll_rad"), ("pitch", "pitch_rad"), ("heading", "azimuth_rad")):
        apart = found[column] - np.radians([getattr(row, name) for row in given])
        assert np.exp(1j * apart) == pytest.approx(np.ones(len(given)), abs=2e-8), name
    assert found["height_m"] == pytest.approx([row.height for row in given], abs=1e-3)


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
    given = [Row(**{**vars(row), "seconds": row.seconds - 73 * DAY_S}) for row in on(3)]
    columns = {time: ("(sec)", show), "Date": (unit, lambda row: f"{gps(row):{form}}"), **POSE}
    file.write_bytes(export(columns, given))
    found, dropped = read(file)
    assert not dropped
    has_times(found, given)
    poses_are(found, given)


def test_as_written_in_antarctica(file: Path) -> None:
    """A profile with CorrTime, Date and separations, D M S; the rows lie over a Saturday of January 2010."""
    file.write_text(
        " CorrTime       Date         Latitude        Longitude        H-Ell        Heading        HdngSep       HdngSD"
        "          Pitch           Roll\n"
        "    (sec)      (MDY)       (+/-D M S)       (+/-D M S)          (m)          (Deg)          (Deg)        (Deg)"
        "          (Deg)          (Deg)\n"
        "598861.01  1/02/2010  -79 28 10.85149 -112 03 17.05073     1765.359  51.2305580000 359.9682999998 0.0198516510"
        "  -1.2856740000   0.0289810000\n"
    )
    found, _ = read(file)
    moment = datetime(2010, 1, 2, tzinfo=UTC) + timedelta(seconds=598_861.01 - 6 * DAY_S)
    hundredths = round((moment - datetime(1980, 1, 6, tzinfo=UTC)).total_seconds() * 100)
    assert found["t_ns"].tolist() == [hundredths * NS // 100]
    assert np.degrees(found["azimuth_rad"]) == pytest.approx([51.230558])
    assert np.degrees(found["pitch_rad"]) == pytest.approx([-1.285674])
    assert np.degrees(found["latitude_rad"]) == pytest.approx([-(79 + 28 / 60 + 10.85149 / 3600)])


def test_a_date_and_seconds_of_the_week_that_contradict_each_other(file: Path) -> None:
    """As at the end of a week, where a date runs on: such rows are left out, under their own reason."""
    given = on(3)
    wrong = given[20]
    date = ("(MDY)", lambda row: f"{gps(row) + timedelta(days=row is wrong):%m/%d/%Y}")
    file.write_bytes(export({"GPSTime": ("(sec)", OF_WEEK), "Date": date, **POSE}, given))
    found, dropped = read(file)
    has_times(found, [row for row in given if row is not wrong])
    assert dropped == {"date and seconds of the week that contradict each other": 1}


def test_project_name_is_one_column(file: Path) -> None:
    """It has no unit, as SeqNum and Q have none; Chinese letters are no reason to lose a row."""
    columns = {
        "SeqNum": ("", lambda row: "7"), **WEEK_SECONDS, **POSE, "Project Name": ("", lambda row: "20180711"), **QUALITY
    }  # fmt: skip
    file.write_bytes(export(columns, ROWS).replace(b"20180711", "20180711\u4eac".encode("gbk")))
    found, dropped = read(file)
    assert not dropped
    has_times(found, ROWS)
    poses_are(found, ROWS)


def test_names_cut_off_by_their_column(file: Path) -> None:
    """H-El and Rol; RollSD is written in full, HdngS could be HdngSD or HdngSep and is not taken."""
    given = {("H-El" if name == "H-Ell" else "Rol" if name == "Roll" else name): one for name, one in POSE.items()}
    columns = {**WEEK_SECONDS, **given, "RollSD": ("(deg)", lambda row: "0.01"), "HdngS": ("(deg)", lambda row: "9.9")}
    file.write_bytes(export(columns, ROWS))
    found, dropped = read(file)
    assert not dropped
    poses_are(found, ROWS)


@pytest.mark.parametrize("cut", ["Ro", "R"])
def test_names_cut_too_short_are_not_guessed(cut: str, file: Path) -> None:
    columns = {**WEEK_SECONDS, **{(cut if name == "Roll" else name): one for name, one in POSE.items()}}
    file.write_bytes(export(columns, ROWS))
    with pytest.raises(RawDataError, match="has no column Roll"):
        read(file)


def test_time_in_three_columns_of_cut_names(file: Path) -> None:
    """A mobile laser and multibeam system's profile, written by hand as it stands there."""
    head = (
        "UTCDate     UT UT UTCTim       Latitude        Longitude         H-Ell         X-ECEF        SDX-ECEF       "
        "Roll       RollSD      Pitch      PitchSD      Heading     HdngSD     Q        Heave\n"
        "(MDY)       ho mi  (sec)      (+/-D M S)       (+/-D M S)         (m)           (m)             (m)           "
        "(deg)       (deg)      (deg)       (deg)        (deg)      (deg)                (m)\n"
    )
    lines = [
        f"{row.utc:%m/%d/%Y  %H %M %S}.{row.utc.microsecond // 1000:03d}   {dms(row.latitude)} {dms(row.longitude)}   "
        f"{row.height:.6f} 1.0 0.1 {row.roll:.6f} 0.01 {row.pitch:.6f} 0.02 {(row.heading + 180) % 360 - 180:.6f} 0.03 "
        "1 0.0\n"
        for row in ROWS
    ]
    file.write_bytes((HEADER + head + "".join(lines)).encode("latin-1"))
    found, dropped = read(file)
    assert not dropped
    has_times(found, ROWS)
    assert np.degrees(found["roll_rad"]) == pytest.approx([row.roll for row in ROWS], abs=1e-6)
    assert np.degrees(found["azimuth_rad"]) == pytest.approx([row.heading for row in ROWS], abs=1e-6)


def test_hours_and_minutes_in_units_that_are_not_known(file: Path) -> None:
    """The seconds alone would be a time within one minute."""
    parts: Columns = {
        "UTCDate": ("(MDY)", lambda row: f"{row.utc:%m/%d/%Y}"), "UT": ("(turns)", lambda row: f"{row.utc:%H}"),
        "UTCTime": ("(sec)", lambda row: f"{row.utc:%S}.0"),
    }  # fmt: skip
    text = export({**parts, **POSE}, ROWS).replace(b"  UT ", b"UT UT").replace(b"(turns)", b"(tu) tu")
    file.write_bytes(text)
    with pytest.raises(RawDataError):
        read(file)


def test_units_that_can_be_read_in_two_ways(file: Path) -> None:
    """Q would have a unit by place; by count none has moved."""
    text = export({**WEEK_SECONDS, **POSE, **QUALITY, "Heave": ("(m)", lambda row: "0.1")}, ROWS[:20]).decode("latin-1")
    names = next(line for line in text.splitlines() if "Latitude" in line)
    units = next(line for line in text.splitlines() if "(weeks)" in line)
    moved = units.replace("(weeks)", " " * 7)  # Week has none; one unit more stands under Q
    at = names.index(" Q") + 1
    moved = moved[: at - 2] + "(m)" + moved[at + 1 :]
    file.write_bytes(text.replace(units, moved).encode("latin-1"))
    with pytest.raises(RawDataError, match=r"a\.txt: its units can be read in two ways: column Week"):
        read(file)


def test_colons_between_degrees_minutes_and_seconds(file: Path) -> None:
    """Only where the rows do not fit without: a column of a time that is not read may have colons as well."""
    colons: Columns = {
        "Latitude": ("(D:M:S)", lambda row: dms(row.latitude).replace(" ", ":")),
        "Longitude": ("(D:M:S)", lambda row: dms(row.longitude).replace(" ", ":")),
    }
    file.write_bytes(export({**WEEK_SECONDS, **POSE, **colons}, ROWS))
    found, dropped = read(file)
    assert not dropped
    poses_are(found, ROWS)
    file.write_bytes(export({**LAYOUTS["sixtieths"], "LocTim": ("", lambda row: "12:30:00")}, ROWS))
    found, dropped = read(file)
    assert not dropped
    poses_are(found, ROWS)


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
    file.write_bytes(export(twice(("(sec)", OF_WEEK), other), on(3)))
    with pytest.raises(RawDataError, match=r"a\.txt: has column GPSTime twice, .* differ by 18.00 s.*take one"):
        read(file, gps_week=WEEK)


def test_one_row_whose_times_contradict_each_other(file: Path) -> None:
    given = on(3)
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
    file.write_bytes(export({**WEEKS, **WITNESSES[witness], **POSE}, on(day)))
    found, dropped = read(file)
    assert not dropped
    has_times(found, on(day))


@pytest.mark.parametrize("witness", WITNESSES)
def test_seconds_of_the_week_beside_the_same_columns(witness: str, file: Path) -> None:
    file.write_bytes(export({**WEEKS, "GPSTime": ("(sec)", OF_WEEK), **WITNESSES[witness], **POSE}, on(3)))
    found, dropped = read(file)
    assert not dropped
    has_times(found, on(3))


def unix(row: Row) -> str:
    return f"{row.utc.timestamp():.3f}"


@pytest.mark.parametrize("show", [unix, lambda row: f"{row.of_week - 18:.3f}"])
def test_seconds_of_the_day_by_utc_time_alone(show: Callable[[Row], str], file: Path) -> None:
    file.write_bytes(export({**WEEKS, "UTCTime": ("(sec)", show), **POSE}, on(3)))
    with pytest.raises(RawDataError, match=r"a\.txt: GPSTime is in seconds of the day: .*export GPSTime in seconds"):
        read(file)
    file.write_bytes(export({**WEEKS, "UTCTime": ("(sec)", show), **POSE}, on(0)))
    has_times(read(file)[0], on(0))


def test_a_sunday_that_nothing_else_tells_of(file: Path) -> None:
    """What Week says is taken: on a Sunday it is the truth, and ``poolcal check`` sees where it is not."""
    file.write_bytes(export({**WEEKS, **POSE}, on(0)))
    has_times(read(file)[0], on(0))


@pytest.mark.parametrize("day", ["7", "-1", "2.5"])
def test_days_of_the_week_that_cannot_be(day: str, file: Path) -> None:
    given = on(3)
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
    good = export(DAMAGED[what], on(3, 30), commas, header="").replace(b"GPSTime.1", b"  GPSTime")
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


def test_layouts_do_not_depend_on_the_letters_case(file: Path) -> None:
    file.write_bytes(export(LAYOUTS["degrees"], ROWS).replace(b"GPSTime", b"GPSTIME").replace(b"(deg)", b"(Deg)"))
    has_times(read(file)[0], ROWS)


# --- what an export is not ------------------------------------------------------------------------------------------
PLAIN: Columns = {**WEEK_SECONDS, **POSE}


def test_two_exports_in_one_file(file: Path) -> None:
    """The second has roll and pitch in another order: its rows would be read by the first one's names."""
    turned = {name: PLAIN[name] for name in sorted(PLAIN, key=lambda name: (name == "Roll", name == "Heading"))}
    file.write_bytes(export(PLAIN, on(1)) + export(turned, on(2)))
    with pytest.raises(RawDataError, match=r"a\.txt: has a second line of column names.*a file of its own"):
        read(file)


@pytest.mark.parametrize("end", [b"latitude" * 20_000, b"Latitude at the end", b"\nLATITUDE\n"])
def test_a_word_of_the_names_below_them_is_no_second_header(end: bytes, file: Path) -> None:
    file.write_bytes(export(PLAIN, on(1)) + end)
    found, _ = read(file)
    assert len(found["t_ns"]) == len(on(1))


def test_decimal_commas_between_blanks(file: Path) -> None:
    content = export(PLAIN, on(1), header="")
    file.write_bytes(content.replace(b".", b","))
    with pytest.raises(RawDataError, match=r"a\.txt: its numbers have commas in place of decimal points; exp") as error:
        read(file)
    assert "\n" not in str(error.value)


def test_letters_of_hemispheres(file: Path) -> None:
    signed = dict(PLAIN) | {"Latitude": ("(deg)", lambda row: f"{abs(row.latitude):.10f}S")}
    file.write_bytes(export(signed, on(1)))
    with pytest.raises(RawDataError, match=r"a\.txt: its first row has a word where a number should be; exp"):
        read(file)


def test_text_in_utf_16(file: Path) -> None:
    file.write_bytes(export(PLAIN, on(1)).decode("latin-1").encode("utf-16"))
    with pytest.raises(RawDataError, match=r"a\.txt: is a text in UTF-16, not inertial_explorer; save it as UTF-8"):
        read(file)
