"""Drift of the INS, eliminated knot by knot: what is left are the normal equations of the unknowns alone.

With the records' white noise gone, the normal equations are an arrow: knots banded, the unknowns x its border. Banded
Cholesky (LAPACK pbtrf) eliminates the knots; the Schur complement on x is its inverse covariance with all pose errors
unknown, and the knots follow from x. See :mod:`pipeline.maths.adjustment.pose_errors` for the prior.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from pipeline.maths.adjustment.eliminate_white_noise import Reduced
from pipeline.maths.adjustment.parameters import SIX
from pipeline.maths.adjustment.pose_errors import Drift, PoseNoise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Eliminated:
    """Normal equations N x + b = 0 of all unknowns: normal (u, u), right (u,), squares = Σ p v² left of the
    observations (and of the drift's prior) at x = 0; log det of all that went; and what gives the knots back: step =
    free - tied · x, (k, 6)."""

    normal: Array
    right: Array
    squares: float
    log_determinant: float
    tied: Array
    free: Array

    def knots(self, step: Array) -> Array:
        """The step of the knots that goes with a step of x; (k, 6)."""
        return np.asarray(self.free - self.tied @ step)


def eliminate_drift(reduced: Reduced, noise: PoseNoise, drift: Drift) -> Eliminated:
    """The knots eliminated under their prior; ``drift``: that at which the equations were made.

    In units of σ: Σ_j |ξ_{j+1} - φ ξ_j|² / (1 - φ²) + |ξ_0|². Components without drift (σ = 0) stay as they are.
    """
    knots, current = drift.knots, drift.values
    u, count = reduced.unknowns, len(knots.record)
    scale = noise.drift
    before, after = slice(u, u + SIX), slice(u + SIX, u + 2 * SIX)
    sides = [*range(u), u + 2 * SIX]  # x and v
    own, ahead = np.zeros((count, SIX, SIX)), reduced.normal[:, before, after] * scale[:, None] * scale
    border = np.zeros((count, SIX, u + 1))
    for place, of in ((slice(0, -1), before), (slice(1, None), after)):
        own[place] += reduced.normal[:, of, of]
        border[place] += reduced.normal[:, of][:, :, sides]
    own, border = own * scale[:, None] * scale, border * scale[:, None]
    phi = np.exp(-np.diff(knots.seconds) / noise.time_constant_s)
    variance = 1 - phi**2
    unit = np.eye(SIX)
    own[0] += unit
    own[:-1] += (phi**2 / variance)[:, None, None] * unit
    own[1:] += (1 / variance)[:, None, None] * unit
    ahead -= (phi / variance)[:, None, None] * unit
    value = np.divide(current, scale, out=np.zeros_like(current), where=scale > 0)
    change = value[1:] - phi[:, None] * value[:-1]
    shock = change / variance[:, None]
    border[0, :, u] += value[0]
    border[1:, :, u] += shock
    border[:-1, :, u] -= phi[:, None] * shock
    factor = cholesky_banded(_banded(own, ahead), lower=True)
    flat = border.reshape(-1, u + 1)
    solved = cho_solve_banded((factor, True), flat)
    total = reduced.normal[:, sides][:, :, sides].sum(axis=0)
    total[u, u] += float(np.sum(value[0] ** 2) + np.sum(change * shock))
    total -= flat.T @ solved
    log_determinant = 2 * float(np.sum(np.log(factor[0]))) + SIX * float(np.sum(np.log(variance)))
    back = solved.reshape(count, SIX, u + 1) * scale[:, None]
    return Eliminated(
        total[:u, :u],
        total[:u, u],
        float(total[u, u]),
        reduced.log_determinant + log_determinant,
        back[:, :, :u],
        -back[:, :, u],
    )


def _banded(own: Array, ahead: Array) -> Array:
    """Lower band (12, 6k) of the matrix with these blocks on and right above its diagonal."""
    count = len(own)
    band = np.zeros((2 * SIX, SIX * count))
    for row in range(SIX):
        for column in range(SIX):
            if row >= column:
                band[row - column, column::SIX] = own[:, row, column]
            band[SIX + row - column, column : SIX * (count - 1) : SIX] = ahead[:, column, row]
    return band
