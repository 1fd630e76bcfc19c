"""A-priori errors of parameters: systematic errors, which enter the total covariance.

The points tell something of errors of the wet faces, of biases that go with the incidence, of the transmitter's place,
and of a sound speed that changes with depth. These parameters are estimated; their a-priori sigma is prior information
(:func:`known_parameters`). All others are fixed. This module provides only the errors. The module
pipeline/maths/adjustment/solution.py computes the total covariance C + S Q Sᵀ: ``ConsiderErrors.covariance`` returns Q,
and ``Solution.total_covariance`` the sum.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.wet_errors import wet_errors
from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser, Mbes
from pipeline.maths.adjustment.design_matrix import SPEED_M_S
from pipeline.maths.adjustment.parameters import LASER_PARAMETERS, PROJECTOR_PARAMETERS, State, of_head
from pipeline.maths.adjustment.pseudo_observations import ParameterPrior
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.mount_parameters import N_MOUNT

Array = NDArray[np.float64]
LEAST_SPAN_M = 0.1  # smallest depth and smallest span that count
LASER_MOUNT = LASER_PARAMETERS[:N_MOUNT]
ESTIMATED_WITH_PRIOR = (  # beginnings of the names
    "wet_", "mbes_range", "mbes_incidence", "mbes_level_range", "laser_incidence", "projector_",
    "sound_speed_gradient",
)  # fmt: skip


def gradient_sigma(mbes: Mbes, depth_m: float | None) -> float:
    """Return the sigma of the change of the sound speed with depth, (m/s)/m.

    Without a cast it is the sigma in session.yaml. A cast covers a span s of the depth. Its speeds at both ends have
    independent errors with the sigma σ = ``svp_sigma_m_s``, so the slope between them has the sigma √(σ² + σ²) / s =
    √2 σ / s. (``sound_speed_sigma_m_s`` is the error common to all speeds.) Outside the span the speed is constant, and
    that share of the depth has the sigma without a cast. The two parts are independent, so their squares are added.

    The default of σ is 0.05 m/s. Makers state 0.02 to 0.06 m/s for probes that measure the travel time of a pulse, and
    0.15 m/s for probes that compute the speed from conductivity and temperature.

    Parameters
    ----------
    mbes : Mbes
        The session's sonar.
    depth_m : float or None
        Depth of the target's lower end below the water; None: the depth of the cast's last speed.
    """
    without_cast = mbes.sound_speed_gradient_sigma_1_s
    if mbes.svp is None:
        return without_cast
    first, last = mbes.svp[0][0], mbes.svp[-1][0]
    depth = last if depth_m is None else max(depth_m, LEAST_SPAN_M)
    span = max(min(last, depth) - first, LEAST_SPAN_M)
    return float(np.hypot(np.sqrt(2) * mbes.svp_sigma_m_s / span, max(1 - span / depth, 0.0) * without_cast))


def laser_errors(names: Sequence[str], laser: Laser, as_built: AsBuilt) -> ConsiderErrors:
    """Return the a-priori errors of the laser and of single faces, and zero for all other parameters.

    If the session states a covariance of the laser's mount, it is one block.

    Parameters
    ----------
    names : sequence of str
        Names of all parameters.
    laser : Laser
        The session's laser.
    as_built : AsBuilt
        Sigmas of the faces.
    """
    mount, covariance = laser.mount_sigma, laser.mount_covariance
    mount_sigmas = [float(np.radians(mount.angle_deg))] * 3 + [mount.lever_arm_m] * 3
    if covariance is not None:
        mount_sigmas = [float(np.sqrt(max(row[k], 0.0))) for k, row in enumerate(covariance)]
    sigmas = dict(zip(LASER_MOUNT, mount_sigmas, strict=True))
    sigmas |= {"laser_range": laser.range_bias_sigma_m, "laser_latency": laser.latency_sigma_s}
    sigmas["laser_incidence"] = laser.incidence_bias_sigma_m
    sigmas |= {name: as_built.face_sigma_m for name in names if name.startswith("face_")}
    blocks = []
    if covariance is not None and LASER_MOUNT[0] in names:
        blocks = [(np.array([names.index(name) for name in LASER_MOUNT]), np.array(covariance))]
    return ConsiderErrors(np.array([sigmas.get(name, 0.0) for name in names]), blocks)


def sonar_errors(
    names: Sequence[str],
    laser: Laser,
    heads: Mapping[str, Mbes],
    as_built: AsBuilt,
    outward: Mapping[str, float],
    depth_m: float | None = None,
) -> ConsiderErrors:
    """Return the a-priori errors for a calibration of the sonar: zero for the sonar's mounts and the surfaces.

    The heads of a sonar are in one water, whose errors are therefore common to them. All other errors are each head's
    own: its clock, its detection, its transmitter's place, the water at its arrays.

    ``sound_speed`` is an error common to the column and to the water at the arrays (of the probe, or of the cast as a
    whole), ``steering_speed`` the difference of the two. They are independent, each with the sigma σ =
    ``sound_speed_sigma_m_s``. So the speed that steers has the sigma √2 σ, and its correlation with the column's is
    1/√2.

    Parameters
    ----------
    names : sequence of str
        Names of all parameters.
    laser : Laser
        The session's laser.
    heads : mapping of Mbes
        The heads of the sonar by name, the first one first.
    as_built : AsBuilt
        Sigmas of the wet faces against the dry ones.
    outward : mapping of float
        Which way the faces of each family look (:func:`pipeline.adjustment.wet_errors.outward_of`).
    depth_m : float, optional
        Depth of the target's lower end below the water.
    """
    errors, wet = laser_errors(names, laser, as_built), wet_errors(names, as_built, as_built.bow_sigma_m, outward)
    (first, mbes), *_ = heads.items()
    of_water = {
        "sound_speed": mbes.sound_speed_sigma_m_s / SPEED_M_S,
        "sound_speed_gradient": gradient_sigma(mbes, depth_m),
    }
    of_heads = {"" if head == first else head: _own_errors(block) for head, block in heads.items()}
    sigmas = []
    for name, sigma in zip(names, (errors.sigmas + wet.sigmas).tolist(), strict=True):
        head, own = of_head(name)
        sigmas.append({**of_heads[head], **of_water}.get(own, sigma))
    return ConsiderErrors(np.array(sigmas), [*errors.blocks, *wet.blocks])


def _own_errors(mbes: Mbes) -> dict[str, float]:
    """Return the sigmas of the errors that are a head's own, by the names of the first head's parameters."""
    return {
        "mbes_range": mbes.range_bias_sigma_m,
        "mbes_latency": mbes.latency_sigma_s,
        "steering_speed": mbes.sound_speed_sigma_m_s / SPEED_M_S,
        "mbes_incidence": mbes.incidence_bias_sigma_m,
        "mbes_level_range": mbes.level_bias_sigma_m,
        **dict.fromkeys(PROJECTOR_PARAMETERS, mbes.projector_sigma_m),
    }


def known_parameters(state: State, errors: ConsiderErrors, free: Sequence[str]) -> ParameterPrior | None:
    """Return the prior information of the additional parameters that are estimated: zero, with their a-priori sigmas.

    A parameter whose sigma is zero is known exactly, and stays fixed. None if there is no such parameter.

    Parameters
    ----------
    state : State
        A state, for the names of the parameters, in which they are zero.
    errors : ConsiderErrors
        The a-priori errors.
    free : sequence of str
        Parameters that are estimated without prior information.
    """
    numbers = [
        number
        for number, (_, name) in enumerate(map(of_head, state.names))
        if name.startswith(ESTIMATED_WITH_PRIOR) and name not in free and errors.sigmas[number] > 0
    ]
    if not numbers:
        return None
    return ParameterPrior(np.array(numbers), errors.covariance(np.array(numbers)), state)
