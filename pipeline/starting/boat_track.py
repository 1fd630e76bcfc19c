"""Where the boat was and how it sailed, by the INS: a help for finding the target's origin and azimuth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_survey import SurveyedFile
from pipeline.checking.track import joined
from pipeline.gps_time import NS
from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic

Array = NDArray[np.float64]
SAMPLE_NS = NS  # one record is taken per second
LONGEST_NS = 3 * NS  # no step is taken over a longer hole
SLOWEST_M_S = 0.1  # a slower boat has no course
WITHIN_DEG = 20.0  # steps within this of the axis are of passes


@dataclass(frozen=True)
class BoatTrack:
    """The boat's track in a session.

    Attributes
    ----------
    latitude_deg, longitude_deg, height_m : float
        Mean position of the INS over the session.
    mean_ecef_m : (3,) array
        The same in ECEF of the INS's datum.
    azimuth_deg : float or None
        Direction in which most of the way lies that was sailed along one axis, clockwise from true north; None if the
        boat never sailed.
    along_m, against_m : float
        Way sailed within 20 degrees of this direction, and of the opposite one.
    """

    latitude_deg: float
    longitude_deg: float
    height_m: float
    mean_ecef_m: Array
    azimuth_deg: float | None
    along_m: float
    against_m: float


def boat_track(files: Sequence[SurveyedFile]) -> BoatTrack:
    """Return the track by an INS's files; only one record a second counts.

    The axis of the passes is that of the doubled angles' mean, weighted by the length of the steps (Mardia and Jupp,
    Directional Statistics, 1.6 "axial data"): steps out and back count alike, which would cancel in a mean of
    directions. A step has the east and north components (s sin A, s cos A); the axis is
    A = 1/2 atan2(Σ s sin 2A, Σ s cos 2A), and of its two directions the one with the longer way is returned.
    """
    ins = joined(files)
    rows = np.flatnonzero(np.diff(ins["t_ns"] // SAMPLE_NS, prepend=-1) > 0)
    t_ns = ins["t_ns"][rows]
    latitude, longitude, height = (ins[name][rows] for name in ("latitude_rad", "longitude_rad", "height_m"))
    mean_longitude = float(np.angle(np.exp(1j * longitude).mean()))  # across the date line too
    place = float(latitude.mean()), mean_longitude, float(height.mean())
    points = PoolFrame.at(*place, 0.0).points_from_ecef(ecef_from_geodetic(latitude, longitude, height))
    azimuth, along, against = _passes(t_ns, points[:, :2])
    return BoatTrack(
        latitude_deg=float(np.degrees(place[0])),
        longitude_deg=float(np.degrees(place[1])),
        height_m=place[2],
        mean_ecef_m=ecef_from_geodetic(*(np.array(value) for value in place)),
        azimuth_deg=azimuth,
        along_m=along,
        against_m=against,
    )


def _passes(t_ns: NDArray[np.int64], east_north_m: Array) -> tuple[float | None, float, float]:
    """Return the direction of the passes in degrees, and the ways along and against it, m."""
    seconds = np.diff(t_ns) / NS
    steps = np.diff(east_north_m, axis=0)
    length = np.hypot(*steps.T)
    sailed = (length > SLOWEST_M_S * seconds) & (seconds * NS <= LONGEST_NS)
    if not sailed.any():
        return None, 0.0, 0.0
    length, course = length[sailed], np.arctan2(*steps[sailed].T)
    axis = 0.5 * np.angle((length * np.exp(2j * course)).sum())
    away = np.cos(course - axis)
    within = np.cos(np.radians(WITHIN_DEG))
    along, against = float(length[away >= within].sum()), float(length[away <= -within].sum())
    if against > along:
        axis, along, against = axis + np.pi, against, along
    return float(np.degrees(axis) % 360.0), along, against
