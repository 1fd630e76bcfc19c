"""The step of a sonar's angles that brings passes over a bottom together: the patch test as one least-squares problem.

A sounding lies at X = p + R (s + l): p and R (body to level frame) the pose, l the lever arm, s the sounding from the
head in body axes. A small rotation ε of the mount, body axes, turns s into s + ε × s, and moves X by (R ε) × u with u =
R s, the vector from the head to the sounding in the level frame. On a piece of bottom z = α + a x + b y the sounding's
misfit is v = z - a x - b y - α, and with m = (-a, -b, 1)

    dv = m · ((R ε) × u) = (u × m) · (R ε) = g · ε,        g = Rᵀ (u × m).

α, a, b of each piece are unknown: of v and of g only what no plane over the piece takes up counts. So a level bottom
tells of roll by u square to the pass, which changes its sign with the pass, of pitch in the same way by u along it, and
of yaw nothing: g of yaw is u × m along the vertical, which is the slope times the distance. The lever arm is taken as
known, and poses as true: the step leads near enough for an adjustment. A piece that fits much worse than most
(something stood there in one pass) does not count.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CUT, ROUNDS = 3.0, 4  # RMS beyond which a sounding does not count on its piece, and a piece not among all; of these


@dataclass(frozen=True)
class PieceSoundings:
    """Soundings on one piece of bottom, level frame, m: places (n, 3), vectors from the head (n, 3), R (n, 3, 3)."""

    places_m: Array
    from_head_m: Array
    R_level_from_body: Array


def patch_step(pieces: Iterable[PieceSoundings], noise_m: float, known_rad: float, turned_rad: Array) -> Array:
    """Return the rotation ε (3,) rad, body axes, by which the mount is to be turned further.

    Parameters
    ----------
    pieces
        Soundings of several passes, piece by piece.
    noise_m
        Standard deviation of what passes differ by on a piece, whatever the angles: a piece is one observation.
    known_rad
        That of each angle, as known beforehand: it holds an angle of which the soundings tell nothing.
    turned_rad
        Rotation vector (3,) by which the mount has been turned from what is known beforehand.
    """
    sums = np.array([_sums(piece) for piece in pieces])
    beforehand = np.column_stack([np.eye(3), turned_rad]) * (noise_m / known_rad) ** 2
    use = np.ones(len(sums), dtype=bool)
    for _ in range(ROUNDS):
        of_all = beforehand + sums[use, :3].sum(axis=0)
        step = -np.linalg.solve(of_all[:, :3], of_all[:, 3])
        both = np.append(step, 1.0)
        squares = np.einsum("pij,i,j->p", sums, both, both)
        use = squares <= CUT**2 * np.median(squares)
    return np.asarray(step)


def _sums(piece: PieceSoundings) -> Array:
    """Return the mean products (4, 4) of g and v on a piece, without what a plane takes up."""
    about_mean, height = piece.places_m[:, :2] - piece.places_m[:, :2].mean(axis=0), piece.places_m[:, 2]
    plane = np.column_stack([about_mean, np.ones(len(height))])
    off = height - plane @ np.linalg.lstsq(plane, height, rcond=None)[0]
    use = np.abs(off) <= CUT * np.sqrt(np.mean(off**2))
    plane, height = plane[use], height[use]
    a, b, _ = np.linalg.lstsq(plane, height, rcond=None)[0]
    turned = np.cross(piece.from_head_m[use], np.array([-a, -b, 1.0]))
    both = np.column_stack([np.einsum("nji,nj->ni", piece.R_level_from_body[use], turned), height])
    left = both - plane @ np.linalg.lstsq(plane, both, rcond=None)[0]
    return np.asarray(left.T @ left / len(left))
