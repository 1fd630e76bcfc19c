"""Casts of sound speed from files: formats, rows and damage, against values written down here."""

import hashlib
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import RawDataError
from pipeline.readers.casts import read_cast
from tests.support.files.cast_files import CARIS, PROFILE, ROWS, is_profile


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.svp"


def read(path: Path, text: str | bytes, number: int | None = None) -> tuple[list[list[float]], dict[str, Any]]:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_cast(path, path.name, number)


ASVP = f"( SoundVelocity  1.0 0 20260512093005 -36.50000000 120.25000000 -1 0 0 PROBE_01 P 0005 )\n{ROWS}"
COLUMNS = {
    "CARIS": CARIS,
    "CARIS with CR LF and blank lines": CARIS.replace("\n", "\r\n") + "\r\n\r\n",
    "Kongsberg": ASVP,
    "Kongsberg with temperature and salinity": ASVP.replace("\n", " 20.0 35.0\n").replace(") 20.0 35.0", ")"),
    "HYPACK 2": f"FTP NEW 2\n{ROWS}",
    "HYPACK 3": f"FTP NEW 3 36.5 120.25 09:30 05/12/2026\n{ROWS}",
    "names with units": "Depth (m),Sound Velocity (m/s)\n" + ROWS.replace(" ", ","),
    "names alone": "depth speed\n" + ROWS,
    "README's": "depth_m,speed_m_s\n" + ROWS.replace(" ", ","),
    "blanks and brackets": "Depth (m)   Sound Speed (m/s)\n" + ROWS,
    "line of units": "Date\tDepth\tSV\n\tm\tm/s\n" + re.sub(r"(?m)^(\S+) ", r"12/05\t\1\t", ROWS),
    "other order": "SV [m/s];Temperature [C];Depth [m]\n" + re.sub(r"(?m)^(\S+) (\S+)", r"\2;20.1;\1", ROWS),
    "decimal commas": "Depth [m];SV [m/s]\n" + ROWS.replace(" ", ";").replace(".", ","),
    "AML": "[MeasurementData]\nColumns=Time,SV,Depth\nUnits=hh:mm:ss,m/s,m\n"
    + re.sub(r"(?m)^(\S+) (\S+)", r"09:30:05,\2,\1", ROWS),
    "CastAway": "% Device,CC1234\n% Cast time (UTC),2026-05-12 09:30:05\n% Start latitude,-36.5\n"
    "% Start longitude,120.25\nPressure (Decibar),Depth (Meter),Temperature (Celsius),Conductivity (uS/cm),"
    "Sound velocity (Meters per Second)\n" + re.sub(r"(?m)^(\S+) (\S+)", r"0.5,\1,20,5000,\2", ROWS),
}  # fmt: skip


