"""The stochastic model: variance factors of the groups of observations, and robust weights."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch
from pipeline.maths.adjustment.interval_sums import Runs
from pipeline.maths.adjustment.observations import sensor_part
from pipeline.maths.adjustment.robust import igg3_weights

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
GROUPS = ("laser", "mbes_vertical", "mbes_horizontal")


@dataclass(frozen=True)
class Weighting:
    """Variance factors f and robust scales by group, and IGG III's bounds (None: nothing is reduced).

    A residual is large or small against all that it is expected to have in it, f σ² and what its epoch shares: on a
    face that the laser grazes σ is 1 mm, and the INS's 2 mm are no outliers. (Held against σ alone they were cut, and
    the sigmas of the result came out 3 % too small.)
    """

    factors: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    scales: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    robust: tuple[float, float] | None = None

    def weights(self, seen: "Observations") -> tuple[Array, Array]:
        """Robust weights w (n,) and full weights w / (σ² f) (n,)."""
        scales = np.array([self.scales[name] for name in GROUPS])[seen.group]
        size = self.normalised(seen) / scales
        robust = np.ones(len(size)) if self.robust is None else igg3_weights(size, *self.robust)
        return robust, robust / (seen.sigma_m**2 * self.factor(seen.group))

    def normalised(self, seen: "Observations") -> Array:
        """v / root(f σ² + what the epoch shares) (n,)."""
        return seen.v_m / np.sqrt(self.factor(seen.group) * seen.sigma_m**2 + seen.common_m**2)

    def factor(self, group: Integers) -> Array:
        """Variance factors (n,) by group."""
        return np.array([self.factors[name] for name in GROUPS])[group]


@dataclass(frozen=True)
class Observations:
    """Of a batch (n,) by surface and time, so that epochs lie together: its points; the record of the INS before each,
    the share of the step to the next, surface, group of observations, v (m) less the mean of its noise, that mean (m),
    sigma (m), what its epoch shares of the INS's white noise (m), features (F, n) and slopes (F - 1, n) of
    :mod:`pipeline.maths.adjustment.observations`."""

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

    def adjusted(self, weight: Array) -> Array:
        """Features at the adjusted points: free of the noise that is in v."""
        own = sensor_part(self.v_m, weight, Runs.of(self.record, self.surface), self.common_m)
        return np.concatenate([self.features[:1], self.features[1:] - self.slopes * own])
