"""The stochastic model: variance factors of the sensors' noise and of errors that intervals share; robust weights.

**Sensors.** Each sensor has a variance factor f for each family of faces, because its noise depends on what it sees: a
beam of 1° spreads over decimetres of slant range on a face at 45° along track, and over millimetres on a wall. f
follows from the scatter of each interval's points about a plane of their own. When v is fitted by (1, α, β) within an
interval, pose, mount and surface have no effect. Only the sensor's noise remains (pure error, Draper & Smith 1998,
2.1). The expectation of the remaining Σ w v² is f times n - rank, where all weights are 1 / σ². The rank is 3 if the
points spread over the surface and 2 if they lie on a line, like those of one ping. (Noise moves the points of a line
aside, and a fit to that direction would remove the noise: f came out a third too small.) Robust weights remove a part
of the variance of good observations too, so the expectation is multiplied by the part that they leave
(:func:`~pipeline.maths.adjustment.robust_weights.robust_effects`). Where few intervals see a family, f is drawn to the
sensor's other families: :func:`shrunk_factors`.

**Near edges.** A point near an edge has the weight e / σ², 0 < e < 1, so that it begins to count little by little. But
its noise is σ, like that of any other. Weighted so, n points give a mean whose variance is not σ² / Σ e, but Σ (e σ)² /
(Σ e)² = κ σ² / Σ e with the *edge share* κ = Σ e² / Σ e of the family. With weights divided by κ the inverse of the
normal equations is the covariance again, so the weights of a family are e / (κ f σ²), and Σ e / κ is the effective
number of its points. This is exact for the mean of a family on which σ does not go with e; for turns, for which points
near the edges tell most, the sigmas stay a little too large. (κ is 0.86 on the default target's tops, 0.95 on its
slanted faces. Without it, sigmas came out up to a tenth too large.) What is left of Σ w v² in an interval has the
expectation (Σ e - rank Σ e² / Σ e) / κ, as if e did not depend on the place in the interval; where it does, f comes out
up to 5 % too large.

**In common.** The points of an interval share errors: the white noise of the INS's records, whose variance factor
follows from the laser's points (:mod:`~pipeline.maths.adjustment.record_noise`), and those that the soundings of a ping
share (:mod:`~pipeline.maths.adjustment.ping_noise`). The white noise goes into the normal equations and into the design
(:func:`pipeline.maths.adjustment.design_matrix.sensor_noise`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import N_MOVED, Intervals, IntervalSums, blocks
from pipeline.maths.adjustment.pose_errors import N_POSE, PoseNoise
from pipeline.maths.adjustment.robust_weights import NOT_REDUCED, RobustEffects, igg3_weights, robust_effects

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

FEWEST = 6  # smallest number of points of an interval that is used
FLAT = 1e-5  # an eigenvalue of the scaled sums below this counts as zero: 3 mm aside of a line, seen from a metre
PRIOR_DOF = 8.0  # degrees of freedom that what is known of other families counts as, beside a family's own
CERTAIN = 3.0  # sigmas by which a variance factor must differ from 1 to be applied, if it is not sure
SURE, UNLIKELY = 0.1, 100.0  # sigma, as a share of a factor above 1, below which the white noise's is applied; largest


@dataclass(frozen=True)
class Scatter:
    """Σ w v² about the intervals' own planes, with the weights of the sums, and its expectation at these weights.

    ``dof`` is this expectation: the number of degrees of freedom, times the part of the variance that robust weights
    leave.
    """

    squares: float
    dof: float

    @property
    def factor(self) -> float:
        """Return the variance factor; 1 without degrees of freedom."""
        return self.squares / self.dof if self.dof > 0 else 1.0


def scatter(sums: Intervals, rows: NDArray[np.bool_], kept: float, edge_shares: Array | None = None) -> Scatter:
    """Return the scatter of some intervals together. Intervals of few points are left out.

    Parameters
    ----------
    sums : Intervals
        The sensor's intervals.
    rows : (g,) array of bool
        Those that are used.
    kept : float
        The part of the variance that the robust weights leave.
    edge_shares : (s,) array, optional
        Edge shares κ by surface, by which the weights of the sums are divided; by default 1.
    """
    parts = [_scatter(block, edge_shares) for block in blocks(sums, np.flatnonzero(rows))]
    return Scatter(sum(squares for squares, _ in parts), kept * sum(freedom for _, freedom in parts))


def _scatter(sums: IntervalSums, edge_shares: Array | None) -> tuple[float, float]:
    """Return Σ w v² about the planes of some intervals, and the degrees of freedom."""
    use = np.flatnonzero(sums.count >= FEWEST)
    normal, right = sums.normal[use, :N_MOVED, :N_MOVED], sums.right[use, :N_MOVED]
    scale = 1 / np.sqrt(np.maximum(np.einsum("gii->gi", normal), 1e-300))
    values, vectors = np.linalg.eigh(normal * scale[:, :, None] * scale[:, None, :])
    determined = values > FLAT
    along = np.einsum("gik,gi->gk", vectors, right * scale)
    fitted = np.sum(np.where(determined, along**2 / np.where(determined, values, 1.0), 0.0), axis=1)
    count, share = sums.count[use], 1.0 if edge_shares is None else edge_shares[sums.surface[use]]
    freedom = (count - determined.sum(axis=1) * sums.squared_count[use] / count) / share
    return float(np.sum(sums.squares[use] - fitted)), float(np.sum(freedom))


def edge_shares(sums: Intervals, n_surfaces: int) -> Array:
    """Return the edge share κ = Σ e² / Σ e (s,) of each surface; 1 without points."""
    count, squared = np.zeros((2, n_surfaces))
    for block in blocks(sums):
        for total, part in ((count, block.count), (squared, block.squared_count)):
            total += np.bincount(block.surface, weights=part, minlength=n_surfaces)
    return np.divide(squared, count, out=np.ones(n_surfaces), where=count > 0)


def shrunk_factors(factors: Array, dof: Array, level: NDArray[np.bool_]) -> Array:
    """Return the variance factors (s,) of one sensor by surface, those of few observations drawn to the others.

    The mean of two estimates of a variance with ν and ν₀ degrees of freedom, weighted by these, is that of all squares
    together. So f = (ν₀ f₀ + ν f_own) / (ν₀ + ν), where f₀ is what the other surfaces say, and counts as ν₀ = PRIOR_DOF
    (Smyth 2004, "Linear models and empirical Bayes methods", eq. 3). With ν = 30 a family has four fifths of its own
    factor, with ν = 1000 all of it. f₀ is the factor of all surfaces of equal kind (horizontal or not), drawn in the
    same way to that of all the sensor's surfaces, which is drawn to 1: the session's sigmas.

    Parameters
    ----------
    factors, dof : (s,) arrays
        Variance factor of each surface alone, against the session's sigmas, and its degrees of freedom.
    level : (s,) array of bool
        The horizontal surfaces.
    """
    of_sensor = _drawn(factors, dof, 1.0)
    result = np.empty(len(dof))
    for kind in (level, ~level):
        of_kind = _drawn(factors[kind], dof[kind], of_sensor)
        result[kind] = (PRIOR_DOF * of_kind + dof[kind] * factors[kind]) / (PRIOR_DOF + dof[kind])
    return result


def _drawn(factors: Array, dof: Array, prior: float) -> float:
    """Return the common factor of several surfaces, drawn to the prior one."""
    return float((PRIOR_DOF * prior + dof @ factors) / (PRIOR_DOF + dof.sum()))


def rescaled(sums: IntervalSums, divisors: Array) -> IntervalSums:
    """Return the sums with the weights divided by a number for each surface, (s,)."""
    share = 1 / divisors[sums.surface]
    names = ("normal", "swept", "swept_twice", "right", "right_swept", "squares")
    parts = {name: getattr(sums, name) for name in names}
    changed = {name: part * share.reshape(-1, *[1] * (part.ndim - 1)) for name, part in parts.items()}
    return replace(sums, **changed)


@dataclass(frozen=True)
class EpochVarianceFactor:
    """Variance factor of the error that an interval's points share, and its sigma (infinite: unknown)."""

    factor: float
    sigma: float


