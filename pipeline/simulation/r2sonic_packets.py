"""R2Sonic BTH0 packets, big-endian, and the XTF shell round them, little-endian."""

import numpy as np
from numpy.typing import NDArray

from pipeline.gps_time import GPS_EPOCH_UNIX_S, LEAP_SECONDS, NS
from pipeline.simulation.beams import FanAngles
from pipeline.simulation.ins import Columns
from pipeline.simulation.scenario_mbes import MbesScenario

_XTF_PING_HEADER_BYTES = 256  # XTF ping header, its first 14 bytes being the packet header
PHASE_DETECT, MAGNITUDE_DETECT = 0b1011, 0b0111  # nibbles as a real head sets them
MAGNITUDE_BELOW_RAD = np.radians(20.0)


def utc_from_gps_ns(t_ns: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return Unix seconds and nanoseconds (UTC) of GPS times, with the leap seconds of that instant."""
    starts = np.array([(start - GPS_EPOCH_UNIX_S + leap) * NS for start, leap in LEAP_SECONDS], dtype=np.int64)
    leaps = np.array([leap for _, leap in LEAP_SECONDS], dtype=np.int64)
    leap = leaps[np.maximum(np.searchsorted(starts, t_ns, side="right") - 1, 0)]
    return t_ns // NS - leap + GPS_EPOCH_UNIX_S, t_ns % NS


def packet_dtype(scenario: MbesScenario) -> np.dtype[np.void]:
    """Return the layout of a packet with the scenario's number of beams and its sections."""
    n, pad = scenario.beams, scenario.beams % 2
    section = [("name", "S2"), ("size", ">u2")]
    h0 = np.dtype(
        [
            *section, ("model", "S12"), ("serial", "S12"), ("seconds", ">u4"), ("nanoseconds", ">u4"), ("ping", ">u4"),
            ("period", ">f4"), ("sound_speed", ">f4"), ("frequency", ">f4"), ("tx_power", ">f4"), ("tx_width", ">f4"),
            ("tx_beam_vertical", ">f4"), ("tx_beam_horizontal", ">f4"), ("tx_steering", ">f4", 2), ("tx_misc", ">u2"),
            ("vtx_offset", ">i2"), ("rx_bandwidth", ">f4"), ("rx_sample_rate", ">f4"), ("rx_range", ">f4"),
            ("rx_gain", ">f4"), ("rx_spreading", ">f4"), ("rx_absorption", ">f4"), ("rx_tilt", ">f4"),
            ("rx_misc", ">u4"), ("reserved", ">u2"), ("points", ">u2"),
        ]
    )
    scaled = np.dtype([*section, ("scale", ">f4"), ("values", ">u2", n + pad)])
    a0 = np.dtype([*section, ("first", ">f4"), ("last", ">f4"), ("more", ">f4", 6)])
    a2 = np.dtype([*section, ("first", ">f4"), ("scale", ">f4"), ("more", ">f4", 6), ("steps", ">u2", n + pad)])
    g0 = np.dtype([*section, ("min", ">f4"), ("max", ">f4"), ("slope", ">f4")])
    q0 = np.dtype([*section, ("flags", ">u4", (n + 7) // 8)])
    angles = ("A0", a0) if scenario.spacing == "equi_angle" else ("A2", a2)
    intensity = [("I1", scaled)] if scenario.intensity else []
    start = [("magic", "S4"), ("size", ">u4"), ("stream", ">u4")]
    return np.dtype([*start, ("H0", h0), ("R0", scaled), angles, *intensity, ("G0", g0), ("Q0", q0)])


def bth0_packets(mbes: Columns, pings: Columns, fan: FanAngles, scenario: MbesScenario) -> np.ndarray:
    """Return one packet per ping.

    Beams without a detection have range 0. Ranges use all 16 bits of section R0.

    Parameters
    ----------
    mbes : Columns
        Detections of these pings.
    pings : Columns
        Times and numbers of the pings.
    fan : FanAngles
        Recorded angles.
    scenario : MbesScenario
        The sonar.
    """
    dtype = packet_dtype(scenario)
    packet = np.zeros(len(pings["t_ns"]), dtype)
    packet["magic"], packet["size"] = b"BTH0", dtype.itemsize
    assert dtype.names is not None
    for name in dtype.names[3:]:
        packet[name]["name"], packet[name]["size"] = name.encode(), dtype[name].itemsize
    _fill_head(packet["H0"], pings, scenario)
    longest = mbes["two_way_time_s"].max(initial=1e-3)
    scale = np.nextafter(np.float32(longest / 65535), np.float32(1))
    row = np.searchsorted(pings["ping"], mbes["ping"])
    packet["R0"]["scale"] = scale
    packet["R0"]["values"][row, mbes["beam"]] = np.rint(mbes["two_way_time_s"] / float(scale))
    if fan.steps is None:
        packet["A0"]["first"], packet["A0"]["last"] = fan.first_rad, fan.last_rad
    else:
        packet["A2"]["first"], packet["A2"]["scale"] = fan.first_rad, fan.step_scale_rad
        packet["A2"]["steps"][:, : len(fan.steps)] = fan.steps
    angles = packet["A0" if fan.steps is None else "A2"]
    x, y, z = scenario.projector_offset_m
    angles["more"][:, 1:4] = z, y, x
    if scenario.intensity:
        packet["I1"]["scale"] = 1000.0
        packet["I1"]["values"][row, mbes["beam"]] = 2000
    packet["G0"]["min"], packet["G0"]["max"] = 1e-4, 2 * scenario.max_range_m / scenario.sound_speed_recorded_m_s
    packet["Q0"]["flags"] = _quality(fan.angles_rad)
    return packet


def _fill_head(head: np.ndarray, pings: Columns, scenario: MbesScenario) -> None:
    head["model"], head["serial"] = b"2024", b"100017"
    head["seconds"], head["nanoseconds"] = utc_from_gps_ns(pings["t_ns"])
    head["ping"], head["points"] = pings["ping"], scenario.beams
    head["period"], head["sound_speed"] = 1 / scenario.ping_rate_hz, scenario.sound_speed_recorded_m_s
    head["frequency"], head["tx_power"], head["tx_width"] = 400e3, 191.0, 15e-6
    head["tx_beam_vertical"], head["tx_beam_horizontal"] = np.radians(130.0), np.radians(scenario.beam_deg[1])
    head["rx_bandwidth"], head["rx_sample_rate"], head["rx_range"] = 60e3, 78125.0, scenario.max_range_m
    head["rx_gain"], head["rx_spreading"], head["rx_absorption"] = 5.0, 20.0, 100.0


def _quality(angles_rad: NDArray[np.float64]) -> NDArray[np.uint32]:
    """Return flags, a nibble per beam, beam 0 topmost: amplitude detection in the middle of the fan, phase outside."""
    nibbles = np.where(np.abs(angles_rad) < MAGNITUDE_BELOW_RAD, MAGNITUDE_DETECT, PHASE_DETECT).astype(np.uint32)
    nibbles = np.pad(nibbles, (0, -len(nibbles) % 8)).reshape(-1, 8)
    flags: NDArray[np.uint32] = np.bitwise_or.reduce(nibbles << np.arange(28, -1, -4, dtype=np.uint32), axis=1)
    return flags


def xtf_bytes(packet: np.ndarray, name: str) -> bytes:
    """Return an XTF file with the packets as records of type 65 (R2Sonic bathymetry), padded to 64 bytes."""
    inside = packet.dtype.itemsize
    length = -(-(_XTF_PING_HEADER_BYTES + inside) // 64) * 64
    record = np.zeros(
        len(packet),
        np.dtype(
            {
                "names": [
                    "magic", "type", "bytes", "year", "month", "day", "hour", "minute", "second", "hundredths", "ping",
                    "half_sound_speed", "packet",
                ],
                "formats": ["<u2", "u1", "<u4", "<u2", "u1", "u1", "u1", "u1", "u1", "u1", "<u4", "<f4", packet.dtype],
                "offsets": [0, 2, 10, 14, 16, 17, 18, 19, 20, 21, 28, 36, _XTF_PING_HEADER_BYTES],
                "itemsize": length,
            }
        ),
    )
    record["magic"], record["type"], record["bytes"], record["packet"] = 0xFACE, 65, length, packet
    utc = packet["H0"]["seconds"].astype("datetime64[s]")
    days = utc.astype("datetime64[D]")
    months = utc.astype("datetime64[M]")
    record["year"], record["month"] = utc.astype("datetime64[Y]").astype(int) + 1970, months.astype(int) % 12 + 1
    record["day"] = (days - months).astype(int) + 1
    since_midnight = (utc - days).astype(int)
    record["hour"], record["minute"] = since_midnight // 3600, since_midnight // 60 % 60
    record["second"], record["hundredths"] = since_midnight % 60, packet["H0"]["nanoseconds"] // 10_000_000
    record["ping"], record["half_sound_speed"] = packet["H0"]["ping"], packet["H0"]["sound_speed"] / 2
    return _xtf_file_header(name) + record.tobytes()


def _xtf_file_header(name: str) -> bytes:
    header = np.zeros(
        1,
        np.dtype(
            {
                "names": ["format", "system", "program", "version", "sonar", "type", "file", "units", "bathymetry"],
                "formats": ["u1", "u1", "S8", "S8", "S16", "<u2", "S64", "<u2", "<u2"],
                "offsets": [0, 1, 2, 10, 18, 34, 100, 164, 168],
                "itemsize": 1024,
            }
        ),
    )
    header["format"], header["system"], header["program"], header["version"] = 0x7B, 1, b"poolcal", b"1"
    header["sonar"], header["file"], header["units"], header["bathymetry"] = b"simulated", name.encode()[:63], 3, 1
    return header.tobytes()
