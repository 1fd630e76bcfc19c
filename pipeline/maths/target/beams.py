"""Rays of points in the target frame, and the footprints of finite beams on planes."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import block
from pipeline.maths.kernels.labels import rays

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TargetBeams:
    """Rays in the target frame.

    Parameters
    ----------
    directions
        Unit vectors (n, 3).
    ranges_m
        Measured ranges (n,).
    half_widths
        Vectors of the half widths of finite beams, across and along, (n, 3) each, for one metre of range: tan(half
        width) · unit vector normal to the ray.
    near_m
        Ranges, across and along, within which a beam is as wide as there: its array's near field.
    stray
        The beam may stray by this many times the half width across.
    """

    directions: Array
    ranges_m: Array
    half_widths: tuple[Array, ...] = ()
    near_m: tuple[float, ...] = (0.0, 0.0)
    stray: float = 0.0

    @classmethod
    def head_on(cls, count: int) -> "TargetBeams":
        """Return beams with unknown rays, for averaged points: every face counts as seen from its front."""
        return cls(np.zeros((count, 3)), np.zeros(count))

    @classmethod
    def from_origins(cls, origins_m: Array, points_m: Array) -> "TargetBeams":
        """Return round beams from origins (n, 3) m to points (n, 3) m."""
        direction, range_m = np.empty((3, len(points_m))), np.empty(len(points_m))
        rays(block(origins_m.T), block(points_m.T), direction, range_m)
        return cls(direction.T, range_m)

    def corners(self, rows: NDArray[np.int64], beyond_m: float = 0.0) -> Iterator[Array]:
        """Yield rays (n, 3) along each of the four corners of these beams; across, the corners include the stray.

        Parameters
        ----------
        rows
            Numbers (n,) of the beams.
        beyond_m
            So much farther out is each corner at the measured range, both across and along.
        """
        ranges_m, halves = self.ranges_m[rows], []
        for half, near, stray in zip(self.half_widths, self.near_m, (self.stray, 0.0), strict=True):
            width = np.linalg.norm(half[rows], axis=1)
            times = np.maximum(1.0, near / ranges_m) + stray + beyond_m / (ranges_m * width)
            halves.append(times[:, None] * half[rows])
        for side, end in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            yield self.directions[rows] + side * halves[0] + end * halves[1]

    def spreads(self, rows: NDArray[np.int64], normal: Array, reached_m: Array) -> tuple[Array, ...]:
        """Return the half axes, (n, 3) m each, of the footprints on a plane.

        A tilt of a ray u by a small angle towards t moves its intersection with the plane by
        w = h - u (n · h) / (n · u), h = range · angle · t. This is h plus the part along the ray that leads back to
        the plane (n · w = 0). On a face grazed at 10° one axis is six times longer than the beam is wide.

        Parameters
        ----------
        rows
            Numbers (n,) of the beams.
        normal
            Unit normal (3,) of the plane.
        reached_m
            Ranges (n,) at which the rays meet the plane.
        """
        halves = zip(self.half_widths, self.near_m, strict=False)
        return tuple(self._moved(rows, normal, np.maximum(reached_m, near), half) for half, near in halves)

    def stray_on(self, rows: NDArray[np.int64], normal: Array, reached_m: Array) -> Array:
        """Return the vectors (n, 3) m by which footprints on a plane may stray; parameters as of ``spreads``."""
        return self._moved(rows, normal, self.stray * reached_m, self.half_widths[0])

    def _moved(self, rows: NDArray[np.int64], normal: Array, times: Array, half_widths: Array) -> Array:
        """Return how far on a plane (n, 3) the rays meet it if they turn by some half widths (n,) m."""
        directions, h = self.directions[rows], times[:, None] * half_widths[rows]
        return np.asarray(h - directions * ((h @ normal) / (directions @ normal))[:, None])
