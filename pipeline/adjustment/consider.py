"""Errors that do not average: with which sigma each parameter that is held may be wrong."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser, Mbes
from pipeline.maths.adjustment.observations import SPEED_M_S
from pipeline.maths.adjustment.parameters import OF_LASER, SIX

Array = NDArray[np.float64]
LEAST_SPAN_M = 0.1  # a cast over less depth covers nothing
Block = tuple[NDArray[np.int64], Array]  # numbers among all unknowns, covariance


def gradient_sigma(mbes: Mbes, depth_m: float | None) -> float:
    """Sigma of the change of the sound speed with depth, (m/s)/m, over the water down to ``depth_m`` (the target's
    lower end; None: as deep as the cast).

    With a cast: its speeds at both ends of the span s that it covers have errors of ``svp_sigma_m_s`` σ of their own
    (what all share is sound_speed_sigma_m_s), so that the slope between them has √(σ² + σ²) / s = √2 σ / s. In the
    share of the depth without a cast the speed is held at the last one's, wrong by the gradient that is considered
    without a cast: both, independent, are added in squares. The default of σ, 0.05 m/s, is of the size that makers
    state for probes that time a pulse (0.02 to 0.06); those that compute from conductivity and temperature state 0.15.
    """
    whole = mbes.sound_speed_gradient_sigma_1_s
    if mbes.svp is None:
        return whole
    first, last = mbes.svp[0][0], mbes.svp[-1][0]
    depth = last if depth_m is None else max(depth_m, LEAST_SPAN_M)
    span = max(min(last, depth) - first, LEAST_SPAN_M)
    return float(np.hypot(np.sqrt(2) * mbes.svp_sigma_m_s / span, max(1 - span / depth, 0.0) * whole))


def considered_of(
    names: Sequence[str],
    laser: Laser,
    mbes: Mbes | None,
    as_built: AsBuilt,
    depth_m: float | None = None,
) -> Array:
    """Sigmas (u,) of the unknowns ``names`` where they are held; zero for the mount and the surfaces. ``depth_m``: how
    far the target's lower end lies below the water."""
    mount = laser.mount_sigma
    six = [float(np.radians(mount.angle_deg))] * 3 + [mount.lever_arm_m] * 3
    if laser.mount_covariance is not None:
        six = [float(np.sqrt(max(row[k], 0.0))) for k, row in enumerate(laser.mount_covariance)]
    sigmas = dict(zip(OF_LASER[:SIX], six, strict=True))
    sigmas |= {"laser_range": laser.range_bias_sigma_m, "laser_latency": laser.latency_sigma_s}
    if mbes is not None:
        sigmas |= {
            "mbes_range": mbes.range_bias_sigma_m,
            "mbes_latency": mbes.latency_sigma_s,
            "sound_speed": mbes.sound_speed_sigma_m_s / SPEED_M_S,
            "sound_speed_gradient": gradient_sigma(mbes, depth_m),
        }
    lean = float(np.radians(as_built.angle_sigma_deg))
    for name in names:
        if name.startswith("wet_"):
            sigmas[name] = as_built.offset_sigma_m if name.endswith("_shift") else lean
    return np.array([sigmas.get(name, 0.0) for name in names])


def correlated(names: Sequence[str], laser: Laser) -> tuple[Block, ...]:
    """Those of the unknowns ``names`` whose errors are not independent: the laser's six, where their covariance is
    given."""
    if laser.mount_covariance is None:
        return ()
    return ((np.array([names.index(name) for name in OF_LASER[:SIX]]), np.array(laser.mount_covariance)),)
