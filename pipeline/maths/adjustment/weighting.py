"""The stochastic model: variance factors of the sensors' noise and of errors that intervals share; robust weights.

**Sensors.** Their variance factor f follows from the scatter of each interval's points about a plane of their own. When
v is fitted by (1, α, β) within an interval, pose, mount and surface have no effect. Only the sensor's noise remains
(pure error, Draper & Smith 1998, 2.1). The expectation of the remaining Σ w v² is f times n - rank. The rank is 3 if
the points spread over the surface and 2 if they lie on a line, like those of one ping. (Noise moves the points of a
line aside, and a fit to that direction would remove the noise: f came out a third too small.)

**In common.** The variance factor of the error that an interval's points share follows from the intervals' means
m = Σ w v / Σ w. For an interval with q̄ = Σ w q / Σ w, K its design of pose errors and W the white noise of a record,

    E m² = 1 / Σ w + f c,     c = ((1 - s)² + s²) q̄ᵀ K W Kᵀ q̄,

so that f follows by regression with the weights of maximum likelihood, c / (1 / Σ w + f c)². The regression is done
twice, first with f = 1. The laser's f, the ratio of the INS's white noise to its value in the session, follows from
differences instead (:mod:`~pipeline.maths.adjustment.record_noise`), for the means lack what the drift took. The
sonar's f also contains the errors that all beams of a ping share: an unsteady clock, or beams stabilised by another
attitude than the INS's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import pose_design
from pipeline.maths.adjustment.interval_sums import N_MOVED, IntervalSums
from pipeline.maths.adjustment.parameters import ObservedSurface
from pipeline.maths.adjustment.pose_errors import PoseNoise

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BINS = np.linspace(0.0, 50.0, 2001)  # |residual| / sigma; larger ones count into the last bin
NORMAL_MEDIAN = 0.6744897501960817  # median of |standard normal|
LEAST_SCALE = 0.01  # no sensor's noise is a hundred times smaller than its stated sigma: less is rounding
FEWEST = 6  # smallest number of points of an interval that is used
FLAT = 1e-5  # an eigenvalue of the scaled sums below this counts as zero: 3 mm aside of a line, seen from a metre
GROUPS = ("laser", "mbes_vertical", "mbes_horizontal")  # groups of observations: one variance factor each
SURE, UNLIKELY = 0.1, 100.0  # sigma below which the white noise's factor is applied; largest factor, and its inverse


def igg3_weights(normalised: Array, k0: float, k1: float) -> Array:
    """Return the weights (n,) of IGG III (Yang 1999).

    They are 1 up to k0, k0 / |v| · ((k1 - |v|) / (k1 - k0))² up to k1, and 0 above.

    Parameters
    ----------
    normalised : (n,) array
        Residuals in units of their sigma.
    k0, k1 : float
        Largest residual with full weight, and with any weight.

    Examples
    --------
    >>> igg3_weights(np.array([0.0, 2.0, 7.0]), 3.0, 6.0)
    array([1., 1., 0.])
    """
    size = np.abs(normalised)
    middle = k0 / np.maximum(size, k0) * ((k1 - np.minimum(size, k1)) / (k1 - k0)) ** 2
    return np.where(size <= k0, 1.0, middle)


def histogram(normalised: Array) -> Array:
    """Return the counts of |v| in :data:`BINS`; counts of several batches add up, and their median gives the scale."""
    last = len(BINS) - 2
    width = BINS[-1] / (last + 1)
    return np.bincount(np.minimum(np.abs(normalised) / width, last).astype(np.int64), minlength=last + 1).astype(float)


def robust_scale(counts: Array) -> float:
    """Return the median of |v|, from the histogram, divided by NORMAL_MEDIAN; 1 without data.

    >>> round(robust_scale(histogram(np.random.default_rng(0).normal(scale=2.0, size=100_000))), 1)
    2.0
    """
    total = counts.sum()
    if total == 0:
        return 1.0
    cumulative = np.concatenate([[0.0], np.cumsum(counts)])
    return float(max(np.interp(total / 2, cumulative, BINS) / NORMAL_MEDIAN, LEAST_SCALE))


@dataclass(frozen=True)
class Scatter:
    """Σ w v² about the intervals' own planes, with the weights of the sums, and its degrees of freedom."""

    squares: float
    dof: float

    @property
    def factor(self) -> float:
        """Return the variance factor; 1 without degrees of freedom."""
        return self.squares / self.dof if self.dof > 0 else 1.0


