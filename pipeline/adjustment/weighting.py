"""The stochastic model: variance factors of the groups of observations, and robust weights."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch
from pipeline.maths.adjustment.interval_sums import Runs
from pipeline.maths.adjustment.observations import sensor_noise
from pipeline.maths.adjustment.robust import igg3_weights

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
GROUPS = ("laser", "mbes_vertical", "mbes_horizontal")  # of observations: one variance factor each


def group_of(sensor: str, level: bool) -> int:
    """Return the number among GROUPS of a sensor's observations of a surface that is horizontal or not."""
    return 0 if sensor == "laser" else 2 if level else 1


@dataclass(frozen=True)
class Weighting:
    """Variance factors f and robust scales by group, and the bounds of IGG III (None: no weight is reduced).

    Residuals are normalised by sqrt(f σ² + c²), c being the INS's white noise common to the points of an interval.
    Without c, points at grazing incidence (σ = 1 mm) would be rejected for the INS's 2 mm; they were, and the sigmas of
    the result came out 3 % too small.
    """

    factors: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    scales: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    robust: tuple[float, float] | None = None

    def weights(self, observations: "Observations") -> tuple[Array, Array]:
        """Return the robust weights w (n,) and the full weights w / (σ² f) (n,)."""
        scales = np.array([self.scales[name] for name in GROUPS])[observations.group]
        size = self.normalised(observations) / scales
        robust = np.ones(len(size)) if self.robust is None else igg3_weights(size, *self.robust)
        return robust, robust / (observations.sigma_m**2 * self.factors_of(observations.group))

    def normalised(self, observations: "Observations") -> Array:
        """Return v / sqrt(f σ² + c²) (n,)."""
        factor = self.factors_of(observations.group)
        return observations.v_m / np.sqrt(factor * observations.sigma_m**2 + observations.common_m**2)

    def factors_of(self, group: Integers) -> Array:
        """Return the variance factors (n,) of these groups (n,)."""
        return np.array([self.factors[name] for name in GROUPS])[group]


@dataclass(frozen=True)
class Observations:
    """Observations of one batch (n,), ordered by surface and time, so that the points of an interval lie together.

    points: their columns; record: INS record before each; share: place between that record and the next; surface,
    group: numbers; v_m: distance from the surface less mean_m, the mean of its noise; sigma_m; common_m: the INS's
    white noise common to the interval; features (F, n) and slopes (F - 1, n): see
    :mod:`pipeline.maths.adjustment.observations`.
    """

    points: Batch
    record: Integers
    share: Array
    surface: Integers
    group: Integers
    v_m: Array
    mean_m: Array
    sigma_m: Array
    common_m: Array
    features: Array
    slopes: Array

    def features_at_adjusted(self, weight: Array) -> Array:
        """Return the features (F, n) at the adjusted points: uncorrelated with the noise in v."""
        noise = sensor_noise(self.v_m, weight, Runs.of(self.record, self.surface), self.common_m)
        return np.concatenate([self.features[:1], self.features[1:] - self.slopes * noise])