def common_variance(by_pose: Array, share: Array, white: Array) -> Array:
    """Return the variance (n,) m² of the records' white noise in v. Points of an interval have this noise in common.

    At the place s between two records the pose error is e = (1 - s) w_k + s w_{k+1}, with covariance ((1 - s)² + s²) W.
    It changes v by q · K e.

    Parameters
    ----------
    by_pose : (6, n) array
        Derivatives q · K of v by the pose error.
    share : (n,) array
        Places s, from 0 to 1.
    white : (6,) array
        Standard deviations of a record's noise, m and rad.
    """
    return np.asarray(((1 - share) ** 2 + share**2) * (white**2 @ by_pose**2))


def noise_seen_by_laser(noise: PoseNoise, laser: EpochVarianceFactor) -> PoseNoise:
    """Return the noise, its white part multiplied by the laser's variance factor if that is known well enough.

    It is, if its sigma is small (SURE), or if it differs from 1 by more than CERTAIN sigmas: then the stated noise is
    the worse of both. (Without any white noise its estimate is negative as often as not.)
    """
    is_sure = laser.sigma < SURE * max(laser.factor, 1.0) or abs(laser.factor - 1) > CERTAIN * laser.sigma
    return noise.scaled(min(max(laser.factor, 1 / UNLIKELY), UNLIKELY)) if is_sure else noise


