"""Families of faces that are known to be parallel, at distances nobody knows: observations of their surfaces.

Of two such families with normals n, m (m turned over where it points the other way) and the first's tangents t1, t2

    t_k · (n - m) = 0 ± σ,      k = 1, 2,

and a step of their turns changes it by a_k - Σ_j t_k · t'_j b_j. A wall's foot, under water alone, so tells the sonar
what the wall above it, in the laser's sight, tells of direction.
"""

from collections.abc import Sequence

import numpy as np

from pipeline.maths.adjustment.design_constraints import Known
from pipeline.maths.adjustment.parameters import OF_SURFACE, State


def of_ties(pairs: Sequence[tuple[str, str]], sigma_rad: float, state: State) -> Known:
    """What ``pairs`` of families add to the normal equations of all unknowns, at the surfaces as they are."""
    number = {surface.family: k for k, surface in enumerate(state.surfaces)}
    N, b, squares = np.zeros((state.size, state.size)), np.zeros(state.size), 0.0
    for one, other in pairs:
        first, second = state.surfaces[number[one]], state.surfaces[number[other]]
        sense = 1.0 if first.normal @ second.normal > 0 else -1.0
        r = first.tangents @ (first.normal - sense * second.normal)
        J = np.hstack([np.eye(2), -sense * first.tangents @ second.tangents.T])
        starts = [state.shared.start + len(OF_SURFACE) * number[name] for name in (one, other)]
        place = np.concatenate([start + np.arange(2) for start in starts])
        N[np.ix_(place, place)] += J.T @ J / sigma_rad**2
        b[place] += J.T @ r / sigma_rad**2
        squares += float(r @ r) / sigma_rad**2
    return Known(N, b, squares)
