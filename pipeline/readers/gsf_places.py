"""Places of the soundings in a GSF file, as the software that wrote it placed them.

Each ping has a position, a heading, and for each beam the distances along and across track and the depth. Their axes
are level and follow the heading (forward, starboard, down; GSF specification 03.06, 4.3.4). The place of a beam is the
ping's position, moved north by along · cos h - across · sin h and east by along · sin h + across · cos h, on the radii
of curvature of WGS 84 at the ping's latitude. Depths count from the water, so the heights are those of another surface.
Positions are whole 1e-7 degrees, 11 mm, and the heading is rounded to 0.01 degrees.
"""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.maths.geometry.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M
from pipeline.readers.gsf_pings import GsfScales, decoded_record, major_version
from pipeline.readers.gsf_records import HEADER, PING, gsf_records
from pipeline.readers.raw_file import opened

POSITION_STEP_M = 0.011
_COLUMNS = ("AlongTrack_m", "AcrossTrack_m", "Depth_m")


def gsf_points(path: Path) -> Iterator[tuple[NDArray[np.float64], int]]:
    """Yield longitude, latitude (degrees), height (m, minus the depth) of each ping's beams (n, 3), and those lost."""
    version, any_ping = 3, False
    scales: GsfScales = {}
    with opened(path, str(path)) as file:
        for kind, body in gsf_records(file, Counter()):
            if kind == HEADER:
                version = major_version(body)
            if kind != PING:
                continue
            record = decoded_record(body, version, scales)
            beams = None if record is None else [record["Beams"][name] for name in _COLUMNS]
            if record is None or beams is None or any(values is None for values in beams[1:]):
                yield np.empty((0, 3)), 1
                continue
            any_ping = True
            across, depth = beams[1], beams[2]
            along = np.zeros_like(across) if beams[0] is None else beams[0]
            heading = np.radians(record["Heading_deg"])
            north = along * np.cos(heading) - across * np.sin(heading)
            east = along * np.sin(heading) + across * np.cos(heading)
            points = _moved(record["Longitude_deg"], record["Latitude_deg"], east, north, -depth)
            good = np.isfinite(points).all(axis=1)
            yield points[good], int((~good).sum())
    if not any_ping:
        raise RawDataError(f"{path}: has no ping with across-track distances and depths; export XYZ text in its place")


def _moved(
    longitude_deg: float,
    latitude_deg: float,
    east_m: NDArray[np.float64],
    north_m: NDArray[np.float64],
    height_m: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return places (n, 3) that lie east and north of a position, by the radii M and N of the ellipsoid there."""
    sine = np.sin(np.radians(latitude_deg))
    across = SEMI_MAJOR_M / np.sqrt(1 - ECCENTRICITY_SQUARED * sine**2)
    along = across * (1 - ECCENTRICITY_SQUARED) / (1 - ECCENTRICITY_SQUARED * sine**2)
    longitude = longitude_deg + np.degrees(east_m / (across * np.cos(np.radians(latitude_deg))))
    return np.stack([longitude, latitude_deg + np.degrees(north_m / along), height_m], axis=1)  # fmt: skip
