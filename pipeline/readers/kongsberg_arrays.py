"""Geometry of Kongsberg's two arrays: soundings of tilted sectors, in the receiver's frame ``mbes``.

Beam angles refer to the receiving array, tilts of sectors to the transmitting array. If the latter is mounted the other
way round, a forward tilt in its own frame is an aft tilt in ``mbes``. Travel times are those from the sector's part of
the transmitter to the target and back to the receiver. :mod:`pipeline.readers.kongsberg_installation` reads how the
arrays are mounted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.sonar.crossed_arrays import tilt_in_mbes

Array = NDArray[np.float64]
MIN_PATH_RATIO = 3.0  # least ratio of the path to |t| + |q| of ``in_mbes``; a smaller ratio counts as impossible
_ITERATIONS = 4  # each reduces the error by the factor (distance of the arrays / range)²


@dataclass(frozen=True)
class Transmitter:
    """A transmitting array in its receiver's frame ``mbes``.

    Parameters
    ----------
    axis_mbes
        The array's own forward axis (3,).
    centre_mbes_m
        Position of the array's centre (3,).
    parts_mbes_m
        Positions of the array's parts from its centre (3,), by number of the part.
    """

    axis_mbes: Array
    centre_mbes_m: Array
    parts_mbes_m: Mapping[int, Array] = field(default_factory=dict)

    def axis_and_positions(self, part: int, centre_mbes_m: Sequence[float] | None) -> Array:
        """Return rows (3, 3): the axis, the position of a part, and the position of the centre.

        ``centre_mbes_m`` of session.yaml replaces the transmitter's own centre; None: session.yaml has none.
        """
        centre = self.centre_mbes_m if centre_mbes_m is None else np.array(centre_mbes_m)
        return np.array([self.axis_mbes, centre + self.parts_mbes_m.get(part, np.zeros(3)), centre])


COINCIDENT_TRANSMITTER = Transmitter(np.array([0.0, 1.0, 0.0]), np.zeros(3))  # where no transmitter is known


@dataclass(frozen=True)
class SectorSoundings:
    """Soundings as two arrays recorded them.

    Parameters
    ----------
    angle_rad
        Beam angles (n,), starboard +.
    tilt_rad
        The sectors' tilts (n,) in their transmitters' own frames.
    axis_mbes
        The transmitters' forward axes (n, 3).
    part_mbes_m, centre_mbes_m
        Positions (n, 3) in ``mbes`` of the part that sent and of its transmitter's centre.
    two_way_time_s, sound_speed_m_s
        Time from the part to the target and back to the receiver (n,), and sound speed at the head (n,).
    """

    angle_rad: Array
    tilt_rad: Array
    axis_mbes: Array
    part_mbes_m: Array
    centre_mbes_m: Array
    two_way_time_s: Array
    sound_speed_m_s: Array

    def in_mbes(self, projector_offset_m: Sequence[float] | None) -> tuple[Array, Array, Array]:
        """Return angles, tilts and two-way times (n,) as a head with both arrays in one point would have recorded them.

        This point M has x and z of the receiver's centre, and y of the transmitter's centre. From M the part that sent
        is at t, the receiver at q, and the target at x = r (s, p, -c). At the target, beam and fan meet on the path:

            x_1 = |x - q| sin θ,   (x - t) · axis = |x - t| sin τ,   |x - t| + |x - q| = L = speed · time.

        These equations are solved by iteration, which starts from the fan through M. The results are arcsin s, arcsin p
        and 2 r / speed. If session.yaml has ``projector_offset_m`` o, the time is (|x| + |x - o|) / speed, from which a
        later stage computes the range. The time is NaN if the path is too short. A time of 0 (no detection) stays 0.
        """
        if not self.part_mbes_m.any() and not self.centre_mbes_m.any():
            return self.angle_rad, tilt_in_mbes(self.angle_rad, self.tilt_rad, self.axis_mbes), self.two_way_time_s
        t, q = self.part_mbes_m.copy(), np.zeros_like(self.part_mbes_m)
        t[:, 1] -= self.centre_mbes_m[:, 1]
        q[:, 1] = -self.centre_mbes_m[:, 1]
        path = self.two_way_time_s * self.sound_speed_m_s
        side = np.where(np.abs(self.angle_rad) > np.pi / 2, 1.0, -1.0)
        r, s = path / 2, np.sin(self.angle_rad)
        p = np.sin(tilt_in_mbes(self.angle_rad, self.tilt_rad, self.axis_mbes))
        for _ in range(_ITERATIONS):
            x = r[:, None] * np.column_stack([s, p, side * np.sqrt(np.maximum(1 - s**2 - p**2, 0.0))])
            from_part, to_receiver = np.linalg.norm(x - t, axis=1), np.linalg.norm(x - q, axis=1)
            angle = _on_side(np.arcsin((x - t)[:, 0] / from_part), side)
            along = from_part * np.sin(tilt_in_mbes(angle, self.tilt_rad, self.axis_mbes)) + t[:, 1]
            s, p = to_receiver * np.sin(self.angle_rad) / r, along / r
            r = r + (path - from_part - to_receiver) / 2
        offset_m = np.array(projector_offset_m or (0.0, 0.0, 0.0))
        time_s = (r + np.linalg.norm(x - offset_m, axis=1)) / self.sound_speed_m_s
        time_s[path < MIN_PATH_RATIO * (np.linalg.norm(t, axis=1) + np.linalg.norm(q, axis=1))] = np.nan
        time_s = np.where(self.two_way_time_s == 0, 0.0, time_s)
        intersects = np.isfinite(time_s) & (time_s > 0)
        return (
            np.where(intersects, _on_side(np.arcsin(s), side), self.angle_rad),
            np.where(intersects, np.arcsin(p), self.tilt_rad),
            time_s,
        )


def _on_side(angle_rad: Array, side: Array) -> Array:
    """Return the beam angles (n,), mirrored at the array's plane where ``side`` (n,) is 1 (above the plane)."""
    return np.where(side > 0, np.copysign(np.pi, angle_rad) - angle_rad, angle_rad)
