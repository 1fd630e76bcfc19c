"""Samples of a sensor's points, and their places in the pool frame with a trial mount, clock and scale."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import sample_rows
from pipeline.artefacts.streams import point_array
from pipeline.checking.file_survey import Columns, SurveyedFile, Times
from pipeline.checking.track import InsTrack
from pipeline.config.mount import Mount
from pipeline.config.session import SessionConfig
from pipeline.gps_time import NS
from pipeline.maths.sonar.soundings import points_in_mbes
from pipeline.mount import mount_of

Array = NDArray[np.float64]
NAMES = {"laser": "laser points", "mbes": "soundings"}


@dataclass(frozen=True)
class PointSample:
    """A sample of a sensor's points.

    Attributes
    ----------
    sensor : str
        ``laser`` or ``mbes``.
    t_ns : ndarray of int64, shape (n,)
        Times of the points.
    points_m : ndarray, shape (n, 3)
        Points in the sensor's own frame, or in the pool frame if they are ``georeferenced``.
    mount : Mount
        The sensor's coarse mount.
    georeferenced : bool
        Whether another program has placed the points. The mount then has no effect.
    """

    sensor: str
    t_ns: Times
    points_m: Array
    mount: Mount
    georeferenced: bool = False

    def with_pose(self, track: InsTrack) -> "PointSample":
        """Return the sample without the points at times for which no pose of the INS was read."""
        return self._rows(track.trajectory.covers(self.t_ns, NS))

    def in_good_legs(self, track: InsTrack) -> "PointSample":
        """Return the points of the good legs: the boat is in front of the target, on the side to which sensors look."""
        rows = np.zeros(len(self.t_ns), dtype=bool)
        for leg in track.legs:
            if leg.good:
                rows |= (self.t_ns >= leg.start_ns) & (self.t_ns <= leg.end_ns)
        return self._rows(rows)

    def _rows(self, rows: NDArray[np.bool_]) -> "PointSample":
        return PointSample(self.sensor, self.t_ns[rows], self.points_m[rows], self.mount, self.georeferenced)


@dataclass(frozen=True)
class TrialPlacement:
    """Assumptions, other than those of the settings, with which a sensor's points are placed.

    Attributes
    ----------
    mount : Mount or None
        Mount in place of the sample's; None: the sample's.
    clock_ahead_s : float
        How far the sensor's clock is ahead of the INS's.
    scale : float
        Unit of the points in metres.
    """

    mount: Mount | None = None
    clock_ahead_s: float = 0.0
    scale: float = 1.0


AS_GIVEN = TrialPlacement()


def sampled_rows(files: Sequence[SurveyedFile], sensor: str, rows: int) -> Columns:
    """Return a sample of a sensor's rows, spread evenly over its files.

    Parameters
    ----------
    files : Sequence[SurveyedFile]
        The session's files.
    sensor : str
        ``ins``, ``laser`` or ``mbes``.
    rows : int
        About the number of rows to return.

    Returns
    -------
    Columns
        Canonical raw columns; empty if the sensor has no row.
    """
    pieces = [file.columns for file in files if file.sensor == sensor and file.records and file.columns]
    if not pieces:
        return {}
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    return dict(sample_rows(columns, max(1.0, len(columns["t_ns"]) / rows)))


def rows_with_pose(columns: Columns, track: InsTrack) -> Columns:
    """Return the raw rows for which the INS has a pose."""
    rows = track.trajectory.covers(columns["t_ns"], NS) if columns else slice(None)
    return {name: values[rows] for name, values in columns.items()}


def sample_points(
    files: Sequence[SurveyedFile], session: SessionConfig, sensor: str, track: InsTrack, rows: int
) -> PointSample | None:
    """Return a sample of a sensor's points, spread evenly over its files; None if it has no row.

    Parameters
    ----------
    files : Sequence[SurveyedFile]
        The session's files.
    session : SessionConfig
        The session's settings.
    sensor : str
        ``laser`` or ``mbes``.
    track : InsTrack
        The INS's track. Georeferenced points are returned in its pool frame.
    rows : int
        About the number of points to return.
    """
    columns = sampled_rows(files, sensor, rows)
    if not columns:
        return None
    if sensor == "laser":
        georeferenced = session.laser.frame != "laser"
        points = point_array(columns, "m")
        if georeferenced:
            points = track.frame.points_from_ecef(points)
        return PointSample(sensor, columns["t_ns"], points, session.laser.mount, georeferenced)
    mbes = session.sonar
    offset = None if mbes.projector_offset_m is None else np.array(mbes.projector_offset_m)
    points, valid = points_in_mbes(
        columns["two_way_time_s"],
        columns["angle_rad"],
        columns["transmit_tilt_rad"],
        columns["sound_speed_m_s"],
        true_sound_speed_m_s=mbes.sound_speed_m_s,
        projector_offset_m=offset,
    )
    return PointSample(sensor, columns["t_ns"][valid], points[valid], mbes.mount)


def place_points(track: InsTrack, sample: PointSample, placing: TrialPlacement = AS_GIVEN) -> Array:
    """Return a sample's points (n, 3) m in the pool frame; NaN for times without a pose of the INS.

    ``placing`` has no effect on georeferenced points.
    """
    if sample.georeferenced:
        return sample.points_m
    mounted = mount_of(placing.mount or sample.mount)
    body = placing.scale * sample.points_m @ mounted.R_body_from_sensor.T + mounted.lever_arm_body_m
    t_ns = sample.t_ns - round(placing.clock_ahead_s * NS)
    covered = track.trajectory.covers(t_ns, NS)
    placed = np.full(body.shape, np.nan)
    placed[covered] = track.trajectory.points_from_body(t_ns[covered], body[covered])
    return placed
