"""Coordinates of a file as points in the pool frame, and the CRS in which they lie near the run's track.

Coordinates go through ECEF of their own datum. No datum is shifted: a file in another datum differs by a shift of all
points, which the answer shows.
"""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.run_soundings import RunSide
from pipeline.errors import ConfigError
from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.readers.crs import ECEF, ToEcef, ecef_function
from pipeline.readers.datums import height_system, horizontal_part, unusable_reason

Array = NDArray[np.float64]
GEOGRAPHIC = "EPSG:4979"
NEAR_M = 20_000.0  # a guessed CRS places the points within this of the target
MOST_HINTS = 3
LONGEST_NAME = 40  # letters; a longer one is a whole definition (WKT, PROJ)
SOME = 1000  # coordinates with which a CRS is tried


@dataclass(frozen=True)
class Placing:
    """How coordinates become points.

    Attributes
    ----------
    name, title
        The CRS by the user's word, and by its own name.
    to_ecef
        Its transform; None: the coordinates are ECEF.
    swapped
        Whether the file's first coordinate is north (or latitude).
    geoid
        Name of the CRS's vertical part, whose heights are not ellipsoidal; None: there is none.
    geographic
        Whether the coordinates are degrees.
    convergence_rad
        Meridian convergence at the target.
    """

    name: str
    title: str
    to_ecef: ToEcef | None
    swapped: bool
    geoid: str | None
    geographic: bool
    convergence_rad: float

    def in_pool(self, coordinates: Array, frame: PoolFrame) -> Array:
        """Return points (n, 3) m in the pool frame; they may be infinite where the CRS cannot place them."""
        x, y, z = (coordinates[:, [1, 0, 2]] if self.swapped else coordinates).T
        ecef = (x, y, z) if self.to_ecef is None else self.to_ecef(x, y, z)
        with np.errstate(all="ignore"):
            return frame.points_from_ecef(np.stack(ecef, axis=1))


def placing_of(name: str, side: RunSide) -> Placing:
    """Return the placing by a CRS, x east or longitude first; raise ConfigError if it cannot be used."""
    from pyproj import CRS, Proj
    from pyproj.exceptions import ProjError

    try:
        with warnings.catch_warnings(action="ignore"):  # PROJ warns of +init=epsg:...
            crs = CRS.from_user_input(name)
        if (reason := unusable_reason(crs)) is not None:
            raise ConfigError(f"--crs {name}: {crs.name} {reason}")
        level = horizontal_part(crs)
        factors = Proj(level).get_factors(side.longitude_deg, side.latitude_deg) if level.is_projected else None
        return Placing(
            name=name if len(name) < LONGEST_NAME else ":".join(crs.to_authority() or ("as the file says",)),
            title=crs.name,
            to_ecef=None if level.is_geocentric else ecef_function(level),
            swapped=False,
            geoid=height_system(crs),
            geographic=level.is_geographic,
            convergence_rad=0.0 if factors is None else float(np.radians(factors.meridian_convergence)),
        )
    except ProjError as error:
        raise ConfigError(
            f"--crs {name}: no coordinate reference system is known by that name, or it cannot be used here; write its "
            "number, such as EPSG:32651 (UTM zone 51 north)"
        ) from error


def utm_of(side: RunSide, zones_off: int = 0) -> str:
    """Return the UTM zone of the target, WGS 84, or one so many zones to the east."""
    zone = (int((side.longitude_deg + 180) // 6) + zones_off) % 60 + 1
    return f"EPSG:{(32600 if side.latitude_deg >= 0 else 32700) + zone}"


def distance_m(placing: Placing, coordinates: Array, side: RunSide) -> float:
    """Return the median horizontal distance of points from the target; inf if they have no place."""
    level = placing.in_pool(coordinates, side.frame)[:, :2]
    level = level[np.isfinite(level).all(axis=1)]
    return float(np.median(np.linalg.norm(level, axis=1))) if len(level) else np.inf


def guessed(coordinates: Array, side: RunSide, geographic: bool | None) -> Placing | None:
    """Return the placing that brings the points nearest to the target, by degrees, UTM or ECEF; None: none does."""
    coordinates = coordinates[:: max(1, len(coordinates) // SOME)]
    names = [GEOGRAPHIC] if geographic else [GEOGRAPHIC, utm_of(side), ECEF]
    tried = [placing for name in names for placing in _both_orders(name, side)]
    best = min(tried, key=lambda placing: distance_m(placing, coordinates, side))
    return best if distance_m(best, coordinates, side) < NEAR_M else None


def hints(coordinates: Array, side: RunSide, within_m: float) -> list[Placing]:
    """Return placings that would bring the points near the target: likely ones, or else some of all that PROJ knows."""
    from pyproj.aoi import AreaOfInterest
    from pyproj.database import query_crs_info
    from pyproj.enums import PJType

    some = coordinates[:: max(1, len(coordinates) // SOME)]
    found = list(_fitting((GEOGRAPHIC, utm_of(side), utm_of(side, -1), utm_of(side, 1), ECEF), some, side, within_m))
    if found:
        return found
    east, north = side.longitude_deg, side.latitude_deg
    here = AreaOfInterest(east - 0.01, north - 0.01, east + 0.01, north + 0.01)
    known = query_crs_info("EPSG", PJType.PROJECTED_CRS, area_of_interest=here, contains=True)
    names = [f"{info.auth_name}:{info.code}" for info in known]
    return list(islice(_fitting(names, some, side, within_m), MOST_HINTS))


def _fitting(names: Sequence[str], coordinates: Array, side: RunSide, within_m: float) -> Iterator[Placing]:
    for name in names:
        with suppress(ConfigError):
            for placing in _both_orders(name, side):
                if distance_m(placing, coordinates, side) < within_m:
                    yield placing


def _both_orders(name: str, side: RunSide) -> tuple[Placing, Placing]:
    east_first = placing_of(name, side)
    return east_first, replace(east_first, swapped=True)
