"""How much of a survey's allowed uncertainty the sonar's mount takes, and what that allows each of its parameters.

A survey of an order may be wrong by TVU in height and THU in the plane (95 %), both by depth. The mount alone makes a
sounding at the depth d and the angle θ wrong by u(d, θ) (:mod:`~pipeline.maths.survey.sounding_uncertainty`). Its share
is the largest of u / TVU and of u / THU over all depths down to the stated one and all angles within the swath:

* over the angles it is largest at the edge of the swath, for both variances are convex in tan θ;
* over the depths there is no such rule: the share of z is largest in shallow water, that of roll in deep water, and a
  correlation of both can bring the largest between. So ``DEPTHS`` depths are tried, from 0 on.

The share is linear in the sigma of a parameter that is wrong alone. So the sigma that takes a given share follows from
the share that a sigma of one takes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.maths.survey.sounding_uncertainty import Order, sounding_uncertainty

Array = NDArray[np.float64]
DEPTHS = 41  # depths tried, the surface and the stated one among them


@dataclass(frozen=True)
class Share:
    """The largest share that the mount takes of TVU or THU, and where: depth, and both uncertainties at 95 % (m)."""

    direction: str  # "height" or "the plane"
    share: float
    depth_m: float
    by_mount_m: float
    allowed_m: float


def largest_share(covariance: Array, order: Order, depth_m: float, swath_deg: float) -> Share:
    """Return the largest share that the mount takes of what an order allows.

    Parameters
    ----------
    covariance
        (6, 6): of the mount's rotation about body x, y, z (rad) and lever arm (m), systematic errors included.
    order
        The order of survey.
    depth_m
        The largest depth below the sonar.
    swath_deg
        The largest angle of a beam from the vertical, across track.
    """
    shares = []
    for depth in np.linspace(0.0, depth_m, DEPTHS).tolist():
        one = sounding_uncertainty(covariance, depth, swath_deg)
        vertical, horizontal = order.vertical_m(depth), order.horizontal_at_m(depth)
        shares.append(Share("height", one.vertical_m / vertical, depth, one.vertical_m, vertical))
        shares.append(Share("the plane", one.horizontal_m / horizontal, depth, one.horizontal_m, horizontal))
    return max(shares, key=lambda share: share.share)


def sigmas_alone(order: Order, depth_m: float, swath_deg: float, share: float) -> Array:
    """Return the sigma (6,) of each mount parameter, rad and m, that alone takes a share of what an order allows."""
    alone = np.zeros(N_MOUNT)
    for k in range(N_MOUNT):
        covariance = np.zeros((N_MOUNT, N_MOUNT))
        covariance[k, k] = 1.0
        alone[k] = share / largest_share(covariance, order, depth_m, swath_deg).share
    return alone
