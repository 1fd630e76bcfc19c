"""The solution from a part of the observations against the solution from all of them.

Let x be the least-squares solution of all observations and y that of a part of them. x is the best linear unbiased
estimate, so that y - x is not correlated with x, and Cov(y - x) = C_y - C_x (Hausman 1978, "Specification tests in
econometrics"). An error h of the fixed parameters, h ~ N(0, Q), moves x by S_x h and y by S_y h. So the difference has
the covariance

    D = C_y - C_x + (S_y - S_x) Q (S_y - S_x)ᵀ.

If the model holds, T = (y - x)ᵀ D⁻¹ (y - x) is χ² distributed, with the rank of D as its degrees of freedom. A
direction in which the part has nearly all the information of the whole (its variance in D below SAME of that in C_y) is
left out: there both solutions are equal but for rounding. T becomes the normal deviate with the same probability of
being exceeded, so that tests with other degrees of freedom compare.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.solution import ConsiderErrors, Solution

Array = NDArray[np.float64]
SAME = 1e-3  # share of a variance of the part's solution
LEAST_CHANCE = 1e-300  # for normal deviates that stay finite


@dataclass(frozen=True)
class Deviation:
    """Difference of the mount, y - x.

    change, sigma (m,): difference and standard deviations, rad and m; normalised: the normal deviate of T; dof: number
    of its directions.
    """

    change: Array
    sigma: Array
    normalised: float
    dof: int


def deviation(part: Solution, whole: Solution, consider: ConsiderErrors, mount: NDArray[np.int64]) -> Deviation:
    """Return the difference of the part's solution from that of the whole.

    Parameters
    ----------
    part, whole : Solution
        Both are steps from the same values.
    consider : ConsiderErrors
        Errors of the fixed parameters, the same for both.
    mount : (m,) array
        Numbers of the mount parameters.
    """
    from scipy.special import chdtrc, ndtri

    change = part.step[mount] - whole.step[mount]
    Q = consider.covariance(whole.fixed)
    between = part.sensitivity_of(mount) - whole.sensitivity_of(mount)
    rows = np.searchsorted(whole.estimated, mount)
    of_part, of_whole = (solution.covariance[np.ix_(rows, rows)] for solution in (part, whole))
    D = of_part - of_whole + between @ Q @ between.T
    # directions in units of the part's own uncertainty
    half = np.linalg.cholesky(of_part + between @ Q @ between.T)
    inverse = np.linalg.inv(half)
    values, vectors = np.linalg.eigh(inverse @ D @ inverse.T)
    used = values > SAME
    along = vectors.T @ inverse @ change
    statistic, dof = float(np.sum(along[used] ** 2 / values[used])), int(used.sum())
    chance = max(float(chdtrc(dof, statistic)), LEAST_CHANCE) if dof else 1.0
    return Deviation(change, np.sqrt(np.maximum(np.diag(D), 0.0)), float(-ndtri(chance / 2)), dof)
