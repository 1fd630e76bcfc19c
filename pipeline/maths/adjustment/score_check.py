"""A check of the covariance by the scatter of the scores of separate stretches of time (a sandwich estimate).

The covariance C of the parameters x rests on the model of all noise. The data also show it directly. Cut the session
into slots of some seconds, and regard each as a session of its own, with a drift that starts anew from its prior. Each
slot g has normal equations N_g x + b_g = 0 with its white noise and drift eliminated. If the model is right, its score
b_g has the covariance N_g, whatever the colour of the drift. With N = Σ N_g, x = -N⁻¹ Σ b_g and b'_g = b_g + N_g x,

    E b'_g b'_gᵀ = N_g - N_g N⁻¹ N_g,

and the influence of a slot on parameter k is a_kᵀ b'_g, a_k = column k of N⁻¹. So the ratio

    T_k = Σ (a_kᵀ b'_g)² / Σ V_gk,      V_gk = a_kᵀ (N_g - N_g N⁻¹ N_g) a_k,

is 1 in the mean. Errors that the observations of a slot share, and that the model takes as independent, make it larger:
beams or pings that are correlated, faces that are uneven. Its numerator is the diagonal of the sandwich estimate
N⁻¹ (Σ b' b'ᵀ) N⁻¹ (Liang & Zeger 1986, "Longitudinal data analysis using generalized linear models"), and its
denominator corrects for few slots (Bell & McCaffrey 2002). T_k scatters as χ²_ν / ν with

    ν = (Σ V_gk)² / Σ V_gk²,

the effective number of slots. Of the drift, only its continuity from slot to slot is not used. Errors that last longer
than a slot do not show.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.eliminate_drift import NormalEquations, eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import ReducedIntervals
from pipeline.maths.adjustment.normal_equations import Linearisation, reduced_by_group
from pipeline.maths.adjustment.pose_errors import DriftEstimate, Knots, PoseNoise
from pipeline.maths.adjustment.pseudo_observations import PseudoObservations

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
ROUNDING = 1e-6  # part of a variance below which a difference of two is rounding
SLOT_S = 1.0  # length of a slot; errors that last longer are for the tests of mean residuals


@dataclass(frozen=True)
class ScoreCheck:
    """Check of the sigmas of k parameters: ratio T and dof ν, (k,) each; both zero where the slots leave nothing."""

    ratio: Array
    dof: Array


def score_check(
    linearisation: Linearisation,
    drift: DriftEstimate,
    noise: PoseNoise,
    prior: PseudoObservations,
    estimated: Integers,
) -> ScoreCheck:
    """Return the check of the sigmas of the estimated mount parameters.

    Parameters
    ----------
    linearisation : Linearisation
        Interval sums, and the adjusted values at which they were taken.
    drift : DriftEstimate
        The drift with which the observations were taken.
    noise : PoseNoise
        Standard deviations of the pose errors.
    prior : PseudoObservations
        The prior information.
    estimated : (f,) array
        The estimated parameters, ascending.
    """
    slots = _slots(linearisation, drift, noise, estimated)
    normals, rights = np.array([slot.normal for slot in slots]), np.array([slot.right for slot in slots])
    N = normals.sum(axis=0) + prior.normal[np.ix_(estimated, estimated)]
    b = rights.sum(axis=0) + prior.right[estimated]
    inverse = np.linalg.pinv(N, hermitian=True)
    scores = rights - normals @ (inverse @ b)
    mount = np.flatnonzero(np.isin(estimated, linearisation.state.mounts))
    influence = inverse[mount]  # (k, f)
    by_slot = np.einsum("kf,gfh->gkh", influence, normals)
    expected = np.einsum("gkh,kh->gk", by_slot, influence) - np.einsum("gkh,hi,gki->gk", by_slot, inverse, by_slot)
    found = (scores @ influence.T) ** 2
    total, squares = expected.sum(axis=0), np.sum(expected**2, axis=0)
    seen = total > ROUNDING * np.diag(inverse)[mount]
    ratio, dof = np.zeros((2, len(mount)))
    np.divide(found.sum(axis=0), total, out=ratio, where=seen)
    np.divide(total**2, squares, out=dof, where=seen)
    return ScoreCheck(ratio, dof)


def largest_ratio(dof: float, level: float) -> float:
    """Return the value that T with ν = ``dof`` exceeds with the chance ``level``, if the sigma is right.

    >>> round(largest_ratio(10.0, 0.05), 3)  # χ²₁₀ exceeds 18.31 with 5 %
    1.831
    """
    from scipy.special import chdtri

    return float(chdtri(dof, level)) / dof


def _slots(
    linearisation: Linearisation, drift: DriftEstimate, noise: PoseNoise, estimated: Integers
) -> list[NormalEquations]:
    """Return the normal equations of each slot, whose drift starts anew."""
    spans, knots = _spans_of_slots(drift.knots), drift.knots
    group = np.full(len(knots.inner), len(spans))  # a span between two passes is in no slot
    for number, (first, last) in enumerate(spans):
        group[first:last] = number
    reduced = reduced_by_group(linearisation, knots, noise.white, group, estimated)
    slots = []
    for number, (first, last) in enumerate(spans):
        own = Knots(knots.record[first : last + 1], knots.seconds[first : last + 1], knots.inner[first:last])
        of_slot = ReducedIntervals(
            reduced.spans[first:last], reduced.others[number], float(reduced.log_determinant[number])
        )
        slots.append(eliminate_drift(of_slot, noise, DriftEstimate(own, drift.values[first : last + 1])))
    return slots


def _spans_of_slots(knots: Knots) -> list[tuple[int, int]]:
    """Return the first span of each slot, and the one after its last. Slots end at gaps between observations."""
    slots, first, last = [], 0, len(knots.inner) - 1
    for span in np.flatnonzero(knots.inner).tolist():
        if span == last or not knots.inner[span + 1] or knots.seconds[span + 1] - knots.seconds[first] >= SLOT_S:
            slots.append((first, span + 1))
            first = span + 1
        if span < last and not knots.inner[span + 1]:
            first = span + 2
    return slots
