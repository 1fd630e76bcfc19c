"""White noise of the INS's records, from the differences of the laser's consecutive intervals: drift cannot change it.

The mean m = Σ w v / Σ w of an interval contains the errors w_k, w_{k+1} of the records before and after it
(:mod:`pipeline.maths.adjustment.pose_errors`). With q̄ = Σ w q / Σ w, K the design of pose errors, W the sigmas of a
record and g = (q̄ᵀ K) ∘ W, its common error has the variance factor f times that of (1 - s) g · w_k + s g · w_{k+1}.
Take two intervals i and j of one surface, i before j. If j is the very next interval, they share a record:

    E (m_j - m_i)² = own_i + own_j + f c,      c = (1 - s_i)² |g_i|² + |(1 - s_j) g_j - s_i g_i|² + s_j² |g_j|²,

with own = 1 / Σ w, and otherwise c = ((1 - s_i)² + s_i²) |g_i|² + ((1 - s_j)² + s_j²) |g_j|². Within
:data:`LARGEST_STEP` records the drift hardly changes: by √(q t), with q = 2 σ² / τ, that is 0.2 mm in 25 ms at 15 mm
and 200 s, and 2 mm of white noise are looked for. So f does not grow if the INS drifts faster than its figures say. The
residuals are those without the estimated drift, which has taken a part of the noise: with knots 0.12 s apart their mean
square is 7 % too small, but that of these differences, and f, only 1 %. (With the drift left in them, f would count all
that an INS of 10 records a second drifts in half a second.) Robust weights follow v, which contains the common error,
and take a part of both: κ² c and ν own stand for c and own
(:func:`~pipeline.maths.adjustment.robust_weights.robust_effects`). That is exact for a common error much smaller than
the points' own noise; of a larger one a mean shows more than κ, and f comes out up to 1.4 % too large. f follows by
regression with the weights of maximum likelihood, c / (own_i + own_j + f c)², over all such pairs. Pairs are not
independent. Neighbours in a sequence of differences have a correlation of -1/2, and the squares of these add half to
the variance of f. The stated sigma is that of the pairs of neighbours alone: the others, which repeat their information
in part, take up to a third off it.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import BLOCK, N_MOVED, Intervals, blocks
from pipeline.maths.adjustment.pose_errors import N_POSE
from pipeline.maths.adjustment.robust_weights import RobustEffects
from pipeline.maths.adjustment.weighting import EpochVarianceFactor

Array = NDArray[np.float64]
LARGEST_STEP = 5  # records from one interval of a pair to the other, at most
OVERLAP = 1.5  # variance of f from pairs of neighbours, by its variance if they were independent
ROUNDS = 3  # of the regression, first with f = 1


def record_noise_factor(
    sums: Intervals, pose_designs: Array, white: Array, robust: RobustEffects
) -> EpochVarianceFactor:
    """Return the variance factor of the records' white noise, and its sigma (infinite: unknown).

    Parameters
    ----------
    sums : Intervals
        The laser's intervals, at the adjusted values.
    pose_designs : (s, 3, 6) array
        Design K of pose errors by surface.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    robust : RobustEffects
        What robust weights do to the intervals' means.
    """
    g, (mean, own, share) = np.empty((len(sums), N_POSE)), np.empty((3, len(sums)))
    for start, block in zip(range(0, len(sums), BLOCK), blocks(sums), strict=True):
        rows, information = slice(start, start + BLOCK), block.normal[:, 0, 0]
        of_moved = block.normal[:, 0, :N_MOVED] / information[:, None]
        g[rows] = np.einsum("gi,gij->gj", of_moved, pose_designs[block.surface]) * white * robust.shift
        mean[rows], own[rows] = block.right[:, 0] / information, robust.variance / information
        share[rows] = block.share
    share = share[:, None]
    before, after = (1 - share) * g, share * g  # of the record before the interval, and of that after it
    order = np.lexsort((sums.record, sums.surface))
    parts = []
    for apart in range(1, LARGEST_STEP + 1):
        i, j = order[:-apart], order[apart:]
        step = sums.record[j] - sums.record[i]
        paired = (sums.surface[i] == sums.surface[j]) & (step <= LARGEST_STEP)
        i, j, step = i[paired], j[paired], step[paired]
        shared = np.where(step == 1, -2 * np.sum(before[j] * after[i], axis=1), 0.0)
        c = np.sum(before[i] ** 2 + after[i] ** 2 + before[j] ** 2 + after[j] ** 2, axis=1) + shared
        parts.append(np.array([own[i] + own[j], (mean[j] - mean[i]) ** 2, c]))
    neighbours, (noise, squared, c) = parts[0].shape[1], np.concatenate(parts, axis=1)
    factor, by_variance = 1.0, np.zeros_like(c)
    for _ in range(ROUNDS):
        by_variance = c / (noise + max(factor, 0.0) * c) ** 2
        weight = float(np.sum(by_variance * c))
        if weight <= 0:
            return EpochVarianceFactor(1.0, np.inf)
        factor = float(np.sum(by_variance * (squared - noise))) / weight
    of_neighbours = float(np.sum((by_variance * c)[:neighbours]))
    return EpochVarianceFactor(factor, float(np.sqrt(OVERLAP * 2 / max(of_neighbours, 1e-300))))
