"""Which mount parameters the data can give: those to fix, and the two that are hardest to tell apart."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.solution import solve
from pipeline.maths.mount_parameters import MOUNT_WORDS, N_MOUNT

Array = NDArray[np.float64]
VAGUE = 10.0  # rad or m: prior sigma of a parameter of which nothing is known before any point
CORRELATION_LIMIT = float(np.sqrt(0.75))  # a correlation that doubles both sigmas


def parameters_to_fix(normal: Array, estimated: Sequence[int], required: Array) -> dict[int, float]:
    """Return the mount parameters to fix, and the sigma with which each would have come out.

    Fix the worst parameter and solve again: fixing one of a correlated pair usually makes the second estimable.

    Parameters
    ----------
    normal : (u, u) array
        Normal matrix of all parameters.
    estimated : sequence of int
        Parameters that are to be estimated.
    required : (6,) array
        Sigmas required of the mount parameters.
    """
    fixed: dict[int, float] = {}
    while len(fixed) < N_MOUNT:
        left = [number for number in estimated if number not in fixed]
        prior = np.zeros(len(normal))
        prior[left] = VAGUE**-2
        solution = solve(normal + np.diag(prior), np.zeros(len(normal)), left)
        mount = [k for k in range(N_MOUNT) if k not in fixed]
        sigma = np.sqrt(np.diag(solution.covariance))[: len(mount)]
        worst = int(np.argmax(sigma / required[mount]))
        if sigma[worst] <= required[mount[worst]]:
            break
        fixed[mount[worst]] = float(sigma[worst])
    return fixed


def correlated_pair(covariance: Array) -> tuple[int, int, float] | None:
    """Return the two mount parameters in (6, 6) that are hardest to tell apart, and their correlation ρ, or None.

    Were one of them known, the sigma of the second would be √(1 - ρ²) of what it is: half of it at ρ = √3/2 = 0.866.
    From there on two are said to move together. A weaker correlation costs less than another pass.
    """
    sigma = np.sqrt(np.diag(covariance))
    above = np.triu(covariance / np.outer(sigma, sigma), 1)
    row, column = divmod(int(np.argmax(np.abs(above))), N_MOUNT)
    rho = float(above[row, column])
    return (row, column, rho) if abs(rho) >= CORRELATION_LIMIT else None


def weakest_direction(covariance: Array) -> str:
    """Return, in words, the two mount parameters in (6, 6) that are hardest to tell apart."""
    sigma, pair = np.sqrt(np.diag(covariance)), correlated_pair(covariance)
    if pair is None:
        worst = int(np.argmax(sigma[:3])), 3 + int(np.argmax(sigma[3:]))
        return f"no two are hard to tell apart; least sure are {MOUNT_WORDS[worst[0]]} and {MOUNT_WORDS[worst[1]]}"
    row, column, rho = pair
    times = 1 / np.sqrt(max(1 - rho**2, 1e-6))
    return (
        f"{MOUNT_WORDS[row]} and {MOUNT_WORDS[column]} move together (correlation {rho:+.3f}): if one were known, the "
        f"other's sigma would be {times:.1f} times smaller"
    )
