"""The INS's track by the target: legs along it, and what ran in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_survey import Columns, Seen
from pipeline.config.pool import Ingest, TargetPlace
from pipeline.gps_time import NS
from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic
from pipeline.maths.geometry.passes import abeam, estimate_azimuth, find_passes
from pipeline.maths.geometry.trajectory import GeodeticPoses, Trajectory, poses_in_pool
from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]
Times = NDArray[np.int64]
NEAR_M = 30.0  # from the target: a leg past it
SHORTEST_M = 1.0
BIN_NS = NS
MOST_RECORDS = 400_000  # of the INS that are placed; more are thinned
NAMES = ("latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")


@dataclass(frozen=True)
class Leg:
    """The boat past the target once: while it is abeam of it. ``astern``: against its own heading; ``ran``: by sensor
    the share of that time in which it ran."""

    start_ns: int
    end_ns: int
    distance_m: float  # + where the target's front looks
    speed_m_s: float
    heading_swing_deg: float
    height_m: float  # of the INS in the target frame
    starboard: bool
    ran: Mapping[str, float]
    astern: bool = False

    @property
    def good(self) -> bool:
        """As a session wants it: in front of the target, which is to starboard."""
        return self.starboard and self.distance_m > 0


@dataclass(frozen=True)
class Track:
    frame: PoolFrame
    trajectory: Trajectory
    legs: tuple[Leg, ...]


def joined(files: Sequence[Seen]) -> Columns:
    """All records of the INS in order of time, each time once, thinned where they are many."""
    pieces = [seen.columns for seen in files if seen.sensor == "ins" and seen.records]
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in ("t_ns", *NAMES)}
    _, first = np.unique(columns["t_ns"], return_index=True)
    rows = first[:: max(1, len(first) // MOST_RECORDS)]
    return {name: values[rows] for name, values in columns.items()}


def frame_of(ins: Columns, place: TargetPlace) -> PoolFrame | None:
    """The pool frame; None where its azimuth is to follow from the track, and does not."""
    at = (np.radians(place.origin.latitude_deg), np.radians(place.origin.longitude_deg), place.origin.height_m)
    if place.azimuth_deg is not None:
        return PoolFrame.at(*at, float(np.radians(place.azimuth_deg)))
    points = PoolFrame.at(*at, 0.0).points_from_ecef(ecef_from_geodetic(*(ins[name] for name in NAMES[:3])))
    azimuth = estimate_azimuth(points[:, 0], points[:, 1], ins["azimuth_rad"])
    return None if azimuth is None else PoolFrame.at(*at, azimuth)


def track_of(
    ins: Columns, frame: PoolFrame, model: TargetModel, files: Sequence[Seen], settings: Ingest
) -> Track:
    positions, R = poses_in_pool(frame, GeodeticPoses(**{name: ins[name] for name in NAMES}))
    t_ns = ins["t_ns"]
    low, high = model.bounds()
    reach, max_gap_ns = float(max(-low[1], high[1])), round(settings.max_gap_s * NS)
    coarse = max((seen.coarseness_ns for seen in files if seen.sensor == "ins"), default=0.0)
    legs = []
    for start, end in find_passes(t_ns, positions[:, 1], t_ns, max(max_gap_ns, round(coarse)), settings.reversal_m):
        x, y = positions[:, 0], positions[:, 1]
        rows = np.flatnonzero((t_ns >= start) & (t_ns <= end) & (np.abs(y) <= reach) & (np.abs(x) <= NEAR_M))
        if len(rows) > 1 and np.ptp(y[rows]) >= min(SHORTEST_M, reach):
            legs.append(_leg(t_ns[rows], positions[rows], R[rows], files))
    return Track(frame, Trajectory.build(t_ns, positions, R), tuple(legs))


def _leg(t_ns: Times, positions: Array, R: Array, files: Sequence[Seen]) -> Leg:
    start, end = int(t_ns[0]), int(t_ns[-1])
    away = float(np.median(positions[:, 0]))
    ahead = R[:, :2, 1]  # of the body's y axis, level
    heading = np.arctan2(ahead[:, 0], ahead[:, 1])
    forward = float(np.median(ahead[:, 1])) > 0
    run = float(positions[-1, 1] - positions[0, 1])
    return Leg(
        start,
        end,
        -away,
        abs(run) / max((end - start) / NS, 1e-3),
        float(np.degrees(np.std(np.unwrap(heading)))),
        float(np.median(positions[:, 2])),
        forward == (away < 0),
        {sensor: _ran(start, end, [seen for seen in files if seen.sensor == sensor]) for sensor in ("laser", "mbes")},
        forward != (run > 0),
    )


def askew_deg(track: Track) -> float | None:
    """By how much the boat headed and went to the right of the target's +y while it had target.origin to starboard and
    near, within ±180 degrees: the lesser of the two, none where they do not agree. None where it never had."""
    x, y = track.trajectory.positions_m[:, :2].T
    ahead = track.trajectory.R_frame_from_body[:, :2, 1]
    near = abeam(x, y, np.arctan2(ahead[:, 0], ahead[:, 1]))
    if not near.any():
        return None
    steps = np.flatnonzero(near[1:] & near[:-1])
    headed = float(np.arctan2(*ahead[near].sum(axis=0)))
    went = float(np.arctan2((x[steps + 1] - x[steps]).sum(), (y[steps + 1] - y[steps]).sum()))
    return float(np.degrees(min(headed, went, key=abs))) if headed * went > 0 else 0.0


def _ran(start: int, end: int, files: Sequence[Seen]) -> float:
    """Share of a time in which a sensor ran, second by second; of files read in pieces, from one to the next."""
    known = [seen for seen in files if len(seen.epochs_ns)]
    width = max([BIN_NS, *(round(seen.coarseness_ns) for seen in known)])
    bins = max(1, (end - start) // width)
    t_ns = np.concatenate([np.empty(0, np.int64), *(seen.epochs_ns for seen in known)])
    inside = t_ns[(t_ns >= start) & (t_ns < start + bins * width)]
    return float(len(np.unique((inside - start) // width)) / bins)