class Residuals(Protocol):
    """Residuals of n points of a sensor: distance v_m from the surface; sigma_m; common_m, see :class:`Weighting`."""

    @property
    def sensor(self) -> str:
        """The sensor that observed the points."""
        ...

    @property
    def surface(self) -> Integers:
        """Numbers (n,) of their surfaces."""
        ...

    @property
    def edge_weight(self) -> Array:
        """Weights (n,) by the distance from edges, 0 to 1."""
        ...

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


@dataclass(frozen=True)
class Weighting:
    """Variance factors f, edge shares κ and robust scales (s,) by sensor and surface, and the bounds of IGG III.

    white (6,): standard deviations of the white noise of the INS's records, m and rad. A sensor without factors, shares
    or scales has 1 for all surfaces. Bounds None: no weight is reduced. Residuals are normalised by sqrt(f σ² + c²), c
    being the INS's white noise common to the points of an interval. Without c, points at grazing incidence (σ = 1 mm)
    would be rejected because of the INS's 2 mm. In a trial they were rejected, and the sigmas of the result came out
    3 % too small.
    """

    factors: Mapping[str, Array] = field(default_factory=dict)
    edge_shares: Mapping[str, Array] = field(default_factory=dict)
    scales: Mapping[str, Array] = field(default_factory=dict)
    robust: tuple[float, float] | None = None
    white: Array = field(default_factory=lambda: np.zeros(N_POSE))

    @property
    def robust_effects(self) -> RobustEffects:
        """What the robust weights do to good observations, and to the means of intervals."""
        return NOT_REDUCED if self.robust is None else robust_effects(*self.robust)

    def weights(self, residuals: Residuals) -> tuple[Array, Array]:
        """Return the robust weights w (n,) and the full weights w e / (κ f σ²) (n,), e being the weight near edges."""
        size = self.normalised(residuals) / _of_surfaces(self.scales, residuals.sensor, residuals.surface)
        robust = np.ones(len(size)) if self.robust is None else igg3_weights(size, *self.robust)
        return robust, robust * self.plain_weights(residuals)

    def plain_weights(self, residuals: Residuals) -> Array:
        """Return the weights e / (κ f σ²) (n,), not reduced for large residuals."""
        sensor, surface = residuals.sensor, residuals.surface
        variance = residuals.sigma_m**2 * self.factors_of(sensor, surface)
        return np.asarray(residuals.edge_weight / (variance * self.edge_shares_of(sensor, surface)))

    def normalised(self, residuals: Residuals) -> Array:
        """Return v / sqrt(f σ² + c²) (n,)."""
        factor = self.factors_of(residuals.sensor, residuals.surface)
        return residuals.v_m / np.sqrt(factor * residuals.sigma_m**2 + residuals.common_m**2)

    def factors_of(self, sensor: str, surface: Integers) -> Array:
        """Return the variance factors (n,) of a sensor's observations of these surfaces (n,)."""
        return _of_surfaces(self.factors, sensor, surface)

    def edge_shares_of(self, sensor: str, surface: Integers) -> Array:
        """Return the edge shares (n,) of a sensor's observations of these surfaces (n,)."""
        return _of_surfaces(self.edge_shares, sensor, surface)


def _of_surfaces(values: Mapping[str, Array], sensor: str, surface: Integers) -> Array:
    return values[sensor][surface] if sensor in values else np.ones(len(surface))
