"""Every format on a real file, against figures that other programs gave for it."""

import struct
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, GPS_EPOCH_UNIX_S, NS, WEEK_NS
from pipeline.readers import detect, file_kind
from tests.real.conftest import Read
from tests.real.test_kongsberg_all import HE, TURBEAMS
from tests.real.test_more_formats import BUNNY, GSF, KMALL, MOVED

XTF = "mbes/r2sonic2026_qinsy.xtf"
PPP, PPP_ASCII = "ins/propak6-ins-ppp_payload.gps", "ins/propak6-ins-ppp_INSPVAXA.asc"
ATLANS = "ins/sbet_ATLANS-20181023.out"
INS = ("t_ns", "latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")
SIGMAS = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
XYZ = ("x_m", "y_m", "z_m")
NO_INS_RECORDS = {"ins status INS_ALIGNING": 1988}


def one_line(error: pytest.ExceptionInfo[Any], *words: str) -> None:
    message = str(error.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


# --- sonar -----------------------------------------------------------------------------------------------------------
# ping, Unix seconds, nanoseconds, sound speed, then two-way time and angle of beams 0, 127 and 255
FIRST_VALUES = (
    (
        151989, 1436399535, 920431109, 1514.9620361328125,
        0.030901499383617193, -1.0740883350372314, 0.014173559204209596, -0.07949803337578487,
        0.028454348794184625, 1.0816686945536276,
    ),
    (
        152450, 1436399559, 970821409, 1515.0269775390625,
        0.030415132991038263, -1.0749220848083496, 0.013897823926527053, -0.10201847905159411,
        0.027324600087013096, 1.0808358542777796,
    ),
    (
        152911, 1436399584, 21213199, 1514.9429931640625,
        0.030342369514983147, -1.0790804624557495, 0.013526347232982516, -0.11612870446788293,
        0.026895678543951362, 1.0766772052843407,
    ),
)  # fmt: skip


def test_r2sonic_in_xtf(read: Read) -> None:
    soundings, dropped = read("mbes", "r2sonic", XTF)
    no_detection = dropped.pop("no detection", 0)
    assert not dropped
    assert len(soundings["t_ns"]) + no_detection == 923 * 256 == 236_288
    assert np.array_equal(np.unique(soundings["ping"]), np.arange(151989, 152912))
    assert (soundings["beam"].min(), soundings["beam"].max()) == (0, 255)


def test_r2sonic_first_values(read: Read) -> None:
    soundings, _ = read("mbes", "r2sonic", XTF)
    for ping, seconds, nanoseconds, speed, *beams in FIRST_VALUES:
        for beam, time, angle in zip((0, 127, 255), beams[::2], beams[1::2], strict=True):
            (row,) = np.flatnonzero((soundings["ping"] == ping) & (soundings["beam"] == beam))
            assert soundings["t_ns"][row] == (seconds - GPS_EPOCH_UNIX_S + 17) * NS + nanoseconds
            assert soundings["sound_speed_m_s"][row] == speed
            assert soundings["two_way_time_s"][row] == pytest.approx(time, rel=1e-15)
            assert soundings["angle_rad"][row] == pytest.approx(angle, abs=2e-16, rel=1e-15)


def _attitude(content: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Times (GPS, s) and rolls (starboard down +, rad) of the file's own attitude records (XTF type 3)."""
    times, rolls, start = [], [], 1024
    while start + 14 <= len(content):
        if content[start + 2] == 3:
            (roll,) = struct.unpack_from("<f", content, start + 34)
            *moment, milliseconds = struct.unpack_from("<H5BH", content, start + 54)
            times.append(datetime(*moment, tzinfo=UTC).timestamp() - GPS_EPOCH_UNIX_S + 17 + milliseconds / 1000)
            rolls.append(np.radians(roll))
        start += int.from_bytes(content[start + 10 : start + 14], "little")
    return np.array(times), np.array(rolls)


def test_r2sonic_angles_are_not_roll_corrected_and_starboard_is_positive(read: Read, data: Path) -> None:
    """Seen from the rolling array a flat seabed slopes against the roll: slope = -0.993 roll, correlation -0.992."""
    soundings, _ = read("mbes", "r2sonic", XTF)
    times, rolls = _attitude((data / XTF).read_bytes())
    assert len(times) == 1203
    slopes, ping_times = [], []
    for ping in range(151989, 152912):
        rows = soundings["ping"] == ping
        ranges = soundings["two_way_time_s"][rows] * soundings["sound_speed_m_s"][rows] / 2
        angles = soundings["angle_rad"][rows]
        slopes.append(np.polyfit(ranges * np.sin(angles), ranges * np.cos(angles), 1)[0])
        ping_times.append(soundings["t_ns"][rows][0] / NS)
    roll = np.interp(ping_times, times, rolls)
    assert np.corrcoef(roll, slopes)[0, 1] < -0.991
    assert np.polyfit(roll, np.arctan(slopes), 1) == pytest.approx([-0.993, -0.031], abs=0.02)


# --- INS, its own sigmas ---------------------------------------------------------------------------------------------
def test_accuracy_file(read: Read, data: Path, tmp_path: Path) -> None:
    """10,495 records at the times of the SBET; the first roll RMS is 0.165451 arc-minutes."""
    (tmp_path / "x.smr").write_bytes((data / "ins/sbet_ATLANS-20181023-accuracy.out").read_bytes())
    sigmas, dropped = read("ins", "sbet", ATLANS, sigmas=True, gps_week=2024, accuracy=["x.smr"])
    ins, _ = read("ins", "sbet", ATLANS, gps_week=2024)
    assert not dropped
    assert len(sigmas["t_ns"]) == 10_495
    assert np.array_equal(sigmas["t_ns"], ins["t_ns"])
    assert sigmas["roll_deg"][0] == pytest.approx(0.002758, abs=5e-7)
    assert 0.001 < np.median(sigmas["pitch_deg"]) < 0.01
    assert 0.001 < np.median(sigmas["heading_deg"]) < 0.1


def test_novatel_inspvax_sigmas(read: Read) -> None:
    """Binary as ASCII: 2289 records, of a receiver with a precise point positioning that converges."""
    (binary, _), (ascii_, _) = (read("ins", "novatel", name, sigmas=True) for name in (PPP, PPP_ASCII))
    assert binary.keys() == ascii_.keys() == {"t_ns", *SIGMAS}
    for name in SIGMAS:
        assert ascii_[name] == pytest.approx(binary[name], rel=1e-3, abs=1e-4), name
    assert np.array_equal(binary["t_ns"], read("ins", "novatel", PPP)[0]["t_ns"])
    assert np.all(binary["north_m"] < 1)
    assert np.all(binary["roll_deg"] < 1)


# --- INS, NovAtel ----------------------------------------------------------------------------------------------------
def test_novatel_inspvas_chosen_before_inspvax(read: Read) -> None:
    ins, dropped = read("ins", "novatel", "ins/oem7_ins2.gps")
    assert len(ins["t_ns"]) == 62
    assert dropped["INSPVAX beside INSPVAS"] == 6
    assert ins["t_ns"][0] == 2100 * WEEK_NS + 600_118_400 * 1_000_000
    degrees = [51.15044262019306, -114.0306603499871, -0.88260498331797, -0.6894472876067871, 196.29854520104706]
    names = ("latitude_rad", "longitude_rad", "roll_rad", "pitch_rad", "azimuth_rad")
    assert [np.degrees(ins[name][0]) for name in names] == pytest.approx(degrees, rel=1e-14)
    assert ins["height_m"][0] == 1080.7653169166297


def test_novatel_inspvax_height_is_above_sea_level(read: Read, data: Path) -> None:
    """INSPVAX height + undulation = INSPVAS height at the same moment (1097.7656 - 17.0000 = 1080.7656)."""
    both, _ = read("ins", "novatel", "ins/oem7_ins2.gps")
    content = (data / "ins/oem7_ins2.gps").read_bytes()
    extended, _ = read("ins", "novatel", "x.gps", _without_short_headers(content))
    t_ns = 2100 * WEEK_NS + 600_119 * NS
    (there,), (here,) = (np.flatnonzero(columns["t_ns"] == t_ns) for columns in (both, extended))
    assert extended["height_m"][here] == pytest.approx(1097.7656247681007 - 17.0, abs=1e-9)
    for name in INS:
        assert extended[name][here] == both[name][there], name


def _without_short_headers(content: bytes) -> bytes:
    """The log without the records of short header, INSPVAS among them."""
    kept, start = b"", 0
    while start < len(content):
        sync, size = content[start : start + 3], content[start + 3]
        if sync == b"\xaaD\x13":
            start += 12 + size + 4
        else:
            length = size + int.from_bytes(content[start + 8 : start + 10], "little") + 4
            kept += content[start : start + length]
            start += length
    return kept


def test_novatel_binary(read: Read) -> None:
    ins, dropped = read("ins", "novatel", PPP)
    assert len(ins["t_ns"]) == 2289
    assert not dropped
    assert ins["t_ns"][0] == 1820 * WEEK_NS + 160_205_900 * 1_000_000
    assert np.degrees(ins["latitude_rad"][0]) == pytest.approx(43.404089457666146, rel=1e-15)
    assert ins["height_m"][0] == 326.2121383836493 - 36.5
    assert np.degrees(ins["roll_rad"][0]) == pytest.approx(1.047021720756306, rel=1e-14)
    assert np.degrees(ins["azimuth_rad"][0]) == pytest.approx(94.20355038442736, rel=1e-14)


@pytest.mark.parametrize("line_end", [b"\r\n", b"\n"])
def test_novatel_ascii_equals_binary(line_end: bytes, read: Read, data: Path) -> None:
    binary, _ = read("ins", "novatel", PPP)
    text = (data / PPP_ASCII).read_bytes()
    assert b"\r\n" in text
    ascii_, dropped = read("ins", "novatel", PPP_ASCII, text.replace(b"\r\n", line_end))
    assert not dropped
    assert np.array_equal(ascii_["t_ns"], binary["t_ns"])
    for name, digits in zip(INS[1:], (11, 11, 4, 9, 9, 9), strict=True):
        printed = (lambda x: x) if name == "height_m" else np.degrees
        assert np.abs(printed(ascii_[name]) - printed(binary[name])).max() <= 0.51 * 10.0**-digits, name


def test_novatel_while_it_aligns(read: Read) -> None:
    ins, dropped = read("ins", "novatel", "ins/propak6-basic-fix_payload.gps")
    assert all(len(values) == 0 for values in ins.values())
    assert {reason: dropped[reason] for reason in NO_INS_RECORDS} == NO_INS_RECORDS


# --- INS, SBET -------------------------------------------------------------------------------------------------------
def test_sbet_of_pdal(read: Read) -> None:
    ins, dropped = read("ins", "sbet", "ins/pdal_2-points.sbet", gps_week=1800)
    assert not dropped
    assert len(ins["t_ns"]) == 2
    assert ins["t_ns"][0] == 1800 * WEEK_NS + 151_631_002_836_071
    degrees = [32.545149, -116.978180, -1.611964, -1.392233, 174.567247 + 1.259599]
    names = ("latitude_rad", "longitude_rad", "roll_rad", "pitch_rad", "azimuth_rad")
    assert [np.degrees(ins[name][0]) for name in names] == pytest.approx(degrees, abs=1e-4)
    assert ins["height_m"][0] == pytest.approx(107.7152953296560, abs=1e-13)


def test_sbet_of_a_boat(read: Read) -> None:
    ins, dropped = read("ins", "sbet", ATLANS, gps_week=2024)
    assert not dropped
    assert len(ins["t_ns"]) == 10_495
    assert set(np.diff(ins["t_ns"]).tolist()) == {NS // 2}
    assert ins["t_ns"][0] == 2024 * WEEK_NS + 225_092_532_698_500
    assert np.degrees(ins["latitude_rad"][0]) == pytest.approx(46.783019673976, abs=1e-11)
    assert np.degrees(ins["longitude_rad"][0]) == pytest.approx(-71.272710666896, abs=1e-11)
    assert ins["height_m"][0] == pytest.approx(55.886139, abs=1e-6)
    values = [ins[name][0] for name in ("roll_rad", "pitch_rad", "azimuth_rad")]
    assert values == pytest.approx([0.079737922580, 0.012073070456, 4.601874186733], abs=1e-9)


def test_sbet_with_stray_bytes(read: Read) -> None:
    ins, dropped = read("ins", "sbet", "ins/sbet_20181023.out", gps_week=2024)
    first, _ = read("ins", "sbet", ATLANS, gps_week=2024)
    assert sum(dropped.values()) == 2
    for name in INS:
        assert np.array_equal(ins[name], first[name][:1]), name


def test_sbet_cut_off(read: Read) -> None:
    with pytest.raises(RawDataError) as error:
        read("ins", "sbet", "ins/pdal_badfile.sbet", gps_week=1800)
    one_line(error, "pdal_badfile.sbet", "135 bytes", "copy")


def test_sbet_without_week(read: Read) -> None:
    with pytest.raises(ConfigError) as error:
        read("ins", "sbet", ATLANS)
    one_line(error, "ins.gps_week", "GPS week")


# --- laser -----------------------------------------------------------------------------------------------------------
def test_las_of_week_seconds(read: Read) -> None:
    points, dropped = read("laser", "las", "laser/1.2-with-color.las", gps_week=1500)
    assert not dropped
    assert len(points["t_ns"]) == 1065
    assert [points[name][0] for name in XYZ] == pytest.approx([637012.24, 849028.31, 431.66], abs=1e-9)
    assert points["t_ns"][0] == 1500 * WEEK_NS + 245_380_782_549_626


def test_las_of_week_seconds_without_week(read: Read) -> None:
    with pytest.raises(ConfigError) as error:
        read("laser", "las", "laser/1.2-with-color.las")
    one_line(error, "laser.gps_week", "1.2-with-color.las")


def test_las_of_adjusted_time(read: Read) -> None:
    points, dropped = read("laser", "las", "laser/test1_4.las")
    assert not dropped
    assert len(points["t_ns"]) == 1000
    since_ns = int(points["t_ns"][0]) - ADJUSTED_STANDARD_OFFSET_S * NS
    assert since_ns == pytest.approx(83177420.53400505 * NS, abs=20)
    assert [points[name][0] for name in XYZ] == pytest.approx(
        [1694510.3869346841, 1816497.966263977, 5598.3596128149675], abs=1e-9
    )


def test_las_of_adjusted_time_without_its_flag(read: Read) -> None:
    """14,408 points; laspy's times and places. Without the key the refusal names it."""
    name = "laser/pdal/pdal_sample_c.las"
    for more in ({}, {"gps_week": 1500}):
        with pytest.raises(RawDataError) as error:
            read("laser", "las", name, **more)
        one_line(error, "pdal_sample_c.las", "laser.time: adjusted_standard")
    points, dropped = read("laser", "las", name, time="adjusted_standard")
    assert not dropped
    assert len(points["t_ns"]) == 14_408
    assert points["t_ns"].min() - ADJUSTED_STANDARD_OFFSET_S * NS == pytest.approx(159_214_261.5561611 * NS, abs=200)
    assert [points[name][0] for name in XYZ] == pytest.approx([674_522.0, 1_206_771.75, 627.59], abs=1e-4)
    with pytest.raises(RawDataError) as error:
        read("laser", "las", name, time="seconds_of_week", gps_week=1500)
    one_line(error, "pdal_sample_c.las", "laser.time: seconds_of_week", "159214342")


def test_laz(read: Read) -> None:
    points, dropped = read("laser", "las", "laser/laspy_fullwave.laz", gps_week=2000)
    assert not dropped
    assert len(points["t_ns"]) == 10_750
    first, last = points["t_ns"].min() - 2000 * WEEK_NS, points["t_ns"].max() - 2000 * WEEK_NS
    assert (first, last) == (417_218_090_871_000, 417_219_079_417_000)
    assert [points[name][0] for name in XYZ] == pytest.approx([194288.587, 8249135.677, 994.355], abs=1e-6)


# --- refused by what they hold ---------------------------------------------------------------------------------------
REFUSED = {
    "laser/riegl_130501_232206_cut.rxp": ("RIEGL .rxp", "export it to LAS"),
    "laser/autzen-utm.pcd": ("PCD", "export it to LAS"),
    "ins/sbet_ATLANS-20181023-accuracy.out": ("accurac", "give the SBET"),
    "georeferencing/PortDeQuebec_Sphere1_passage_1.txt": ("text", "README.md"),
    "georeferencing/q_25_passage_1_sphere1.bin": ("of no kind that is read", "README.md"),
    "georeferencing/q_25_passage_1_sphere2.bin": ("of no kind that is read", "README.md"),
    "georeferencing/q_25_passage_1_target1.bin": ("of no kind that is read", "README.md"),
    "georeferencing/q_25_passage_2_sphere1.bin": ("of no kind that is read", "README.md"),
    "georeferencing/q_25_passage_2_sphere2.bin": ("of no kind that is read", "README.md"),
    "georeferencing/q_25_passage_2_target1.bin": ("of no kind that is read", "README.md"),
}
FORMATS = {
    "laser": ("las", "e57", "table"),
    "mbes": ("r2sonic", "gsf", "kmall", "all", "table"),
    "ins": ("novatel", "sbet", "inertial_explorer", "table"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_advice(name: str, read: Read) -> None:
    """Whatever session.yaml says they are."""
    for sensor, formats in FORMATS.items():
        for kind in formats:
            with pytest.raises(RawDataError) as error:
                read(sensor, kind, name, gps_week=2000) if sensor != "mbes" else read(sensor, kind, name)
            one_line(error, Path(name).name, *REFUSED[name])


@pytest.mark.parametrize(
    ("name", "sensor", "kind", "words"),
    [
        (XTF, "laser", "las", ("XTF", "format")),
        (PPP, "ins", "sbet", ("NovAtel", "format")),
        (PPP_ASCII, "ins", "table", ("NovAtel", "format")),
        (ATLANS, "ins", "novatel", ("SBET", "format")),
        ("laser/test1_4.las", "mbes", "r2sonic", ("LAS", "format")),
        (GSF, "mbes", "r2sonic", ("GSF", "write mbes.format: gsf")),
        (KMALL, "mbes", "table", ("kmall", "write mbes.format: kmall")),
        (HE, "mbes", "kmall", (".all", "write mbes.format: all")),
        (BUNNY, "laser", "las", ("E57", "write laser.format: e57")),
        (BUNNY, "mbes", "gsf", ("E57", "list it under laser.files")),
    ],
)
def test_another_format_than_told(name: str, sensor: Any, kind: str, words: tuple[str, ...], read: Read) -> None:
    with pytest.raises(RawDataError) as error:
        read(sensor, kind, name)
    one_line(error, Path(name).name, *words)


NO_KIND = {path for path in REFUSED if path.endswith(".bin")}  # a program's own binary, without any mark
WHOLE_SETTINGS: dict[str, dict[str, Any]] = {"ins": {"gps_week": 2000}, "laser": {"gps_week": 2000}, "mbes": {}}
REFUSED_LATER = {  # of a format that is read, but damaged, without times, with a wrong flag, of stabilised or two heads
    "ins/pdal_badfile.sbet", "laser/pdal/pdal_sample_c.las", BUNNY, MOVED, GSF, TURBEAMS,
}  # fmt: skip


def test_every_file_is_tried(data: Path, read: Read) -> None:
    """Whatever is added to the folder, however deep, is read for what it is, or refused in one line with advice."""
    paths = sorted(path for path in data.glob("*/**/*") if path.is_file())
    names = [path.relative_to(data).as_posix() for path in paths]
    assert set(REFUSED) | REFUSED_LATER <= set(names)
    for path, name in zip(paths, names, strict=True):
        kind = detect.kind_of(path, path.name)
        assert (kind is file_kind.UNKNOWN) == (name in NO_KIND), name
        if kind.format is None:
            for sensor, formats in FORMATS.items():
                with pytest.raises(RawDataError) as error:
                    read(sensor, formats[0], name, **WHOLE_SETTINGS[sensor])
                one_line(error, path.name, kind.title, "; ")
            continue
        sensor = kind.sensors[0]
        if name in REFUSED_LATER:
            with pytest.raises(RawDataError) as error:
                read(sensor, kind.format, name, **WHOLE_SETTINGS[sensor])
            one_line(error, path.name, "; ")
        else:
            columns, dropped = read(sensor, kind.format, name, **WHOLE_SETTINGS[sensor])
            assert len(columns["t_ns"]) or dropped, name
