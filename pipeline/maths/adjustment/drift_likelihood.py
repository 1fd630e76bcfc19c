"""Figures of the INS's drift from the data: the factors of its sigmas and its time constant, by restricted likelihood.

The drift's sigmas and its time constant τ of a session are often guesses. If the INS errs faster than they say, the
adjustment takes errors of the pose for noise of the sensors, and its sigmas come out too small: 1.4 times at a tenth of
τ. But the data know: the laser sees the drift against the planes, thousands of times.

**Likelihood.** With the design A of the parameters x, C of the drift ξ at its knots, B of the records' white noise w,
and noise e of covariance P⁻¹,

    v = A x + C ξ + B w + e,      v ~ N(A x, V),      V = P⁻¹ + B Bᵀ + C K Cᵀ,

K the covariance of the Gauss-Markov process, by its figures θ. The likelihood of θ alone is that of v with x integrated
out under a flat prior (restricted likelihood: Patterson & Thompson 1971; as this integral Harville 1974). With x̂ the
least-squares estimate under V, the integral over x is a Gaussian one:

    -2 log L(θ) = (v - A x̂)ᵀ V⁻¹ (v - A x̂) + log det V + log det(Aᵀ V⁻¹ A) + (n - u) log 2π.

Without the last determinant τ and the sigmas would come out too small, for planes and mount follow a slow drift. By
elimination (Schur complements) V is never formed:

* log det V = log det P⁻¹ + ``log_determinant`` of :class:`NormalEquations`: log det(I + …) of the records' blocks, and
  log det(K⁻¹ + Cᵀ M C) + log det K of the knots;
* Aᵀ V⁻¹ A is their ``normal`` N, and the square is what remains at the solution: ``squares`` + b · x̂, N x̂ = -b.

Constants, which do not depend on θ: (n - u) log 2π, log det P⁻¹ with the robust weights of the last reading, and the
determinants of pseudo-observations of the surfaces, which add to N, b and ``squares``. Only the knots depend on θ, so
that one evaluation is one elimination of the knots, whatever the number of points.

**Prior.** What the session says of the drift is information as well. Each figure is right within a factor, log-normal:

    J(z) = -2 log L + Σ (z_i / s_i)²,      z = log(estimate / session's figure),

z for the sigmas of the shifts (position), for those of the turns (attitude), and for τ; s_i the logarithm of the factor
within which the session's figure holds (one sigma). Within a session not much longer than τ the data determine the rate
2 σ² / τ well, σ and τ themselves hardly: along this valley the prior decides. Within shifts, and within turns, the
components keep the session's ratios: the data hardly tell them apart.

**The laser's own calibration.** The points cannot tell the drift's mean over the session from the laser's roll and
pitch, which are known only as well as that mean: σ √(2 τ / T) for a session of T much longer than τ, σ for a shorter
one. An INS has slow errors beside fast ones. If τ followed the fast ones, which the points show, this sigma would be
too small. So there τ stays as the session says, and the sigmas may only grow, where the data are certain
of it (``only_larger``): with their rate 2 σ² / τ the fast drift has its true weight, and the slow one is not smaller
than the session says. A figure that does not grow is taken for the session's after the minimum is found; the other
keeps its value.

**Drift or something else.** What is wrong with the sonar, such as the sound speed, may look like drift from pass to
pass, and a parameter's test loses strength where a larger drift is allowed for. The fall of J from the session's
figures to the estimated ones compares both: with the session's figures, a parameter of z sigmas lets the squares fall
by z². The larger fall is the better explanation.

J is minimised by Newton's method (:mod:`~pipeline.maths.adjustment.newton`, 10 evaluations a step). Its second
derivatives give the covariance of z, 2 (∂²J)⁻¹. Along the valley J is far from quadratic, and this variance may exceed
the prior's. So data and session are compared by z_i / s_i alone. An estimate by both varies less than the prior (Var
z_true = Var estimate + Var of its error), so that this measure says too rarely, never too often, that they disagree.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.eliminate_drift import NormalEquations
from pipeline.maths.adjustment.newton import newton_minimum
from pipeline.maths.adjustment.pose_errors import SHIFTS, TURNS, PoseNoise

Array = NDArray[np.float64]
LARGEST_LOG = float(np.log(1000.0))  # bound of the log figures: beyond it the drift is as good as absent, or white
CERTAIN = 2.0  # standard deviations by which a logarithm must exceed zero, where figures may only grow
LEAST_LOG = 1e-6  # a figure known better than this is exact


@dataclass(frozen=True)
class DriftPrior:
    """Logarithms of the factors within which the session's figures are right (one sigma); 0: they are exact.

    sigma: of the drift's standard deviations; time_constant: of its time constant; only_larger: a standard deviation
    counts only if it is certainly larger than the session's.
    """

    sigma: float
    time_constant: float
    only_larger: bool = False


EXACT = DriftPrior(0.0, 0.0)


@dataclass(frozen=True)
class DriftFigures:
    """Figures of the drift by data and session.

    noise: the pose errors with these figures; log (3,): logarithms of the factors of the sigmas of shifts, of those of
    turns, and of the time constant; covariance (3, 3) of log; deviation (3,): log in sigmas of the prior (0: not
    estimated); gain: by how much J is smaller than with the session's figures.
    """

    noise: PoseNoise
    log: Array
    covariance: Array
    deviation: Array
    gain: float = 0.0

    @classmethod
    def of_session(cls, noise: PoseNoise) -> "DriftFigures":
        """Return the session's figures as they are."""
        return cls(noise, np.zeros(3), np.zeros((3, 3)), np.zeros(3))


