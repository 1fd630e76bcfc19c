"""Minimum of a -2 log likelihood of a few values, by Newton's method with differences.

With slope g and second derivatives H, both from values at steps of :data:`STEP` to either side, the step is -H⁻¹ g. It
would lower a quadratic function by g · H⁻¹ g / 2. If that is less than :data:`NEAR`, the step is the last one: near the
minimum the error left is of second order in it. Directions of negative curvature are taken as positive, so that every
step goes down; a step that does not is halved.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 0.05  # of the differences
FARTHEST_STEP = 1.0  # largest change of a value in one step
MAX_STEPS = 12
NEAR = 0.2  # predicted decrease from which one last step is enough: half a sigma
HALVINGS = 5
LEAST_CURVATURE = 1e-6  # smallest second derivative along any direction, relative to the largest


def newton_minimum(objective: Callable[[Array], float], size: int, bound: float) -> tuple[Array, Array]:
    """Return the minimum (k,) of a function, sought from zero, and its second derivatives (k, k) there.

    Parameters
    ----------
    objective : callable
        The function of values (k,), a -2 log likelihood.
    size : int
        Number k of values.
    bound : float
        Largest size of a value.

    Examples
    --------
    >>> newton_minimum(lambda values: float(np.sum((values - [1.0, 2.5]) ** 2)), 2, 9.0)[0].round(6)
    array([1. , 2.5])
    """
    place, value = np.zeros(size), objective(np.zeros(size))
    slope, curvature = _derivatives(objective, place, value)
    for _ in range(MAX_STEPS):
        step = -np.linalg.solve(curvature, slope)
        if -float(slope @ step) < 2 * NEAR:
            return np.clip(place + step, -bound, bound), curvature
        step *= min(1.0, FARTHEST_STEP / float(np.max(np.abs(step))))
        for _ in range(HALVINGS):
            there = np.clip(place + step, -bound, bound)
            lower = objective(there)
            if lower < value:
                break
            step = step / 2
        else:
            break
        place, value = there, lower
        slope, curvature = _derivatives(objective, place, value)
    return place, curvature


def _derivatives(objective: Callable[[Array], float], place: Array, value: float) -> tuple[Array, Array]:
    """Return the first (k,) and the second derivatives (k, k), by differences; the second ones positive definite."""
    steps = STEP * np.eye(len(place))
    ahead, behind = (np.array([objective(place + sign * step) for step in steps]) for sign in (1, -1))
    curvature = np.diag(ahead + behind - 2 * value)
    for i in range(len(place)):
        for k in range(i):
            both = objective(place + steps[i] + steps[k])
            curvature[i, k] = curvature[k, i] = both - ahead[i] - ahead[k] + value
    values, vectors = np.linalg.eigh(curvature / STEP**2)
    least = LEAST_CURVATURE * max(float(values[-1]), 1e-300)
    return (ahead - behind) / (2 * STEP), (vectors * np.maximum(np.abs(values), least)) @ vectors.T