@pytest.mark.parametrize("form", COLUMNS)
@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "utf-16"])
def test_formats(form: str, code: str, file: Path) -> None:
    svp, used = read(file, COLUMNS[form].encode(code))
    is_profile(svp)
    assert used["rows"] == 5 or sum(used["left_out"].values()) == used["rows"] - 5
    assert (used["first_m"], used["last_m"], used["casts"], used["number"]) == (0.5, 3.0, 1, 1)
    assert used["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()


@pytest.mark.parametrize("form", ["CARIS", "Kongsberg", "CastAway"])
def test_time_and_place(form: str, file: Path) -> None:
    """Day 132 of 2026 is 12 May; south is negative."""
    _, used = read(file, COLUMNS[form])
    assert used["taken"] == "2026-05-12 09:30:05"
    assert used["place_deg"] == pytest.approx((-36.5, 120.25))


# --- several casts ---------------------------------------------------------------------------------------------------
TWO = CARIS + "Section 2026-133 10:00:00 -36:30:00 120:15:00\n1.0 1490.0\n2.0 1491.0\n"


def test_several_casts_are_asked_for(file: Path) -> None:
    with pytest.raises(RawDataError, match=r"a\.svp: holds 2 casts \(1: 2026-05-12 09:30:05, 2: 2026-05-13 10.*give"):
        read(file, TWO)
    is_profile(read(file, TWO, 1)[0])
    svp, used = read(file, TWO, 2)
    is_profile(svp, [(1.0, 1490.0), (2.0, 1491.0)])
    assert (used["number"], used["casts"], used["taken"]) == (2, 2, "2026-05-13 10:00:00")
    with pytest.raises(RawDataError, match=r"a\.svp: has no cast 3: it holds 2"):
        read(file, TWO, 3)


# --- rows ------------------------------------------------------------------------------------------------------------
def test_rows_in_air_and_damaged_ones_are_left_out_and_counted(file: Path) -> None:
    text = "depth_m,speed_m_s\n-0.30,340.2\n-0.05,1480.0\n0.10,0.0\n0.2,1299.9\nnan,1480\n0.7,bubble\n"
    svp, used = read(file, text + ROWS.replace(" ", ","))
    is_profile(svp)
    assert used["left_out"] == {
        "above the surface": 1, "in air, or a speed that no water has": 3, "no depth or no speed": 2
    }  # fmt: skip
    assert used["rows"] == 11


def test_limits_of_water(file: Path) -> None:
    svp, used = read(file, "depth speed\n0.0 1300.0\n1 1310\n2 1320\n200.0 1700.0\n200.1 1699\n3 1700.1\n")
    assert svp[0] == [0.0, 1300.0]
    assert svp[-1] == [200.0, 1700.0]
    assert used["left_out"] == {"deeper than 200 m": 1, "in air, or a speed that no water has": 1}


def test_an_upcast_alone_is_turned(file: Path) -> None:
    svp, used = read(file, "depth speed\n" + "\n".join(ROWS.splitlines()[::-1]) + "\n")
    is_profile(svp)
    assert used["left_out"] == {}


@pytest.mark.parametrize("lag", [0.4, -0.4])
def test_of_down_and_up_the_way_down_is_used(lag: float, file: Path) -> None:
    up = "".join(f"{depth - 0.1:.3f} {speed + lag:.3f}\n" for depth, speed in PROFILE[::-1])
    svp, used = read(file, "depth speed\n" + ROWS + up)
    is_profile(svp)
    assert used["left_out"] == {"on the way up": 5}


def test_down_and_up_of_two_waters(file: Path) -> None:
    up = "".join(f"{depth - 0.1:.3f} {speed + 2.6:.3f}\n" for depth, speed in PROFILE[::-1])
    with pytest.raises(RawDataError, match=r"a\.svp: the ways down and up differ by 2\.\d m/s at \d\.\d\d m.*leave in"):
        read(file, "depth speed\n" + ROWS + up)


def test_repeated_depths_become_their_mean(file: Path) -> None:
    svp, used = read(file, "depth speed\n1.0 1480.0\n2.0 1482.0\n2.0 1482.4\n1.9996 1482.2\n3.0 1480.0\n")
    is_profile(svp, [(1.0, 1480.0), (2.0, 1482.2), (3.0, 1480.0)])
    assert used["left_out"] == {"of a depth that is there already: their mean is used": 2}


def test_a_probe_that_sinks_slowly(file: Path) -> None:
    """Rows a third of a millimetre apart are not all of one depth."""
    rows = [(1 + k / 3000, 1480 + (k / 3000) ** 2) for k in range(6000)]
    svp, _ = read(file, "depth speed\n" + "".join(f"{depth:.5f} {speed:.4f}\n" for depth, speed in rows))
    depth, speed = np.array(svp).T
    truth = np.array(rows)
    assert np.max(np.abs(np.interp(truth[:, 0], depth, speed) - truth[:, 1])) < 0.025


def test_waves_at_the_boat_change_no_order(file: Path) -> None:
    """A probe that goes up and down by centimetres as it sinks."""
    order = [0, 2, 1, 3, 5, 4, 6, 7]
    points = [(0.5 + 0.02 * k, 1480 + (k % 2) * 0.5) for k in range(8)]
    svp, _ = read(file, "depth speed\n" + "".join("{} {}\n".format(*points[k]) for k in order))
    is_profile(svp, points)


REFUSED: dict[str, tuple[str, str]] = {
    "temperature alone": ("Depth (m),Temperature (C),Conductivity\n1,20,5\n", "has temperature.*no sound"),
    "pressure": ("Pressure (dbar),Sound Velocity (m/s)\n1,1480\n", "has pressure, and no depth; export"),
    "depth in decibar": ("Depth (dbar),SV (m/s)\n1,1480\n2,1481\n", r"Depth \(dbar\) is in dbar; export"),
    "feet": ("Depth (ft),SV (m/s)\n1,1480\n2,1481\n", "is in ft; export depth in metres"),
    "feet below the names": ("Depth,SV\nft,ft/s\n1,1480\n2,1481\n", "Depth is in ft"),
    "feet and a colon": ("Depth FEET:,SV (m/s)\n1,1480\n2,1481\n", "Depth FEET: is in feet"),
    "feet within the name": ("Depth in feet below surface,SV\n1,1480\n2,1481\n", "is in feet"),
    "fathoms": ("Depth fathoms,SV\n1,1480\n2,1481\n", "is in fathoms"),
    "feet in wide brackets": ("深度（英尺），声速（m/s）\n1，1480\n2，1481\n", "is in 英尺"),
    "feet below, and no unit of the last": ("Depth\tSV\tNote\n(ft)\t(m/s)\n1\t1480\ta\n2\t1481\tb\n", "Depth is in ft"),
    "feet in a line before": ("Depth Units: feet\nDepth,SV\n1,1480\n2,1481\n", "Depth is in feet"),
    "feet a second": ("depth speed\n1 4856\n2 4857\n", "near 4856.*feet a second"),
    "a decimal comma": ("FTP NEW 2\n1,0 1480,2\n2,0 1480,3\n", "water has 1300 to 1700"),
    "columns exchanged": ("speed_m_s,depth_m\n1,1480\n2,1481\n", "near 1.5: water has"),
    "heights": ("depth speed\n-1 1480\n-2 1481\n-3 1482\n", "depths are negative.*positive downward"),
    "two speeds": ("Depth,Sound Velocity,Calc Sound Velocity\n1,1480,1481\n", "has 2 columns of sound speed"),
    "no names": (ROWS, "is no cast: .*put the line depth_m,speed_m_s above"),
    "nothing": ("", "is no cast"),
    "names alone": ("depth_m,speed_m_s\n", "has no row"),
    "one depth": ("depth speed\n1 1480\n1 1481\n", "that can be used is 1, and a cast needs two"),
    "air alone": ("depth speed\n1 340\n2 340.1\n", "near 340.05: water has"),
    "half in air": ("depth speed\n0.1 1380\n0.2 1480\n1 1481\n", "jumps from 1380.0 m/s at 0.10 m to 1480.0 at 0.20"),
    "scatter": (
        "depth speed\n" + "".join(f"{0.01 * k:.2f} {1480 + 3 * (k % 2)}\n" for k in range(900)), "scatter by 1.5 m"
    ),
    "CARIS without sections": ("[SVP_VERSION_2]\na\n1 1480\n", "has no section"),
    "CARIS of another version": ("[SVP_VERSION_1]\na\n1 1480\n", "export it as .SVP_VERSION_2"),
    "Kongsberg cut off": (ASVP.rsplit("\n", 2)[0] + "\n", "promises 5 rows, but it has 4; export"),
    "a log of HYPACK": ("FTP NEW 2\nVER 1\nPOS 1 1.0 2.0 3.0\nEC1 0 1.0 2.0\nPOS 1 2.0 3.0 4\n", "is a log of HYPACK"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_refused(what: str, file: Path) -> None:
    text, words = REFUSED[what]
    with pytest.raises(RawDataError, match=rf"a\.svp: .*{words}") as error:
        read(file, text)
    assert "\n" not in str(error.value)


def test_wide_letters_of_a_chinese_keyboard(file: Path) -> None:
    svp, _ = read(file, "深度（米），声速（米/秒）\n1，1480\n2，1481\n")
    assert svp == [[1.0, 1480.0], [2.0, 1481.0]]


@pytest.mark.parametrize("count", ["\u00b2", "\u2463", "9" * 6000])
def test_a_count_that_no_number_can_hold(count: str, file: Path) -> None:
    """What Python calls digits, and int() refuses."""
    svp, _ = read(file, f"( SoundVelocity 1.0 0 202012121212 36.0 120.0 -1 0 0 A P {count} )\n1 1480\n2 1481\n")
    assert svp == [[1.0, 1480.0], [2.0, 1481.0]]


@pytest.mark.parametrize("content", [b"\0\1\2" * 99, b"\xff\xfe\0", b"(" * 99, b"( SoundVelocity", b"Section " * 9])
def test_bytes_that_are_no_cast(content: bytes, file: Path) -> None:
    with pytest.raises(RawDataError, match=r"a\.svp: "):
        read(file, content)


@pytest.mark.parametrize("form", ["CARIS", "Kongsberg", "HYPACK 2", "AML", "CastAway", "decimal commas"])
def test_damage_is_refused_or_read(form: str, file: Path) -> None:
    """Bytes changed and files cut off: a cast or a RawDataError, never another exception."""
    rng = np.random.default_rng(5)
    good = COLUMNS[form].encode()
    for _ in range(60):
        bad = bytearray(good[: rng.integers(1, len(good) + 1)])
        for place in rng.integers(0, len(bad), rng.integers(0, 5)):
            bad[place] = rng.integers(0, 256)
        try:
            svp, _ = read(file, bytes(bad))
        except RawDataError as error:
            assert "\n" not in str(error)
        else:
            depths, speeds = np.array(svp).T
            assert np.all(np.diff(depths) > 0)
            assert np.all((speeds >= 1300) & (speeds <= 1700))
