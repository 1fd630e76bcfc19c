"""Samples of a sensor's points, and where a mount, a clock and a scale put them in the pool."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import sample_rows
from pipeline.artefacts.streams import point_array
from pipeline.checking.file_survey import Columns, Seen, Times
from pipeline.checking.track import Track
from pipeline.config.mount import Mount
from pipeline.config.session import SessionConfig
from pipeline.gps_time import NS
from pipeline.maths.sonar.soundings import points_in_mbes
from pipeline.mount import mount_of

Array = NDArray[np.float64]
NAMES = {"laser": "laser points", "mbes": "soundings"}


@dataclass(frozen=True)
class Sample:
    """Rows of a sensor, points (n, 3) m in its own frame; ``georeferenced``: in the pool frame, placed by others."""

    sensor: str
    t_ns: Times
    points_m: Array
    mount: Mount
    georeferenced: bool = False

    def placeable(self, track: Track) -> "Sample":
        """The rows for which the INS, which may have been read in part, has a pose."""
        return self._of(track.trajectory.covers(self.t_ns, NS))

    def near(self, track: Track) -> "Sample":
        """The rows of legs as a session wants them."""
        rows = np.zeros(len(self.t_ns), dtype=bool)
        for leg in track.legs:
            if leg.good:
                rows |= (self.t_ns >= leg.start_ns) & (self.t_ns <= leg.end_ns)
        return self._of(rows)

    def _of(self, rows: NDArray[np.bool_]) -> "Sample":
        return Sample(self.sensor, self.t_ns[rows], self.points_m[rows], self.mount, self.georeferenced)


def rows_of(files: Sequence[Seen], sensor: str, rows: int) -> Columns:
    """About so many rows of a sensor as they were read, evenly over its files; nothing where it has none."""
    pieces = [seen.columns for seen in files if seen.sensor == sensor and seen.records and seen.columns]
    if not pieces:
        return {}
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    return dict(sample_rows(columns, max(1.0, len(columns["t_ns"]) / rows)))


def placeable(columns: Columns, track: Track) -> Columns:
    """The same of rows as they were read."""
    rows = track.trajectory.covers(columns["t_ns"], NS) if columns else slice(None)
    return {name: values[rows] for name, values in columns.items()}


def sample(
    files: Sequence[Seen], session: SessionConfig, sensor: str, track: Track, rows: int
) -> Sample | None:
    """About so many points of a sensor; None where it has none."""
    columns = rows_of(files, sensor, rows)
    if not columns:
        return None
    if sensor == "laser":
        placed = session.laser.frame != "laser"
        points = point_array(columns, "m")
        if placed:
            points = track.frame.points_from_ecef(points)
        return Sample(sensor, columns["t_ns"], points, session.laser.mount, placed)
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
    return Sample(sensor, columns["t_ns"][valid], points[valid], mbes.mount)


def put(
    track: Track, some: Sample, mount: Mount | None = None, ahead_s: float = 0.0, scale: float = 1.0
) -> Array:
    """Points (n, 3) m in the pool frame; NaN where the INS has no pose. ``ahead_s``: of the sensor's clock.

    Of points that others placed none of the three changes anything.
    """
    if some.georeferenced:
        return some.points_m
    mounted = mount_of(mount or some.mount)
    body = scale * some.points_m @ mounted.R_body_from_sensor.T + mounted.lever_arm_body_m
    t_ns = some.t_ns - round(ahead_s * NS)
    covered = track.trajectory.covers(t_ns, NS)
    placed = np.full(body.shape, np.nan)
    placed[covered] = track.trajectory.points_from_body(t_ns[covered], body[covered])
    return placed
