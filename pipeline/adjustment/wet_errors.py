"""A-priori errors of wet faces: how a target that was built, or a wall that stands there, may differ under water.

A family's wet faces may stand off the dry ones, be turned against them and bow, each family by itself. A layer of
growth is of about one thickness on all of them: it brings every wet face nearer to the boat. Let g be its sigma, o that
of a family by itself, and s the family's sense: +1 if its faces look along its normal, so that growth shifts them along
it, -1 if they look the other way. Then the shifts of two families i, k have the covariance

    o² δ_ik + g² s_i s_k.

With o alone, the mean over many walls would seem to be known better than that of one; growth is on all of them. The
shift is one for all faces of a family. Of faces that look both ways, the mean sense counts, about zero.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.solution import ConsiderErrors

BUILT_DEG, BUILT_M = 0.02, 0.002  # sigmas of a family's direction and place against the design, on a building site
SHIFT = re.compile("wet_(.*)_shift")


class WetSurvey(Protocol):
    """What is known of the wet faces against the dry ones: sigmas of shifts, turns, and of growth on all."""

    @property
    def offset_sigma_m(self) -> float:
        """Standard deviation of a family's shift, m."""
        ...

    @property
    def angle_sigma_deg(self) -> float:
        """Standard deviation of a family's turn about either axis, degrees."""
        ...

    @property
    def growth_sigma_m(self) -> float:
        """Standard deviation of a shift of all wet faces toward the boat, m."""
        ...


def wet_faces_uncertain(as_built: WetSurvey) -> bool:
    """Return whether wet faces may stand farther off the dry ones than on an ordinary building site.

    Then the search for weights must know of them: else the INS's drift makes up for what does not fit.
    """
    return max(as_built.offset_sigma_m, as_built.growth_sigma_m) > BUILT_M or as_built.angle_sigma_deg > BUILT_DEG


def outward_of(faces: Faces, state: State) -> dict[str, float]:
    """Return by family the mean sense of its faces: +1 if they look along its normal, -1 if the other way."""
    numbers = range(len(state.surfaces))
    means = [float(faces.sense[faces.surface == k].mean()) if (faces.surface == k).any() else 0.0 for k in numbers]
    return {surface.family: mean for surface, mean in zip(state.surfaces, means, strict=True)}


def wet_errors(
    names: Sequence[str], as_built: WetSurvey, bow_sigma_m: float, outward: Mapping[str, float]
) -> ConsiderErrors:
    """Return the a-priori errors of the wet faces' shifts, turns and bows, m and rad, zero for other parameters.

    Parameters
    ----------
    names : sequence of str
        Names of all parameters.
    as_built : WetSurvey
        Sigmas of the wet faces against the dry ones.
    bow_sigma_m : float
        Sigma of the bow.
    outward : mapping of float
        Sense s of each family, from :func:`outward_of`.
    """
    lean, sigmas = float(np.radians(as_built.angle_sigma_deg)), np.zeros(len(names))
    of_wet = {"turn_1": lean, "turn_2": lean, "shift": as_built.offset_sigma_m, "bow": bow_sigma_m}
    for number, name in enumerate(names):
        if name.startswith("wet_"):
            sigmas[number] = next(sigma for end, sigma in of_wet.items() if name.endswith(f"_{end}"))
    shifts = [(number, match[1]) for number, name in enumerate(names) if (match := SHIFT.fullmatch(name))]
    if not shifts or not as_built.growth_sigma_m:
        return ConsiderErrors(sigmas)
    numbers = np.array([number for number, _ in shifts])
    growth = as_built.growth_sigma_m * np.array([outward[family] for _, family in shifts])
    covariance = np.diag(sigmas[numbers] ** 2) + np.outer(growth, growth)
    sigmas[numbers] = np.sqrt(np.diag(covariance))
    return ConsiderErrors(sigmas, [(numbers, covariance)])
