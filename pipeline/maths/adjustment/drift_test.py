"""How much the drift found in a pass differs from that in the others, against what the INS is conceded.

What one sensor alone does in one pass (a bracket that moves, a clock that jumps) need not stay in the residuals: where
the INS is conceded a drift, the adjustment turns the boat in that pass until both sensors fit. It pays with a drift
that is larger than conceded, and there it is to be seen. (5 mm more range in one of four passes leaves 1 mm in the
residuals, and turns the boat by 0.15° in heading.) With weights c, Σ c ξ = (mean of the pass's knots) - (mean of all
others), and ξ the Gauss-Markov process of :mod:`pipeline.maths.adjustment.pose_errors`,

    Var(Σ c ξ) = c' K c,    K_ij = σ² exp(-|t_i - t_j| / τ)

of each of the six components. What is estimated of ξ has at most that variance (the estimate is the conditional mean:
Var ξ = Var of the estimate + what remains unknown), so that held against its root it is rejected too rarely, if at all.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.pose_errors import Drift, PoseNoise

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def against_other_passes(drift: Drift, noise: PoseNoise, number: Integers) -> tuple[Integers, Array, Array]:
    """``number`` (k,): of each knot's pass, negative for none. The passes (p,); of each (p, 6) how much the drift's
    mean in it differs from the mean of all other passes, and the sigma conceded to that. Of a pass alone: the mean
    itself."""
    passes = np.unique(number[number >= 0])
    inside = number[:, None] == passes
    others = (number >= 0)[:, None] & ~inside
    weight = inside / inside.sum(axis=0) - others / np.maximum(others.sum(axis=0), 1)  # (k, p)
    decay = np.exp(-np.diff(drift.knots.seconds, prepend=drift.knots.seconds[:1]) / noise.time_constant_s)
    before, square = np.zeros(len(passes)), np.zeros(len(passes))
    for now, kept in zip(weight, decay, strict=True):  # Σ_{j < i} c_j exp(-(t_i - t_j) / τ), from knot to knot
        before *= kept
        square += now * (now + 2 * before)
        before += now
    return passes, weight.T @ drift.values, np.sqrt(np.maximum(square, 0.0))[:, None] * noise.drift
