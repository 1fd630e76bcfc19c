"""Inertial Explorer's exports as they are in the field: other names, names cut off, and what is no export."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import RawDataError
from tests.support.files.ie_files import (
    HEADER,
    LAYOUTS,
    QUALITY,
    WEEK_SECONDS,
    Columns,
    dms,
    export,
)
from tests.support.files.ie_truth import DAY_S, NS, POSE, ROWS, has_times, poses_are, read, rows_of_day


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.txt"


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


def test_layouts_do_not_depend_on_the_letters_case(file: Path) -> None:
    file.write_bytes(export(LAYOUTS["degrees"], ROWS).replace(b"GPSTime", b"GPSTIME").replace(b"(deg)", b"(Deg)"))
    has_times(read(file)[0], ROWS)


# --- what an export is not ------------------------------------------------------------------------------------------
PLAIN: Columns = {**WEEK_SECONDS, **POSE}


def test_two_exports_in_one_file(file: Path) -> None:
    """The second has roll and pitch in another order: its rows would be read by the first one's names."""
    turned = {name: PLAIN[name] for name in sorted(PLAIN, key=lambda name: (name == "Roll", name == "Heading"))}
    file.write_bytes(export(PLAIN, rows_of_day(1)) + export(turned, rows_of_day(2)))
    with pytest.raises(RawDataError, match=r"a\.txt: has a second line of column names.*a file of its own"):
        read(file)


@pytest.mark.parametrize("end", [b"latitude" * 20_000, b"Latitude at the end", b"\nLATITUDE\n"])
def test_a_word_of_the_names_below_them_is_no_second_header(end: bytes, file: Path) -> None:
    file.write_bytes(export(PLAIN, rows_of_day(1)) + end)
    found, _ = read(file)
    assert len(found["t_ns"]) == len(rows_of_day(1))


def test_decimal_commas_between_blanks(file: Path) -> None:
    content = export(PLAIN, rows_of_day(1), header="")
    file.write_bytes(content.replace(b".", b","))
    with pytest.raises(RawDataError, match=r"a\.txt: its numbers have commas in place of decimal points; exp") as error:
        read(file)
    assert "\n" not in str(error.value)


def test_letters_of_hemispheres(file: Path) -> None:
    signed = dict(PLAIN) | {"Latitude": ("(deg)", lambda row: f"{abs(row.latitude):.10f}S")}
    file.write_bytes(export(signed, rows_of_day(1)))
    with pytest.raises(RawDataError, match=r"a\.txt: its first row has a word where a number should be; exp"):
        read(file)


def test_text_in_utf_16(file: Path) -> None:
    file.write_bytes(export(PLAIN, rows_of_day(1)).decode("latin-1").encode("utf-16"))
    with pytest.raises(RawDataError, match=r"a\.txt: is a text in UTF-16, not inertial_explorer; save it as UTF-8"):
        read(file)
