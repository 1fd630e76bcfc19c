"""What the uncertainty of the sonar's mount does to a sounding, by depth and beam angle.

With R_true = Exp(ε) R and l_true = l + δ (body axes), a sounding at x in the sonar's frame lies at R x + l from the
INS, body axes. With v = R x, the vector from the sonar to the sounding, its error is to first order

    e = ε × v + δ = J [ε; δ],    J = [-[v]×, I]    (3, 6),

and its covariance J C Jᵀ, where C is the covariance (6, 6) of [ε; δ]. The boat lies level here, so that body axes are
level axes: x to starboard, y forward, z up. A beam at the angle θ from the vertical, across track, meets a level bottom
d below the sonar at v = d (± tan θ, 0, -1): + to starboard, - to port. Where the head is turned in its bracket does not
matter, because ε and δ are in body axes.

Only the mount counts: errors of position, attitude, sound speed, ranges, clocks and tides come on top.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import skew

Array = NDArray[np.float64]
# A normal error is within so many sigmas with a probability of 95 %: on a line 1.96; in a plane, if equal, 2.45.
# In a plane the square has the distribution 1 - exp(-q² / 2).
ON_A_LINE, IN_A_PLANE = NormalDist().inv_cdf(0.975), float(np.sqrt(-2 * np.log(0.05)))


@dataclass(frozen=True)
class Order:
    """An order of survey, as in IHO S-44, edition 6, table 1: the largest total uncertainties allowed, at 95 %.

    Attributes
    ----------
    name : its name
    a_m : part of the vertical uncertainty that does not vary with the depth
    b : part that varies, by depth
    horizontal_m : part of the horizontal uncertainty (THU) that does not vary with the depth
    horizontal_by_depth : part that varies, by depth
    """

    name: str
    a_m: float
    b: float
    horizontal_m: float
    horizontal_by_depth: float = 0.0

    def vertical_m(self, depth_m: float) -> float:
        """Return the largest vertical uncertainty (TVU) at a depth: √(a² + (b d)²), section 3.2.3 of S-44."""
        return float(np.hypot(self.a_m, self.b * depth_m))

    def horizontal_at_m(self, depth_m: float) -> float:
        """Return the largest horizontal uncertainty (THU) at a depth."""
        return self.horizontal_m + self.horizontal_by_depth * depth_m


SPECIAL, EXCLUSIVE = Order("Special Order", 0.25, 0.0075, 2.0), Order("Exclusive Order", 0.15, 0.0075, 1.0)
ORDERS = (SPECIAL, EXCLUSIVE)  # those shown beside each other


@dataclass(frozen=True)
class SoundingUncertainty:
    """Uncertainty of a sounding at 95 %, m, from the mount alone: vertical, and radius of a horizontal circle."""

    vertical_m: float
    horizontal_m: float


def sounding_uncertainty(covariance: Array, depth_m: float, angle_deg: float) -> SoundingUncertainty:
    """Return the uncertainty of a sounding, on the side, port or starboard, where it is larger.

    At 95 %, as S-44 has it: 1.96 sigmas in height, 2.45 in the plane. The radius of the horizontal circle is 2.45 times
    the largest standard deviation in any direction, so that at least 95 % of the errors lie within it.

    Parameters
    ----------
    covariance : Array
        (6, 6): of the mount's rotation about body x, y, z (rad) and lever arm (m), systematic errors included.
    depth_m : float
        Depth of the bottom below the sonar.
    angle_deg : float
        Angle of the beam from the vertical, across track.
    """
    sides = [_one_side(covariance, depth_m, sign * angle_deg) for sign in (1.0, -1.0)]
    return SoundingUncertainty(max(one.vertical_m for one in sides), max(one.horizontal_m for one in sides))


def _one_side(covariance: Array, depth_m: float, angle_deg: float) -> SoundingUncertainty:
    v = depth_m * np.array([np.tan(np.radians(angle_deg)), 0.0, -1.0])
    J = np.hstack([-skew(v), np.eye(3)])
    of_sounding = J @ covariance @ J.T
    largest = float(np.linalg.eigvalsh(of_sounding[:2, :2])[-1])
    return SoundingUncertainty(
        vertical_m=ON_A_LINE * float(np.sqrt(of_sounding[2, 2])),
        horizontal_m=IN_A_PLANE * float(np.sqrt(max(largest, 0.0))),
    )


def table_of_soundings(
    covariance: Array, depths_m: Sequence[float], angles_deg: Sequence[float]
) -> list[list[SoundingUncertainty]]:
    """Return the uncertainties by depth, then by angle; ``covariance`` as in :func:`sounding_uncertainty`."""
    return [[sounding_uncertainty(covariance, depth, angle) for angle in angles_deg] for depth in depths_m]
