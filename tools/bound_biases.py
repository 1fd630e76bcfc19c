"""Biases that an estimator of the sonar's mount allows for: derivatives of the bound's equations, and a-priori sigmas.

They are errors of the wet faces (turn, shift, bow by family), of the sonar's ranges (of all, by incidence, on level
faces), of the transmitter's place and of the sound speed's change with depth, and of the laser's ranges by incidence.
Derivatives follow from rays bent and lengthened here; nothing is imported from the adjustment but the settings'
defaults.
"""

from typing import Any

import numpy as np

from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser, Mbes
from pipeline.config.target import Letters
from tools.forward_model import NORMALS, Array, Rays, World

SPEED_M_S = 1500.0
STEPS = 40  # of the integration of a bent ray
LEVEL = 3  # number of the horizontal family
AT_45_DEG = np.sqrt(2.0) - 1
_OF_RANGES = ("range_bias_sigma_m", "incidence_bias_sigma_m", "level_bias_sigma_m")


def sigmas() -> Array:
    """Return the a-priori sigmas (b,) that session.yaml and the pool's config have by default."""

    def default(model: Any, name: str) -> float:
        return float(model.model_fields[name].default)

    survey, lean = AsBuilt(), np.radians(AsBuilt().angle_sigma_deg)
    wet = [lean, lean, survey.offset_sigma_m, survey.bow_sigma_m]
    of_sonar = [default(Mbes, name) for name in _OF_RANGES]
    of_sonar += [default(Mbes, "projector_sigma_m")] * 3 + [default(Mbes, "sound_speed_gradient_sigma_1_s")]
    return np.array(wet * len(NORMALS) + of_sonar + [default(Laser, "incidence_bias_sigma_m")])


def derivatives(world: World, rays: Rays, of_surfaces: Array) -> Array:
    """Return the derivatives (n, b) of a ray's equation by the biases, in the order of :func:`sigmas`.

    Parameters
    ----------
    world
        The truth of the session.
    rays
        The rays, one equation each.
    of_surfaces
        (n, 12): derivatives by two turns and a shift of each family.
    """
    none = np.zeros(6)
    ranges = np.linalg.norm(rays.points_m, axis=1)
    here, start = (world.placed(rays, points, none, none) for points in (rays.points_m, 0 * rays.points_m))
    ray = (here - start) / ranges[:, None]
    normal, family = world.normals[rays.plane], world.family[rays.plane]
    slant = np.einsum("ni,ni->n", normal, ray)
    by_incidence = slant * (1 / np.abs(slant) - 1) / AT_45_DEG
    found = np.zeros((len(ranges), len(sigmas())))
    if rays.sensor == "laser":
        found[:, -1] = by_incidence
        return found
    target = world.scenario.target
    assert isinstance(target, Letters)
    share = (here[:, 2] + target.a / 2) / (target.water_level_m + target.a / 2)
    for k in range(len(NORMALS)):
        found[:, 4 * k : 4 * k + 3] = of_surfaces[:, 3 * k : 3 * k + 3]
        found[:, 4 * k + 3] = 4 * share * (1 - share) * (family == k) * (k != LEVEL)
    rest = 4 * len(NORMALS)
    found[:, rest : rest + 3] = np.column_stack([slant, by_incidence, slant * (family == LEVEL)])
    # the transmitter elsewhere: the way there and back is kept
    found[:, rest + 3 : rest + 6] = slant[:, None] * rays.points_m / ranges[:, None] / 2
    ends = [_bent(start, ray, ranges, gradient) for gradient in (1e-3, -1e-3)]
    found[:, rest + 6] = np.einsum("ni,ni->n", normal, ends[0] - ends[1]) / 2e-3
    return found


def _bent(start: Array, ray: Array, ranges: Array, gradient_1_s: float) -> Array:
    """Return the ends (n, 3) of rays in water whose sound speed grows with depth below the head.

    ``ranges`` (n,) m follow from the travel times with the speed at the head. The ray equation dX/dt = c d,
    dd/dt = -(∇c - d (d · ∇c)) is integrated by the midpoint rule.
    """
    slope = np.array([0.0, 0.0, -gradient_1_s])
    X, d, dt = start.copy(), ray.copy(), ranges[:, None] / SPEED_M_S / STEPS

    def rates(X: Array, d: Array) -> tuple[Array, Array]:
        speed = SPEED_M_S + (X - start) @ slope
        return speed[:, None] * d, d * (d @ slope)[:, None] - slope

    for _ in range(STEPS):
        by_X, by_d = rates(X, d)
        by_X, by_d = rates(X + by_X * dt / 2, d + by_d * dt / 2)
        X, d = X + by_X * dt, d + by_d * dt
    return X
