"""The bytes of the instrument files, read by other people's programs where there are any."""

import struct
import warnings
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import laspy
import numpy as np
import pytest
from laspy.header import GpsTimeType

from pipeline.config.load import load_pool, load_session
from pipeline.gps_time import NS, WEEK_NS, gps_ns_from_unix_utc
from pipeline.simulation.novatel import crc32
from pipeline.simulation.r2sonic_packets import packet_dtype, utc_from_gps_ns
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session, write_session

Change = Callable[..., Scenario]


def written(scenario: Scenario, folder: Path) -> SimulatedSession:
    simulated = simulate_session(scenario, 5)
    write_session(simulated, folder, scenario)
    load_session(folder)
    load_pool(folder / "pool.yaml")
    return simulated


@pytest.mark.parametrize("form", ["inspvas", "inspva", "inspvasa", "inspvaa"])
def test_novatel_reads_the_ins_files(tmp_path: Path, changed: Change, noisy: Scenario, form: str) -> None:
    from novatel_edie.oem import FileParser

    simulated = written(changed(noisy, ins={"format": form, "files": "pass", "rate_hz": 10.0}), tmp_path / "s")
    files = sorted((tmp_path / "s" / "ins").iterdir())
    assert len(files) == 2
    messages = [message for path in files for message in FileParser(str(path))]
    aligning, good = messages[:5], messages[5:]
    assert {int(m.ins_solution_status) for m in aligning} == {1}  # INS_ALIGNING
    assert {int(m.ins_solution_status) for m in good} == {3}  # INS_SOLUTION_GOOD
    assert {m.latitude for m in aligning} == {-90.0}
    ins = simulated.ins
    assert len(good) == len(ins["t_ns"])
    t_ns = np.array([m.week * WEEK_NS + round(m.seconds * NS) for m in good])
    np.testing.assert_array_equal(t_ns, ins["t_ns"])
    for name in ("latitude", "longitude", "roll", "pitch", "azimuth"):
        values = [getattr(m, name) for m in good]
        np.testing.assert_allclose(np.radians(values), ins[f"{name}_rad"], rtol=0, atol=1e-11)
    np.testing.assert_allclose([m.height for m in good], ins["height_m"], atol=1e-9)
    assert np.median([np.hypot(m.north_vel, m.east_vel) for m in good]) == pytest.approx(0.4, abs=0.05)


def test_crc_of_the_manuals_inspvas_example() -> None:
    text = (
        b"INSPVASA,1264,144059.000;1264,144059.002135700,51.116680071,-114.037929194,515.286704183,277.896368884,"
        b"84.915188605,-8.488207941,0.759619515,-2.892414901,6.179554750,INS_ALIGNMENT_COMPLETE"
    )
    assert f"{crc32(text):08x}" == "855d6f76"


