"""Test of the drift: by how much its mean in one pass differs from that in the others, against the INS's sigmas.

An error of one sensor in one pass (a bracket that moves, a clock that jumps) need not stay in the residuals: where the
INS is allowed a drift, the adjustment turns the boat in that pass until both sensors fit. The price is a drift larger
than allowed, and that shows. (5 mm more range in one of four passes leaves 1 mm in the residuals, and turns the boat by
0.15° in heading.) With weights c, Σ c ξ = (mean of the pass's knots) - (mean of all others), and ξ the Gauss-Markov
process of :mod:`pipeline.maths.adjustment.pose_errors`,

    Var(Σ c ξ) = c' K c,    K_ij = σ² exp(-|t_i - t_j| / τ)

for each of the six components. The estimate of ξ has at most that variance (the estimate is the conditional mean:
Var ξ = Var of the estimate + what remains unknown), so that a test against its root rejects too rarely, if at all.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.pose_errors import DriftEstimate, PoseNoise

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class PassDrift:
    """Differences of the drift between passes.

    passes (p,): their numbers; difference (p, 6), m and rad: mean of the drift in each less that in all other passes;
    sigma (p, 6): standard deviation that the drift process gives this difference.
    """

    passes: Integers
    difference: Array
    sigma: Array


def drift_between_passes(drift: DriftEstimate, noise: PoseNoise, pass_of_knot: Integers) -> PassDrift:
    """Return how the drift in each pass differs from that in the others; for a single pass, its mean itself.

    Parameters
    ----------
    drift : DriftEstimate
        The estimated drift, k knots.
    noise : PoseNoise
        Standard deviations and time constant of the drift.
    pass_of_knot : (k,) array
        Number of each knot's pass; negative: none.
    """
    passes = np.unique(pass_of_knot[pass_of_knot >= 0])
    inside = pass_of_knot[:, None] == passes
    outside = (pass_of_knot >= 0)[:, None] & ~inside
    weight = inside / inside.sum(axis=0) - outside / np.maximum(outside.sum(axis=0), 1)  # (k, p)
    decay = np.exp(-np.diff(drift.knots.seconds, prepend=drift.knots.seconds[:1]) / noise.time_constant_s)
    before, square = np.zeros(len(passes)), np.zeros(len(passes))
    for at_knot, factor in zip(weight, decay, strict=True):  # Σ_{j < i} c_j exp(-(t_i - t_j) / τ), from knot to knot
        before *= factor
        square += at_knot * (at_knot + 2 * before)
        before += at_knot
    sigma = np.sqrt(np.maximum(square, 0.0))[:, None] * noise.drift
    return PassDrift(passes, weight.T @ drift.values, sigma)
