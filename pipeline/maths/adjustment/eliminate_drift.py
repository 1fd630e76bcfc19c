"""Drift of the INS, eliminated knot by knot; the normal equations of the parameters alone remain.

With the records' white noise eliminated, the normal matrix has arrow form: the knots are a band, the parameters x its
border. Banded Cholesky (LAPACK pbtrf) eliminates the knots. The Schur complement of x is the inverse covariance of x
with all pose errors unknown; the knots follow from x. Prior: :mod:`pipeline.maths.adjustment.pose_errors`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.eliminate_white_noise import ReducedIntervals
from pipeline.maths.adjustment.pose_errors import N_POSE, DriftEstimate, PoseNoise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations N x + b = 0 of the parameters, all pose errors eliminated.

    normal N (u, u), right b (u,); squares: remaining Σ p v² of the observations and of the drift's prior at x = 0;
    log_determinant of all eliminated blocks. The knots' step follows from x: knots_at_zero - knots_by_parameter · x,
    (k, 6) and (k, 6, u).
    """

    normal: Array
    right: Array
    squares: float
    log_determinant: float
    knots_by_parameter: Array
    knots_at_zero: Array

    def knots(self, step: Array) -> Array:
        """Return the step (k, 6) of the knots that goes with a step (u,) of the parameters."""
        return np.asarray(self.knots_at_zero - self.knots_by_parameter @ step)


def eliminate_drift(reduced: ReducedIntervals, noise: PoseNoise, drift: DriftEstimate) -> NormalEquations:
    """Return the normal equations with the knots eliminated under their prior.

    In units of σ the prior is Σ_j |ξ_{j+1} - φ ξ_j|² / (1 - φ²) + |ξ_0|². Components without drift (σ = 0) get no
    step.

    Parameters
    ----------
    reduced : ReducedIntervals
        Normal equations without the records' noise.
    noise : PoseNoise
        Standard deviations and time constant of the drift.
    drift : DriftEstimate
        The drift at which the observations were linearised.
    """
    from scipy.linalg import cho_solve_banded, cholesky_banded

    knots, current = drift.knots, drift.values
    u, count = len(reduced.others) - 1, len(knots.record)
    scale = noise.drift
    first, second = slice(0, N_POSE), slice(N_POSE, 2 * N_POSE)  # rows of a span's knots
    before, after = slice(u, u + N_POSE), slice(u + N_POSE, u + 2 * N_POSE)  # their columns
    sides = [*range(u), u + 2 * N_POSE]  # x and v
    # blocks of the normal matrix: each knot with itself (diagonal), with the next (coupling), with x and v (border)
    diagonal, coupling = np.zeros((count, N_POSE, N_POSE)), reduced.spans[:, first, after] * scale[:, None] * scale
    border = np.zeros((count, N_POSE, u + 1))
    for place, rows, of in ((slice(0, -1), first, before), (slice(1, None), second, after)):
        diagonal[place] += reduced.spans[:, rows, of]
        border[place] += reduced.spans[:, rows][:, :, sides]
    diagonal, border = diagonal * scale[:, None] * scale, border * scale[:, None]
    phi = np.exp(-np.diff(knots.seconds) / noise.time_constant_s)
    variance = -np.expm1(-2 * np.diff(knots.seconds) / noise.time_constant_s)  # 1 - φ², exact for a long τ too
    unit = np.eye(N_POSE)
    diagonal[0] += unit
    diagonal[:-1] += (phi**2 / variance)[:, None, None] * unit
    diagonal[1:] += (1 / variance)[:, None, None] * unit
    coupling -= (phi / variance)[:, None, None] * unit
    xi = np.divide(current, scale, out=np.zeros_like(current), where=scale > 0)  # the drift in units of σ
    innovation = xi[1:] - phi[:, None] * xi[:-1]  # part of the drift that does not follow from the knot before
    weighted = innovation / variance[:, None]  # innovation times its weight
    border[0, :, u] += xi[0]
    border[1:, :, u] += weighted
    border[:-1, :, u] -= phi[:, None] * weighted
    factor = cholesky_banded(_banded(diagonal, coupling), lower=True)
    flat = border.reshape(-1, u + 1)
    solved = cho_solve_banded((factor, True), flat)
    total = reduced.others.copy()
    total[u, u] += float(np.sum(xi[0] ** 2) + np.sum(innovation * weighted))
    total -= flat.T @ solved
    log_determinant = 2 * float(np.sum(np.log(factor[0]))) + N_POSE * float(np.sum(np.log(variance)))
    back = solved.reshape(count, N_POSE, u + 1) * scale[:, None]
    return NormalEquations(
        normal=total[:u, :u],
        right=total[:u, u],
        squares=float(total[u, u]),
        log_determinant=reduced.log_determinant + log_determinant,
        knots_by_parameter=back[:, :, :u],
        knots_at_zero=-back[:, :, u],
    )


def _banded(diagonal: Array, coupling: Array) -> Array:
    """Return the lower band (12, 6k) of the symmetric matrix with these blocks on and next to its diagonal."""
    count = len(diagonal)
    band = np.zeros((2 * N_POSE, N_POSE * count))
    for row in range(N_POSE):
        for column in range(N_POSE):
            if row >= column:
                band[row - column, column::N_POSE] = diagonal[:, row, column]
            band[N_POSE + row - column, column : N_POSE * (count - 1) : N_POSE] = coupling[:, column, row]
    return band
