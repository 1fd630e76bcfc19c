"""Inertial Explorer exports: four layouts of one truth, times, units, sigmas and quality."""

from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import RawDataError
from pipeline.readers.detect import kind_of_bytes
from pipeline.readers.dispatch import raw_parts
from pipeline.readers.file_kind import INERTIAL_EXPLORER
from tests.support.files import build
from tests.support.files.build import rows
from tests.support.files.ie_files import HEADER, LAYOUTS, WEEK, Columns, export, whole
from tests.support.files.ie_truth import NS, ROWS, WEEK_NS, is_truth, more_of, read

SIGMAS = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.txt"


def sigmas(path: Path) -> list[dict[str, np.ndarray]]:
    (part,) = raw_parts("ins", build.settings("ins", [path.name], "inertial_explorer"), path.parent)
    return [dict(one.sigmas) for one in part.chunks() if len(one.sigmas)]


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
