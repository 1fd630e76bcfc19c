"""Inertial Explorer exports: four layouts of one truth, what is left out, and what is refused."""

from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.detect import kind_of_bytes
from pipeline.readers.dispatch import raw_parts
from pipeline.readers.file_kind import INERTIAL_EXPLORER
from tests.support.files import build
from tests.support.files.build import rows
from tests.support.files.ie_files import HEADER, LAYOUTS, WEEK, Columns, Row, export, truth, whole

NS = 1_000_000_000
WEEK_NS = 604_800 * NS
SIGMAS = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
ROWS = truth()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.txt"


def read(path: Path, **more: Any) -> tuple[dict[str, np.ndarray], dict[str, int]]:
    return build.read("ins", path, "inertial_explorer", **more)


def more_of(layout: str) -> dict[str, Any]:
    return {"gps_week": WEEK} if layout == "commas" else {}


def sigmas(path: Path) -> list[dict[str, np.ndarray]]:
    (part,) = raw_parts("ins", build.settings("ins", [path.name], "inertial_explorer"), path.parent)
    return [dict(one.sigmas) for one in part.chunks() if len(one.sigmas)]


def is_truth(columns: dict[str, np.ndarray], given: list[Row] = ROWS) -> None:
    assert columns["t_ns"].tolist() == [WEEK * WEEK_NS + round(row.seconds * 10) * NS // 10 for row in given]
    for name in ("latitude", "longitude", "roll", "pitch"):
        expected = np.radians([getattr(row, name) for row in given])
        assert columns[f"{name}_rad"] == pytest.approx(expected, abs=2e-8 if name in ("roll", "pitch") else 2e-12), name
    assert columns["azimuth_rad"] == pytest.approx(np.radians([row.heading for row in given]), abs=2e-8)
    assert columns["height_m"] == pytest.approx([row.height for row in given], abs=1e-3)


# --- layouts ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(layout: str, file: Path) -> None:
    """Over the ends of the GPS week and of UTC's day, 18 seconds apart; just south and west of zero."""
    assert ROWS[0].week != ROWS[-1].week
    assert ROWS[0].utc.day != ROWS[-1].utc.day
    file.write_bytes(whole(layout))
    columns, dropped = read(file, **more_of(layout))
    assert not dropped
    is_truth(columns)


def test_written_out_by_hand(file: Path) -> None:
    """Columns as real profiles have them; the unit stands under its name, and Q has none."""
    file.write_text(
        "    UTCTime       Week   GPSTime       Latitude        Longitude    H-Ell           Roll        Heading Q"
        "          Pitch\n"
        "      (sec)    (weeks)     (sec)     (+/-D M S)       (+/-D M S)      (m)          (deg)          (deg)  "
        "          (deg)\n"
        " 1621578524 2158.00000 455342.00 22 18 05.61075 -114 11 25.11071    2.894  -0.2074966655 -59.3645242579 2"
        "  -0.6303452479\n"
    )
    columns, dropped = read(file)
    assert not dropped
    assert columns["t_ns"].tolist() == [2158 * WEEK_NS + 455_342 * NS]
    assert np.degrees(columns["latitude_rad"][0]) == pytest.approx(22.301558542, abs=1e-9)
    assert np.degrees(columns["longitude_rad"][0]) == pytest.approx(-114.190308531, abs=1e-9)
    assert np.degrees(columns["roll_rad"][0]) == pytest.approx(-0.2074966655)
    assert np.degrees(columns["pitch_rad"][0]) == pytest.approx(-0.6303452479)
    assert np.degrees(columns["azimuth_rad"][0]) == pytest.approx(300.6354757421)


@pytest.mark.parametrize("layout", ["degrees", "sixtieths", "commas"])
def test_without_units(layout: str, file: Path) -> None:
    file.write_bytes(export(LAYOUTS[layout], ROWS, layout == "commas", units=False))
    columns, _ = read(file, **more_of(layout))
    is_truth(columns)


@pytest.mark.parametrize(
    ("unit", "form"), [("(DMY)", "%d/%m/%Y"), ("(YMD)", "%Y/%m/%d"), ("(MDY)", "%m/%d/%Y"), ("", "%Y/%m/%d")]
)
def test_dates(unit: str, form: str, file: Path) -> None:
    layout = LAYOUTS["utc"] | {"UTCDate": (unit, lambda row: row.utc.strftime(form))}
    file.write_bytes(export(layout, ROWS))
    is_truth(read(file)[0])


TIMES: dict[str, Columns] = {
    "of the day": {"UTCTime": ("(sec)", lambda row: f"{row.utc.hour * 3600 + row.utc.minute * 60 + row.utc.second}."
                               f"{row.utc.microsecond // 1000:03d}")},
    "of the week": {"UTCTime": ("(sec)", lambda row: f"{(row.seconds - 18) % 604_800:.3f}")},
    "three columns": {"UTCTime": ("(HMS)", lambda row: f"{row.utc:%H %M %S}.{row.utc.microsecond // 1000:03d}")},
    "GPS": {
        "UTCDate": ("(MDY)", lambda row: row.utc.strftime("%m/%d/%Y")),
        "UTCTime": ("(sec)", lambda row: "12345.0"),
        "GPSDate": ("(YMD)", lambda row: (row.utc + timedelta(seconds=18)).strftime("%Y/%m/%d")),
        "GPSTime": ("(sec)", lambda row: f"{row.of_week:.3f}"),
    },
}  # fmt: skip


@pytest.mark.parametrize("how", TIMES)
def test_times_beside_a_date(how: str, file: Path) -> None:
    file.write_bytes(export({**LAYOUTS["utc"], **TIMES[how]}, ROWS))
    is_truth(read(file)[0])


def test_before_the_last_leap_second(file: Path) -> None:
    """2016-12-31: GPS ran 17 s ahead of UTC."""
    layout = LAYOUTS["utc"] | {
        "UTCDate": ("(MDY)", lambda row: "12/31/2016"), "UTCTime": ("(HMS)", lambda row: "12:00:00.250")
    }  # fmt: skip
    file.write_bytes(export(layout, ROWS[:1]))
    assert read(file)[0]["t_ns"].tolist() == [(1_483_185_600 - 315_964_800 + 17) * NS + NS // 4]


def test_angles_in_radians_and_heights_in_centimetres(file: Path) -> None:
    layout = LAYOUTS["degrees"] | {
        "Roll": ("(rad)", lambda row: f"{np.radians(row.roll):+.9f}"),
        "H-Ell": ("(cm)", lambda row: f"{100 * row.height:+}"),
    }
    file.write_bytes(export(layout, ROWS))
    is_truth(read(file)[0])


@pytest.mark.parametrize("latency_s", [0.01, -0.2])
def test_latency_is_taken_off(latency_s: float, file: Path) -> None:
    file.write_bytes(whole("degrees"))
    columns, _ = read(file, latency_s=latency_s)
    assert columns["t_ns"][0] == WEEK * WEEK_NS + 604_790 * NS - round(latency_s * NS)


def test_second_file_a_week_later(tmp_path: Path) -> None:
    """ins.gps_week is that of the first file; the second begins after the week's end."""
    for name, given in (("a.txt", ROWS[:50]), ("b.txt", ROWS[150:])):
        (tmp_path / name).write_bytes(whole("commas", given))
    settings = build.settings("ins", ["*.txt"], "inertial_explorer", gps_week=WEEK)
    times = [t for part in raw_parts("ins", settings, tmp_path) for one in part.chunks() for t in one.columns["t_ns"]]
    assert (np.array(times) - WEEK * WEEK_NS)[[0, 49, 50, -1]].tolist() == [
        round(ROWS[k].seconds * 10) * NS // 10 for k in (0, 49, 150, 399)
    ]


# --- sigmas and quality ----------------------------------------------------------------------------------------------
def test_sigmas(file: Path) -> None:
    file.write_bytes(whole("utc"))
    (told,) = sigmas(file)
    assert told["t_ns"].tolist() == [WEEK * WEEK_NS + round(row.seconds * 10) * NS // 10 for row in ROWS]
    for name, value in zip(SIGMAS, (0.012, 0.016, 0.025, 0.006, 0.008, 0.03), strict=True):
        assert told[name] == pytest.approx(np.full(400, value)), name


def test_sigmas_that_are_not_all_there(file: Path) -> None:
    file.write_bytes(export({name: one for name, one in LAYOUTS["utc"].items() if name != "SDHeight"}, ROWS))
    (told,) = sigmas(file)
    assert np.all(np.isnan(told["up_m"]))
    assert told["heading_deg"] == pytest.approx(np.full(400, 0.03))
    file.write_bytes(whole("degrees"))
    assert sigmas(file) == []


@pytest.mark.parametrize("value", ["0.000", "-0.010", "10.001", "nan"])
def test_impossible_sigmas_cost_no_pose(value: str, file: Path) -> None:
    layout = LAYOUTS["utc"] | {"SDEast": ("(m)", lambda row: value if row is ROWS[7] else "0.016")}
    file.write_bytes(export(layout, ROWS))
    columns, dropped = read(file)
    is_truth(columns)
    assert dropped == {"impossible accuracy": 1}
    assert len(sigmas(file)[0]["t_ns"]) == 399


@pytest.mark.parametrize(("quality", "kept"), [(1, 1), (2, 1), (3, 1), (4, 0), (6, 0), (0, 0)])
def test_quality(quality: int, kept: int, file: Path) -> None:
    file.write_bytes(export(LAYOUTS["degrees"] | {"Q": ("", lambda row: f"{quality if row is ROWS[5] else 1}")}, ROWS))
    columns, dropped = read(file)
    assert rows(columns) == 399 + kept
    assert dropped == ({} if kept else {f"quality Q {quality}": 1})


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


# --- what kind it is -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("layout", LAYOUTS)
def test_recognised_by_content(layout: str) -> None:
    """With umlauts of Latin-1 or of UTF-8, with and without the free lines."""
    text = whole(layout)
    for content in (text, text.decode("latin-1").encode(), b"\xef\xbb\xbf" + text[len(HEADER) :]):
        assert kind_of_bytes(content, len(content)) is INERTIAL_EXPLORER
    assert kind_of_bytes(text[: len(HEADER)], len(HEADER)) is not INERTIAL_EXPLORER


def test_wrong_format_in_session_yaml(file: Path) -> None:
    file.write_bytes(whole("degrees"))
    with pytest.raises(RawDataError, match=r"an Inertial Explorer export.*write ins\.format: inertial_explorer"):
        build.read("ins", file, "novatel")
    file.write_bytes(build.sbet(1.0, 2.0))
    with pytest.raises(RawDataError, match=r"is SBET, but session\.yaml has ins\.format: inertial_explorer"):
        read(file)


def test_chunks_are_of_bounded_size(file: Path) -> None:
    many = [replace(ROWS[0], seconds=1000 + k / 200) for k in range(60_000)]
    file.write_bytes(whole("degrees", many))
    (part,) = raw_parts("ins", build.settings("ins", ["a.txt"], "inertial_explorer"), file.parent)
    lengths = [len(one.columns["t_ns"]) for one in part.chunks()]
    assert sum(lengths) == 60_000
    assert max(lengths) < 60_000
