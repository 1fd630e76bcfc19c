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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.eliminate_drift import NormalEquations, eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import ReducedIntervals
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
    reduced: ReducedIntervals,
    noise: PoseNoise,
    drift: DriftEstimate,
    prior: PseudoObservations | None,
    estimated: Integers,
    checked: Integers,
) -> ScoreCheck:
    """Return the check of the sigmas.

    Parameters
    ----------
    reduced : ReducedIntervals
        Normal equations by span between two knots, of all parameters, at the adjusted values.
    noise : PoseNoise
        Standard deviations of the pose errors.
    drift : DriftEstimate
        The drift with which the observations were taken.
    prior : PseudoObservations or None
        Prior information about the surfaces.
    estimated, checked : (f,) and (k,) arrays
        The estimated parameters, ascending; those of them whose sigmas are checked.
    """
    slots = [
        (equations.normal[np.ix_(estimated, estimated)], equations.right[estimated])
        for equations in _of_slots(reduced, noise, drift)
    ]
    normals, rights = np.array([normal for normal, _ in slots]), np.array([right for _, right in slots])
    N, b = normals.sum(axis=0), rights.sum(axis=0)
    if prior is not None:
        N, b = N + prior.normal[np.ix_(estimated, estimated)], b + prior.right[estimated]
    inverse = np.linalg.pinv(N, hermitian=True)
    scores = rights - normals @ (inverse @ b)
    influence = inverse[np.searchsorted(estimated, checked)]  # (k, f)
    by_slot = np.einsum("kf,gfh->gkh", influence, normals)
    expected = np.einsum("gkh,kh->gk", by_slot, influence) - np.einsum("gkh,hi,gki->gk", by_slot, inverse, by_slot)
    found = (scores @ influence.T) ** 2
    total, squares = expected.sum(axis=0), np.sum(expected**2, axis=0)
    seen = total > ROUNDING * np.diag(inverse)[np.searchsorted(estimated, checked)]
    ratio, dof = np.zeros((2, len(checked)))
    np.divide(found.sum(axis=0), total, out=ratio, where=seen)
    np.divide(total**2, squares, out=dof, where=seen)
    return ScoreCheck(ratio, dof)


def _of_slots(reduced: ReducedIntervals, noise: PoseNoise, drift: DriftEstimate) -> Iterator[NormalEquations]:
    """Yield the normal equations of each slot that has observations."""
    knots = drift.knots
    first, last = 0, len(knots.inner)
    for span in range(last):
        ends = span + 1 == last or not knots.inner[span + 1]
        if not knots.inner[span]:
            first = span + 1
        elif ends or knots.seconds[span + 1] - knots.seconds[first] >= SLOT_S:
            part, places = slice(first, span + 1), slice(first, span + 2)
            own = Knots(knots.record[places], knots.seconds[places], knots.inner[part])
            normal = ReducedIntervals(reduced.normal[part], 0.0)
            yield eliminate_drift(normal, noise, DriftEstimate(own, drift.values[places]))
            first = span + 1
