"""Errors that do not average: with which sigma each parameter that is held may be wrong."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline import config
from pipeline.maths.observations import SPEED_M_S
from pipeline.maths.unknowns import OF_LASER, SIX

Array = NDArray[np.float64]
Block = tuple[NDArray[np.int64], Array]  # numbers among all unknowns, covariance


def considered_of(
    names: Sequence[str], laser: config.Laser, mbes: config.Mbes | None, as_built: config.AsBuilt
) -> Array:
    """Sigmas (u,) of the unknowns ``names`` where they are held; zero for the mount and the surfaces."""
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
            "sound_speed_gradient": mbes.sound_speed_gradient_sigma_1_s if mbes.svp is None else 0.0,  # a cast tells it
        }
    lean = float(np.radians(as_built.angle_sigma_deg))
    for name in names:
        if name.startswith("wet_"):
            sigmas[name] = as_built.offset_sigma_m if name.endswith("_shift") else lean
    return np.array([sigmas.get(name, 0.0) for name in names])


def correlated(names: Sequence[str], laser: config.Laser) -> tuple[Block, ...]:
    """Those of the unknowns ``names`` whose errors are not independent: the laser's six, where their covariance is
    given."""
    if laser.mount_covariance is None:
        return ()
    return ((np.array([names.index(name) for name in OF_LASER[:SIX]]), np.array(laser.mount_covariance)),)
