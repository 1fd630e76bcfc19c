"""The INS's track at the target: the legs past it, and the sensors that ran in each leg."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_survey import Columns, SurveyedFile
from pipeline.config.pool import Ingest, TargetPlace
from pipeline.config.session import SessionConfig
from pipeline.gps_time import NS
from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic
from pipeline.maths.geometry.passes import abeam, estimate_azimuth, find_passes
from pipeline.maths.geometry.trajectory import GeodeticPoses, Trajectory, poses_in_pool
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of

Array = NDArray[np.float64]
Times = NDArray[np.int64]
NEAR_M = 30.0  # largest distance of a leg from the target's front
SHORTEST_M = 1.0  # shortest leg along the target
STARBOARD_ONLY = 0.5  # the part to starboard of a sonar's line of sight, from which on it hears nothing to port
BIN_NS = NS
MOST_RECORDS = 400_000  # INS records; twice as many or more are thinned
NAMES = ("latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")


@dataclass(frozen=True)
class Leg:
    """The part of a pass in which the boat is beside the target.

    Attributes
    ----------
    start_ns, end_ns : int
        First and last time.
    distance_m : float
        Median distance of the INS from the target's front; positive in front of it, negative behind it.
    speed_m_s : float
        Mean speed along the target.
    heading_swing_deg : float
        Standard deviation of the heading.
    height_m : float
        Median height of the INS in the pool frame.
    starboard : bool
        Whether the target is to starboard.
    ran : Mapping[str, float]
        By sensor the share of the leg's time in which it ran.
    astern : bool
        Whether the boat moves against its heading.
    sees_port : bool
        Whether the sensors may see a target to port.
    """

    start_ns: int
    end_ns: int
    distance_m: float
    speed_m_s: float
    heading_swing_deg: float
    height_m: float
    starboard: bool
    ran: Mapping[str, float]
    astern: bool = False
    sees_port: bool = False

    @property
    def good(self) -> bool:
        """Whether the boat is in front of the target and has it on a side to which the sensors look."""
        return (self.starboard or self.sees_port) and self.distance_m > 0


@dataclass(frozen=True)
class InsTrack:
    """The INS's poses in the pool frame, and the legs past the target."""

    frame: PoolFrame
    trajectory: Trajectory
    legs: tuple[Leg, ...]