def scatter(sums: IntervalSums, rows: NDArray[np.bool_]) -> Scatter:
    """Return the scatter of the intervals in the mask (g,) together. Intervals of few points are left out."""
    use = np.flatnonzero(rows & (sums.count >= FEWEST))
    normal, right = sums.normal[use][:, :N_MOVED, :N_MOVED], sums.right[use][:, :N_MOVED]
    scale = 1 / np.sqrt(np.maximum(np.einsum("gii->gi", normal), 1e-300))
    values, vectors = np.linalg.eigh(normal * scale[:, :, None] * scale[:, None, :])
    determined = values > FLAT
    along = np.einsum("gik,gi->gk", vectors, right * scale)
    fitted = np.sum(np.where(determined, along**2 / np.where(determined, values, 1.0), 0.0), axis=1)
    return Scatter(float(np.sum(sums.squares[use] - fitted)), float(np.sum(sums.count[use] - determined.sum(axis=1))))


def rescaled(sums: IntervalSums, factor_by_surface: Mapping[int, float]) -> IntervalSums:
    """Return the sums with the weights divided by the factor of their surface."""
    share = 1 / np.array([factor_by_surface[k] for k in range(len(factor_by_surface))])[sums.surface]
    names = ("normal", "swept", "swept_twice", "right", "right_swept", "squares")
    parts = {name: getattr(sums, name) for name in names}
    return replace(sums, **{name: part * share.reshape(-1, *[1] * (part.ndim - 1)) for name, part in parts.items()})


@dataclass(frozen=True)
class EpochVarianceFactor:
    """Variance factor of the error that an interval's points share, and its sigma (infinite: unknown)."""

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


def epoch_variance_factors(
    sums_by_sensor: Mapping[str, IntervalSums], surfaces: Sequence[ObservedSurface], white: Array
) -> dict[str, EpochVarianceFactor]:
    """Return the variance factor of the common error of an interval's points, by sensor.

    Parameters
    ----------
    sums_by_sensor : mapping of IntervalSums
        Intervals of each sensor.
    surfaces : sequence of ObservedSurface
        The surfaces, in the order of their numbers in the sums.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    """
    designs = pose_design(surfaces, np.arange(len(surfaces)))
    return {sensor: epoch_variance_factor(sums, designs, white) for sensor, sums in sums_by_sensor.items()}


def noise_seen_by_laser(noise: PoseNoise, laser: EpochVarianceFactor) -> PoseNoise:
    """Return the noise, its white part multiplied by the laser's variance factor if that is certain (SURE)."""
    if laser.sigma < SURE:
        return noise.scaled(min(max(laser.factor, 1 / UNLIKELY), UNLIKELY))
    return noise


def group_of(sensor: str, level: bool) -> int:
    """Return the number among GROUPS of a sensor's observations of a surface, which is horizontal if ``level``."""
    return 0 if sensor == "laser" else 2 if level else 1


class Residuals(Protocol):
    """Residuals of n points: distance v_m from the surface; sigma_m; common_m, see :class:`Weighting`; their group."""

    @property
    def v_m(self) -> Array:
        """Distances (n,) m from the surface."""
        ...

    @property
    def sigma_m(self) -> Array:
        """Their standard deviations (n,) m."""
        ...

    @property
    def common_m(self) -> Array:
        """Standard deviations (n,) m of the error that the points of an interval share."""
        ...

    @property
    def group(self) -> Integers:
        """Numbers (n,) among GROUPS."""
        ...


@dataclass(frozen=True)
class Weighting:
    """Variance factors f and robust scales by group, and the bounds of IGG III (None: no weight is reduced).

    Residuals are normalised by sqrt(f σ² + c²), c being the INS's white noise common to the points of an interval.
    Without c, points at grazing incidence (σ = 1 mm) would be rejected because of the INS's 2 mm. In a trial they were
    rejected, and the sigmas of the result came out 3 % too small.
    """

    factors: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    scales: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    robust: tuple[float, float] | None = None

    def weights(self, residuals: Residuals) -> tuple[Array, Array]:
        """Return the robust weights w (n,) and the full weights w / (σ² f) (n,)."""
        scales = np.array([self.scales[name] for name in GROUPS])[residuals.group]
        size = self.normalised(residuals) / scales
        robust = np.ones(len(size)) if self.robust is None else igg3_weights(size, *self.robust)
        return robust, robust / (residuals.sigma_m**2 * self.factors_of(residuals.group))

    def normalised(self, residuals: Residuals) -> Array:
        """Return v / sqrt(f σ² + c²) (n,)."""
        factor = self.factors_of(residuals.group)
        return residuals.v_m / np.sqrt(factor * residuals.sigma_m**2 + residuals.common_m**2)

    def factors_of(self, group: Integers) -> Array:
        """Return the variance factors (n,) of these groups (n,)."""
        return np.array([self.factors[name] for name in GROUPS])[group]
