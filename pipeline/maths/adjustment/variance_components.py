"""Variance factors: of the sensors' noise, and of what the points of an epoch have in common.

**Sensors**, from the scatter of each epoch's points about a plane of its own. With v fitted by (1, α, β) within an
epoch, neither pose nor mount nor surface matters: what is left is the sensor's noise alone (pure error, Draper & Smith
1998, 2.1). Its expectation is f times n - rank, the rank being 3 where the points spread over the surface and 2 where
they lie on a line, as those of one ping do. (But for what the noise moves them aside, and a fit to that direction would
take the noise away: f came out a third too small.)

**In common**, from the epochs' means m = Σ w v / Σ w. Of an epoch with q̄ = Σ w q / Σ w, K its design of pose errors and
W the white noise of a record,

    E m² = 1 / Σ w + f c,     c = ((1 - s)² + s²) q̄ᵀ K W Kᵀ q̄,

so that f follows by regression with weights c / (1 / Σ w + f c)², which are those of maximum likelihood (twice: the
first with f = 1). The laser's f is the white noise of the INS against what the session says. The sonar's has in it,
besides, what only a ping has in common: an unsteady clock, beams stabilised by another attitude than the INS's.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import MOVING, EpochSums

Array = NDArray[np.float64]
FEWEST = 6  # points of an epoch
FLAT = 1e-5  # an eigenvalue of the scaled moments below this is none: 3 mm aside of a line seen from a metre


@dataclass(frozen=True)
class Scatter:
    """Σ w v² about the epochs' own planes, in the sums' weights, and its degrees of freedom."""

    squares: float
    free: float

    @property
    def factor(self) -> float:
        return self.squares / self.free if self.free > 0 else 1.0


def scatter(sums: EpochSums, rows: NDArray[np.bool_]) -> Scatter:
    """Of some epochs together; those of few points are left out."""
    use = np.flatnonzero(rows & (sums.count >= FEWEST))
    normal, right = sums.normal[use][:, :MOVING, :MOVING], sums.right[use][:, :MOVING]
    scale = 1 / np.sqrt(np.maximum(np.einsum("gii->gi", normal), 1e-300))
    values, vectors = np.linalg.eigh(normal * scale[:, :, None] * scale[:, None, :])
    there = values > FLAT
    along = np.einsum("gik,gi->gk", vectors, right * scale)
    fitted = np.sum(np.where(there, along**2 / np.where(there, values, 1.0), 0.0), axis=1)
    return Scatter(float(np.sum(sums.squares[use] - fitted)), float(np.sum(sums.count[use] - there.sum(axis=1))))


def rescaled(sums: EpochSums, factor_by_surface: Mapping[int, float]) -> EpochSums:
    """Weights divided by a factor of each surface."""
    share = 1 / np.array([factor_by_surface[k] for k in range(len(factor_by_surface))])[sums.surface]
    names = ("normal", "swept", "swept_twice", "right", "right_swept", "squares")
    parts = {name: getattr(sums, name) for name in names}
    scaled = {name: part * share.reshape(-1, *[1] * (part.ndim - 1)) for name, part in parts.items()}
    return EpochSums(sums.record, sums.surface, **scaled, count=sums.count)


@dataclass(frozen=True)
class Common:
    """Variance factor of what an epoch's points have in common, and its standard deviation (infinite: unknown)."""

    factor: float
    sigma: float


def common(sums: EpochSums, poses: Array, white: Array) -> Common:
    """``poses`` (s, 3, 6): K by surface; ``white`` (6,) standard deviations."""
    information = sums.normal[:, 0, 0]
    pull = np.einsum("gi,gij->gj", sums.normal[:, 0, :MOVING] / information[:, None], poses[sums.surface])
    share = sums.share
    c = ((1 - share) ** 2 + share**2) * np.sum((pull * white) ** 2, axis=1)
    own, squared = 1 / information, (sums.right[:, 0] / information) ** 2
    factor, weight = 1.0, 0.0
    for _ in range(2):
        by_variance = c / (own + max(factor, 0.0) * c) ** 2
        weight = float(np.sum(by_variance * c))
        if weight <= 0:
            return Common(1.0, np.inf)
        factor = float(np.sum(by_variance * (squared - own))) / weight
    return Common(factor, float(np.sqrt(2 / weight)))
