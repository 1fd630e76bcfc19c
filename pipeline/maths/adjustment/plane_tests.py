"""Tests of wet faces: whether a wall goes on below the water as above, within what is known of it beforehand.

The parameters k of one surface's wet part (turns, shift, bow) are estimated with values known beforehand. If they are
freed, the least sum of squares falls by T (:mod:`~pipeline.maths.adjustment.joint_tests`). With P, C, S, d as there and
the a-priori covariance Q of the fixed parameters, the misclosure r = -(P d)_k has, if all a-priori errors hold, the
covariance

    V = (P - P C P)_kk + (P S Q Sᵀ P)_kk

(errors x of the fixed parameters change d by S x). So T' = rᵀ V⁻¹ r is chi-squared with rank V degrees of freedom. The
error β of the known values follows from M β + r = 0, M = (P - P C P)_kk: what the wall stands off by, if the other
walls are as they are known to be.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.joint_tests import DETERMINED, normal_deviate_of
from pipeline.maths.adjustment.solution import ConsiderErrors, Solution

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlaneTest:
    """Test of a wet face's parameters.

    fall: T; rank: its degrees of freedom, 0 if the points say nothing of the parameters; statistic: T'; dof: of T';
    single (k,): |r_i| / √V_ii, the test of each parameter alone; error (k,): β; sigma (k,): its standard deviations.
    """

    fall: float
    rank: int
    statistic: float
    dof: int
    single: Array
    error: Array
    sigma: Array

    @property
    def deviate(self) -> float:
        """Return the largest normal deviate: of T', or of a single parameter, which shows its own error best."""
        return max(normal_deviate_of(self.statistic, self.dof), float(self.single.max()))


def plane_test(solution: Solution, deviation: Array, consider: ConsiderErrors, numbers: Sequence[int]) -> PlaneTest:
    """Return the test of parameters that are estimated with values known beforehand.

    Parameters
    ----------
    solution : Solution
        Solution of the normal equations.
    deviation : (u,) array
        Deviations of all parameters from the values known beforehand, after the solution's step.
    consider : ConsiderErrors
        A-priori errors of the fixed parameters.
    numbers : sequence of int
        The parameters.
    """
    places = np.searchsorted(solution.estimated, np.array(sorted(numbers)))
    P, C = solution.prior, solution.covariance
    PS = P @ solution.sensitivity
    r = -(P @ deviation[solution.estimated])[places]
    M = (P - P @ C @ P)[np.ix_(places, places)]
    V = M + (PS @ consider.covariance(solution.fixed) @ PS.T)[np.ix_(places, places)]
    scale = 1 / np.sqrt(np.diag(P)[places])
    inverse_M, rank = _inverse(M, scale)
    inverse_V, dof = _inverse(V, scale)
    return PlaneTest(
        fall=float(r @ inverse_M @ r),
        rank=rank,
        statistic=float(r @ inverse_V @ r),
        dof=dof,
        single=np.abs(r) / np.sqrt(np.maximum(np.diag(V), DETERMINED * np.diag(P)[places])),
        error=-inverse_M @ r,
        sigma=np.sqrt(np.maximum(np.diag(inverse_M @ V @ inverse_M), 0.0)),
    )


def _inverse(matrix: Array, scale: Array) -> tuple[Array, int]:
    """Return the inverse of a scaled positive semidefinite matrix, and its rank; open directions get zero."""
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    determined = values > DETERMINED
    half = scale[:, None] * vectors[:, determined] / np.sqrt(values[determined])
    return np.asarray(half @ half.T), int(determined.sum())