def joined(files: Sequence[SurveyedFile]) -> Columns:
    """Return the records of all INS files in order of time, without repeated times; thinned if they are many."""
    pieces = [file.columns for file in files if file.sensor == "ins" and file.records]
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in ("t_ns", *NAMES)}
    _, first = np.unique(columns["t_ns"], return_index=True)
    rows = first[:: max(1, len(first) // MOST_RECORDS)]
    return {name: values[rows] for name, values in columns.items()}


def frame_of(ins: Columns, place: TargetPlace) -> PoolFrame | None:
    """Return the pool frame; None if no azimuth is configured and none follows from the track."""
    at = (np.radians(place.origin.latitude_deg), np.radians(place.origin.longitude_deg), place.origin.height_m)
    if place.azimuth_deg is not None:
        return PoolFrame.at(*at, float(np.radians(place.azimuth_deg)))
    points = PoolFrame.at(*at, 0.0).points_from_ecef(ecef_from_geodetic(*(ins[name] for name in NAMES[:3])))
    azimuth = estimate_azimuth(points[:, 0], points[:, 1], ins["azimuth_rad"])
    return None if azimuth is None else PoolFrame.at(*at, azimuth)


def sees_port(session: SessionConfig) -> bool:
    """Return whether the sonar, by its coarse mount, hears a target to port: its head looks down, or to port.

    A laser may look to any side: its files do not say. A head that should look to starboard and has the wrong sign of
    roll is found by the points.
    """
    if session.mbes is None:
        return True
    looks = -mount_of(session.mbes.mount).R_body_from_sensor[:, 2]  # of the head at roll 0: straight down
    return bool(looks[0] < STARBOARD_ONLY)


def track_of(
    ins: Columns,
    frame: PoolFrame,
    model: TargetModel,
    files: Sequence[SurveyedFile],
    settings: Ingest,
    to_port: bool = False,
) -> InsTrack:
    """Return the INS's track and its legs past the target.

    Parameters
    ----------
    ins : Columns
        The INS's records.
    frame : PoolFrame
        The pool frame.
    model : TargetModel
        The target.
    files : Sequence[SurveyedFile]
        The session's files. Their times show which sensors ran in each leg.
    settings : Ingest
        Limits that end a pass.
    to_port : bool
        Whether the sensors may see a target to port.
    """
    positions, R = poses_in_pool(frame, GeodeticPoses(**{name: ins[name] for name in NAMES}))
    t_ns = ins["t_ns"]
    low, high = model.bounds()
    reach, max_gap_ns = float(max(-low[1], high[1])), round(settings.max_gap_s * NS)
    coarseness_ns = max((file.coarseness_ns for file in files if file.sensor == "ins"), default=0.0)
    longest_gap_ns = max(max_gap_ns, round(coarseness_ns))
    legs = []
    for start, end in find_passes(t_ns, positions[:, 1], t_ns, longest_gap_ns, settings.reversal_m):
        x, y = positions[:, 0], positions[:, 1]
        rows = np.flatnonzero((t_ns >= start) & (t_ns <= end) & (np.abs(y) <= reach) & (np.abs(x) <= NEAR_M))
        if len(rows) > 1 and np.ptp(y[rows]) >= min(SHORTEST_M, reach):
            legs.append(_leg(t_ns[rows], positions[rows], R[rows], files, to_port))
    return InsTrack(frame, Trajectory.build(t_ns, positions, R), tuple(legs))


def _leg(t_ns: Times, positions: Array, R: Array, files: Sequence[SurveyedFile], to_port: bool) -> Leg:
    start, end = int(t_ns[0]), int(t_ns[-1])
    away = float(np.median(positions[:, 0]))
    ahead = R[:, :2, 1]  # level part of the body's y axis
    heading = np.arctan2(ahead[:, 0], ahead[:, 1])
    forward = float(np.median(ahead[:, 1])) > 0
    run = float(positions[-1, 1] - positions[0, 1])
    by_sensor = {sensor: [file for file in files if file.sensor == sensor] for sensor in ("laser", "mbes")}
    return Leg(
        start_ns=start,
        end_ns=end,
        distance_m=-away,
        speed_m_s=abs(run) / max((end - start) / NS, 1e-3),
        heading_swing_deg=float(np.degrees(np.std(np.unwrap(heading)))),
        height_m=float(np.median(positions[:, 2])),
        starboard=forward == (away < 0),
        ran={sensor: _ran(start, end, of_sensor) for sensor, of_sensor in by_sensor.items()},
        astern=forward != (run > 0),
        sees_port=to_port,
    )


def askew_deg(track: InsTrack) -> float | None:
    """Return the clockwise angle (degrees, within ±180) from the target's +y to the direction in which the boat sailed.

    Only records count in which target.origin is near and abeam to starboard; if there is none, those to port, and
    against +y. The direction is the mean heading or the course made good, whichever is nearer to +y. The angle is 0 if
    the two lie on different sides of +y, and None if no record counts.
    """
    x, y = track.trajectory.positions_m[:, :2].T
    ahead = track.trajectory.R_frame_from_body[:, :2, 1]
    heading = np.arctan2(ahead[:, 0], ahead[:, 1])
    starboard = abeam(x, y, heading)
    near, sense = (starboard, 1.0) if starboard.any() else (abeam(x, y, heading, to_port=True), -1.0)
    if not near.any():
        return None
    steps = np.flatnonzero(near[1:] & near[:-1])
    headed = float(np.arctan2(*(sense * ahead[near].sum(axis=0))))
    gone = sense * np.array([(along[steps + 1] - along[steps]).sum() for along in (x, y)])
    went = float(np.arctan2(*gone))
    return float(np.degrees(min(headed, went, key=abs))) if headed * went > 0 else 0.0


def _ran(start: int, end: int, files: Sequence[SurveyedFile]) -> float:
    """Return the share of the time from ``start`` to ``end`` in which a sensor ran.

    The time is divided into bins of one second, or of the files' coarseness if they were read in pieces. The sensor ran
    in a bin if the bin has a record.
    """
    known = [file for file in files if len(file.epochs_ns)]
    width = max([BIN_NS, *(round(file.coarseness_ns) for file in known)])
    bins = max(1, (end - start) // width)
    t_ns = np.concatenate([np.empty(0, np.int64), *(file.epochs_ns for file in known)])
    inside = t_ns[(t_ns >= start) & (t_ns < start + bins * width)]
    return float(len(np.unique((inside - start) // width)) / bins)
