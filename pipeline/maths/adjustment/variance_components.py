"""Variance factors: of the sensors' noise, and of the error that all points of an interval have in common.

**Sensors**, from the scatter of each interval's points about a plane of its own. With v fitted by (1, α, β) within an
interval, neither pose nor mount nor surface matters: what is left is the sensor's noise alone (pure error, Draper &
Smith 1998, 2.1). Its expectation is f times n - rank, the rank being 3 where the points spread over the surface and 2
where they lie on a line, as those of one ping do. (Noise moves the points of a line aside, and a fit to that direction
would take the noise away: f came out a third too small.)

**In common**, from the intervals' means m = Σ w v / Σ w. For an interval with q̄ = Σ w q / Σ w, K its design of pose
errors and W the white noise of a record,

    E m² = 1 / Σ w + f c,     c = ((1 - s)² + s²) q̄ᵀ K W Kᵀ q̄,

so that f follows by regression with weights c / (1 / Σ w + f c)², which are those of maximum likelihood (twice: the
first with f = 1). The laser's f is the white noise of the INS against what the session says. The sonar's f contains,
besides, the errors that only a ping has in common: an unsteady clock, or beams stabilised by another attitude than the
INS's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import N_MOVED, IntervalSums

Array = NDArray[np.float64]
FEWEST = 6  # points of an interval
FLAT = 1e-5  # an eigenvalue of the scaled sums below this is none: 3 mm aside of a line seen from a metre


@dataclass(frozen=True)
class Scatter:
    """Σ w v² about the intervals' own planes, in the sums' weights, and its degrees of freedom."""

    squares: float
    dof: float

    @property
    def factor(self) -> float:
        """Variance factor; 1 without degrees of freedom."""
        return self.squares / self.dof if self.dof > 0 else 1.0


def scatter(sums: IntervalSums, rows: NDArray[np.bool_]) -> Scatter:
    """Return the scatter of the chosen intervals (g,) together; those of few points are left out."""
    use = np.flatnonzero(rows & (sums.count >= FEWEST))
    normal, right = sums.normal[use][:, :N_MOVED, :N_MOVED], sums.right[use][:, :N_MOVED]
    scale = 1 / np.sqrt(np.maximum(np.einsum("gii->gi", normal), 1e-300))
    values, vectors = np.linalg.eigh(normal * scale[:, :, None] * scale[:, None, :])
    determined = values > FLAT
    along = np.einsum("gik,gi->gk", vectors, right * scale)
    fitted = np.sum(np.where(determined, along**2 / np.where(determined, values, 1.0), 0.0), axis=1)
    return Scatter(float(np.sum(sums.squares[use] - fitted)), float(np.sum(sums.count[use] - determined.sum(axis=1))))


def rescaled(sums: IntervalSums, factor_by_surface: Mapping[int, float]) -> IntervalSums:
    """Return the sums with weights divided by a factor of each surface."""
    share = 1 / np.array([factor_by_surface[k] for k in range(len(factor_by_surface))])[sums.surface]
    names = ("normal", "swept", "swept_twice", "right", "right_swept", "squares")
    parts = {name: getattr(sums, name) for name in names}
    return replace(sums, **{name: part * share.reshape(-1, *[1] * (part.ndim - 1)) for name, part in parts.items()})


@dataclass(frozen=True)
class EpochVarianceFactor:
    """Variance factor of the error that an interval's points have in common, and its sigma (infinite: unknown)."""

    factor: float
    sigma: float


def epoch_variance_factor(sums: IntervalSums, pose_designs: Array, white: Array) -> EpochVarianceFactor:
    """Return the variance factor of the common error of an interval's points.

    Parameters
    ----------
    sums : IntervalSums
        Intervals of one sensor.
    pose_designs : (s, 3, 6) array
        Design K of pose errors by surface.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    """
    information = sums.normal[:, 0, 0]
    by_pose = np.einsum("gi,gij->gj", sums.normal[:, 0, :N_MOVED] / information[:, None], pose_designs[sums.surface])
    share = sums.share
    c = ((1 - share) ** 2 + share**2) * np.sum((by_pose * white) ** 2, axis=1)
    own, squared = 1 / information, (sums.right[:, 0] / information) ** 2
    factor, weight = 1.0, 0.0
    for _ in range(2):
        by_variance = c / (own + max(factor, 0.0) * c) ** 2
        weight = float(np.sum(by_variance * c))
        if weight <= 0:
            return EpochVarianceFactor(1.0, np.inf)
        factor = float(np.sum(by_variance * (squared - own))) / weight
    return EpochVarianceFactor(factor, float(np.sqrt(2 / weight)))
