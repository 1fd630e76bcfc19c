"""Drift of the INS, eliminated knot by knot; the normal equations of the parameters alone remain.

With the records' white noise eliminated, the normal matrix has arrow form: the knots are a band, the parameters x its
border. Block Cholesky eliminates the knots, one after the other (:mod:`~pipeline.maths.kernels.knot_chain`). The Schur
complement of x is the inverse covariance of x with all pose errors unknown; the knots follow from x. Prior:
:mod:`pipeline.maths.adjustment.pose_errors`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.eliminate_white_noise import ReducedIntervals
from pipeline.maths.adjustment.pose_errors import N_POSE, DriftEstimate, PoseNoise
from pipeline.maths.kernels.compiled import block
from pipeline.maths.kernels.knot_chain import add_spans, eliminate_knots

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
    knots, current = drift.knots, drift.values
    u, count = len(reduced.others) - 1, len(knots.record)
    scale = noise.drift
    # blocks of the normal matrix: each knot with itself (own), with the next (ahead), with x and v (border)
    own, ahead = np.zeros((count, N_POSE, N_POSE)), np.zeros((count - 1, N_POSE, N_POSE))
    border = np.zeros((count, N_POSE, u + 1))
    add_spans(block(reduced.spans), scale, own, ahead, border)
    phi = np.exp(-np.diff(knots.seconds) / noise.time_constant_s)
    variance = -np.expm1(-2 * np.diff(knots.seconds) / noise.time_constant_s)  # 1 - φ², exact for a long τ too
    unit = np.eye(N_POSE)
    own[0] += unit
    own[:-1] += (phi**2 / variance)[:, None, None] * unit
    own[1:] += (1 / variance)[:, None, None] * unit
    ahead -= (phi / variance)[:, None, None] * unit
    xi = np.divide(current, scale, out=np.zeros_like(current), where=scale > 0)  # the drift in units of σ
    innovation = xi[1:] - phi[:, None] * xi[:-1]  # part of the drift that does not follow from the knot before
    weighted = innovation / variance[:, None]  # innovation times its weight
    border[0, :, u] += xi[0]
    border[1:, :, u] += weighted
    border[:-1, :, u] -= phi[:, None] * weighted
    total, log_determinant = np.array(reduced.others, order="C"), np.empty(1)
    total[u, u] += float(np.sum(xi[0] ** 2) + np.sum(innovation * weighted))
    eliminate_knots(own, ahead, border, total, log_determinant)
    if not np.isfinite(log_determinant[0]):
        raise np.linalg.LinAlgError("the normal matrix of the drift's knots is not positive definite")
    of_prior = N_POSE * float(np.sum(np.log(variance)))
    back = border * scale[:, None]
    return NormalEquations(
        normal=total[:u, :u],
        right=total[:u, u],
        squares=float(total[u, u]),
        log_determinant=reduced.log_determinant + float(log_determinant[0]) + of_prior,
        knots_by_parameter=back[:, :, :u],
        knots_at_zero=-back[:, :, u],
    )