def drift_figures(
    equations: Callable[[PoseNoise], NormalEquations], noise: PoseNoise, prior: DriftPrior
) -> DriftFigures:
    """Return the figures of the drift that data and session make most likely.

    Parameters
    ----------
    equations : callable
        The normal equations of the estimated parameters, for these pose errors.
    noise : PoseNoise
        The pose errors by the session's figures.
    prior : DriftPrior
        How well the session knows the drift's figures.
    """
    drifts = [bool(np.any(noise.drift[part] > 0)) for part in (SHIFTS, TURNS)]
    known = np.array([prior.sigma if drifts[0] else 0.0, prior.sigma if drifts[1] else 0.0, prior.time_constant])
    free = np.flatnonzero(known > LEAST_LOG) if noise.drifts else np.array([], dtype=np.int64)
    if not len(free):
        return DriftFigures.of_session(noise)
    z, covariance, deviation = np.zeros(3), np.zeros((3, 3)), np.zeros(3)

    def objective(values: Array) -> float:
        z = np.zeros(3)
        z[free] = values
        return restricted(equations(noise.drifting(*np.exp(z).tolist()))) + float(np.sum((values / known[free]) ** 2))

    found, curvature = newton_minimum(objective, len(free), LARGEST_LOG)
    z[free] = found
    of_free = 2 * np.linalg.inv(curvature)
    covariance[np.ix_(free, free)] = of_free
    if prior.only_larger:
        z[z < CERTAIN * np.sqrt(np.diag(covariance))] = 0.0
    deviation[free] = z[free] / known[free]
    gain = max(objective(np.zeros(len(free))) - objective(z[free]), 0.0)
    return DriftFigures(noise.drifting(*np.exp(z).tolist()), z, covariance, deviation, gain)


def restricted(equations: NormalEquations) -> float:
    """Return -2 log L, but for constants, of the figures with which these equations were made."""
    scale = 1 / np.sqrt(np.maximum(np.diag(equations.normal), 1e-300))
    scaled = equations.normal * np.outer(scale, scale)
    step = -scale * np.linalg.solve(scaled, scale * equations.right)
    of_parameters = float(np.linalg.slogdet(scaled)[1] - 2 * np.sum(np.log(scale)))
    return equations.squares + float(equations.right @ step) + equations.log_determinant + of_parameters
