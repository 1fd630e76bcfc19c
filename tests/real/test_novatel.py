"""NovAtel logs on real files, against figures that other programs gave for them."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.gps_time import NS, WEEK_NS
from tests.real.conftest import Read
from tests.support.real_files import INS, PPP, PPP_ASCII

SIGMAS = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
NO_INS_RECORDS = {"ins status INS_ALIGNING": 1988}


def test_novatel_inspvax_sigmas(read: Read) -> None:
    """Binary as ASCII: 2289 records, of a receiver with a precise point positioning that converges."""
    (binary, _), (ascii_, _) = (read("ins", "novatel", name, sigmas=True) for name in (PPP, PPP_ASCII))
    assert binary.keys() == ascii_.keys() == {"t_ns", *SIGMAS}
    for name in SIGMAS:
        assert ascii_[name] == pytest.approx(binary[name], rel=1e-3, abs=1e-4), name
    assert np.array_equal(binary["t_ns"], read("ins", "novatel", PPP)[0]["t_ns"])
    assert np.all(binary["north_m"] < 1)
    assert np.all(binary["roll_deg"] < 1)


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