def test_sbet_has_seventeen_doubles_and_a_wander_angle(tmp_path: Path, changed: Change, noisy: Scenario) -> None:
    simulated = written(changed(noisy, ins={"format": "sbet", "rate_hz": 10.0}), tmp_path / "s")
    record = np.fromfile(tmp_path / "s" / "ins" / "ins.sbet", "<f8").reshape(-1, 17)
    week = load_session(tmp_path / "s").ins.gps_week
    assert week == 2418
    np.testing.assert_array_equal(np.rint((record[:, 0] + week * 604800) * 1e3), simulated.ins["t_ns"] // 1_000_000)
    np.testing.assert_array_equal(record[:, 1], simulated.ins["latitude_rad"])
    heading = (record[:, 9] - record[:, 10]) % (2 * np.pi)
    assert np.abs(np.exp(1j * heading) - np.exp(1j * simulated.ins["azimuth_rad"])).max() < 1e-12
    assert abs(record[0, 10]) > 0.01


def sections(packet: bytes) -> dict[str, bytes]:
    """A packet taken to pieces by hand, from the manual."""
    magic, size = struct.unpack(">4sI", packet[:8])
    assert magic == b"BTH0"
    found, at = {}, 12
    while at < size:
        name, length = struct.unpack(">2sH", packet[at : at + 4])
        found[name.decode()] = packet[at : at + length]
        at += length
    assert at == size
    return found


@pytest.mark.parametrize(("spacing", "beams"), [("equi_angle", 128), ("equidistant", 101)])
def test_xtf_carries_the_packets(tmp_path: Path, changed: Change, noisy: Scenario, spacing: str, beams: int) -> None:
    import pyxtf

    mbes = {"spacing": spacing, "beams": beams, "projector_offset_m": [0.01, 0.02, 0.119]}
    simulated = written(changed(noisy, mbes=mbes), tmp_path / "s")
    columns, pings = simulated.mbes, simulated.pings
    seen = 0
    for k in (0, 1):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pyxtf names no class for R2Sonic's records
            _, records = pyxtf.xtf_read(str(tmp_path / "s" / "mbes" / f"pass_{k}.xtf"))
        (packets,) = records.values()
        assert len(packets) == (pings["pass"] == k).sum()
        for record in packets:
            part = sections(bytes(record.data)[242:])
            seconds, nanoseconds, ping = struct.unpack(">3I", part["H0"][28:40])
            rows = columns["ping"] == ping
            t_ns = gps_ns_from_unix_utc(np.array([seconds]), np.array([nanoseconds]))[0]
            assert t_ns == pings["t_ns"][pings["ping"] == ping][0]
            assert struct.unpack(">H", part["H0"][114:116]) == (beams,)
            assert struct.unpack(">f", part["H0"][44:48]) == (1500.0,)
            (scale,) = struct.unpack(">f", part["R0"][4:8])
            counts = np.frombuffer(part["R0"], ">u2", beams, 8)
            np.testing.assert_array_equal(np.flatnonzero(counts), columns["beam"][rows])
            np.testing.assert_allclose(counts[counts > 0] * scale, columns["two_way_time_s"][rows], atol=0.51 * scale)
            if spacing == "equi_angle":
                ends = struct.unpack(">2f", part["A0"][4:12])
                angles = np.linspace(ends[0], ends[1], beams)
                more = struct.unpack(">6f", part["A0"][12:36])
            else:
                first, step = struct.unpack(">2f", part["A2"][4:12])
                angles = first + np.cumsum(np.frombuffer(part["A2"], ">u2", beams, 36).astype(int)) * step
                more = struct.unpack(">6f", part["A2"][12:36])
            np.testing.assert_allclose(angles[counts > 0], columns["angle_rad"][rows], rtol=0, atol=1e-15)
            assert more == pytest.approx((0, 0.119, 0.02, 0.01, 0, 0))
            flags = struct.unpack(">I", part["Q0"][4:8])[0]
            assert flags >> 28 == 0b1011  # beam 0, far from the middle: phase
            seen += 1
    assert seen == len(pings["ping"])


def test_bare_packets_follow_one_another(tmp_path: Path, changed: Change, noisy: Scenario) -> None:
    scenario = changed(noisy, mbes={"format": "r2s", "intensity": False})
    simulated = written(scenario, tmp_path / "s")
    content = (tmp_path / "s" / "mbes" / "pass_1.r2s").read_bytes()
    size = packet_dtype(scenario.mbes).itemsize
    assert len(content) == size * (simulated.pings["pass"] == 1).sum()
    assert list(sections(content[size : 2 * size])) == ["H0", "R0", "A0", "G0", "Q0"]


def test_real_section_sizes() -> None:
    """As in packets of a real head with 256 beams."""
    sizes = packet_dtype(Scenario().mbes)
    assert [sizes[name].itemsize for name in ("H0", "R0", "A0", "I1", "G0", "Q0")] == [116, 520, 36, 520, 16, 132]
    a2 = packet_dtype(Scenario().mbes.model_copy(update={"spacing": "equidistant"}))
    assert a2["A2"].itemsize == 548


def test_leap_seconds_are_taken_off() -> None:
    moments = np.array([1483228799, 1483228800, 1778572800], dtype=np.int64)
    t_ns = gps_ns_from_unix_utc(moments, np.array([5, 6, 7]))
    seconds, nanoseconds = utc_from_gps_ns(t_ns)
    np.testing.assert_array_equal(seconds, moments)
    np.testing.assert_array_equal(nanoseconds, [5, 6, 7])


@pytest.mark.parametrize("form", ["laz", "las"])
@pytest.mark.parametrize("clock", ["adjusted_standard", "week_seconds"])
def test_laspy_reads_the_points(tmp_path: Path, changed: Change, noisy: Scenario, form: str, clock: str) -> None:
    simulated = written(changed(noisy, laser={"format": form, "time": clock, "scale_m": 1e-4}), tmp_path / "s")
    rows = simulated.laser_rows
    for k in (0, 1):
        las = laspy.read(tmp_path / "s" / "laser" / f"pass_{k}.{form}")
        part = {name: values[rows[k] : rows[k + 1]] for name, values in simulated.laser.items()}
        assert las.header.point_format.id == 6
        for axis in "xyz":
            np.testing.assert_allclose(np.asarray(las[axis]), part[f"{axis}_m"], atol=0.51e-4)
        if clock == "week_seconds":
            assert las.header.global_encoding.gps_time_type == GpsTimeType.WEEK_TIME
            assert load_session(tmp_path / "s").laser.gps_week == 2418
            seconds = las.gps_time + 2418 * 604800
        else:
            assert las.header.global_encoding.gps_time_type == GpsTimeType.STANDARD
            seconds = las.gps_time + 1e9
        first_s = part["t_ns"][0] // NS
        np.testing.assert_allclose(seconds - first_s, (part["t_ns"] - first_s * NS) / NS, atol=3e-7)
        assert las.header.creation_date == datetime(2026, 5, 12, tzinfo=UTC).date()
