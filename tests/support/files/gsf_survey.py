"""A GSF file as a survey software writes it: position and heading of each ping, distances and depths of its beams."""

import struct
from pathlib import Path

import numpy as np
from pyproj import Geod, Transformer

from tests.support.files.sonar_files import gsf_header, gsf_ping, scale_factors, subrecord
from tools.survey_software import Recording

CENTIMETRES = scale_factors(depth=(100, 0), across=(100, 0), along=(100, 0), time=(1_000_000, 0), angle=(100, 0))


def write_gsf(path: Path, recorded: Recording, placed_ecef_m: np.ndarray, water_height_m: float) -> None:
    """Write the soundings, placed in ECEF; positions in 1e-7 degrees, headings in 0.01 degrees, the rest in cm."""
    geod, ins = Geod(ellps="WGS84"), recorded.ins
    longitude, latitude, height = Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True).transform(
        *placed_ecef_m.T
    )
    boat = [np.interp(recorded.t_ns, ins["t_ns"], np.degrees(ins[name])) for name in ("longitude_rad", "latitude_rad")]
    heading = np.interp(recorded.t_ns, ins["t_ns"], np.degrees(np.unwrap(ins["azimuth_rad"])))
    azimuth, _, distance = geod.inv(boat[0], boat[1], longitude, latitude)
    along, across = (distance * f(np.radians(azimuth - heading)) for f in (np.cos, np.sin))
    numbers = [np.round(100 * values).astype(int) for values in (along, across, water_height_m - height)]
    kept = numbers[2] >= 0  # a depth has no sign
    pings = [gsf_header()]
    for rows in np.split(np.arange(len(kept)), np.flatnonzero(np.diff(recorded.t_ns)) + 1):
        rows = rows[kept[rows]]
        if len(rows):
            pings.append(_ping(len(pings), [values[rows] for values in numbers], [b[rows[0]] for b in boat],
                               heading[rows[0]] % 360))  # fmt: skip
    path.write_bytes(b"".join(pings))


def _ping(k: int, numbers: list[np.ndarray], place_deg: list[float], heading_deg: float) -> bytes:
    along, across, depth = (values.tolist() for values in numbers)
    beams = len(depth)
    extra = CENTIMETRES + subrecord(1, struct.pack(f">{beams}H", *depth))
    extra += subrecord(2, struct.pack(f">{beams}h", *across)) + subrecord(3, struct.pack(f">{beams}h", *along))
    content = bytearray(gsf_ping(k, [9000] * beams, [0] * beams, extra, beams=beams))
    struct.pack_into(">2i", content, 8 + 8, *(round(value * 1e7) for value in place_deg))
    struct.pack_into(">H", content, 8 + 30, round(heading_deg * 100) % 36_000)
    return bytes(content)
