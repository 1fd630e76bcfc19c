"""Errors of the recorded poses: white noise of each record, and drift, given at knots.

Both sensors hang on one body, so that at a moment they share the error e = (δ, ω) of its pose (target frame; X -> X +
δ + ω × r). Between records it is interpolated as the poses are, and it has two parts:

    e(t) = ξ(t) + (1 - s) w_k + s w_{k+1},        t = t_k + s (t_{k+1} - t_k)

* w_k: white noise of record k, w ~ N(0, W), W diagonal (position, attitude);
* ξ: drift, a first-order Gauss-Markov process of standard deviations σ (6,) and time constant τ, through all passes and
  the time between them (Gelb 1974, 3.8), given at *knots* and linear between them. Of two knots d apart,
  ξ_{j+1} = φ ξ_j + N(0, (1 - φ²) σ²), φ = exp(-d / τ). Linear interpolation leaves out what the process does between
  knots, up to σ √(d / 2τ): at 15 mm, 200 s and d = 0.5 s 0.5 mm, at 5 s 1.7 mm, which is too much.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SPACING = 1 / 400  # of knots, as a share of the time constant


@dataclass(frozen=True)
class PoseNoise:
    """Standard deviations: white (6,) of each record, drift (6,) with its time constant; zero: none."""

    white: Array
    drift: Array
    time_constant_s: float

    @property
    def spacing_s(self) -> float:
        return SPACING * self.time_constant_s

    def scaled(self, white: float, drift: float) -> "PoseNoise":
        """With other variances, by these factors."""
        return PoseNoise(self.white * np.sqrt(white), self.drift * np.sqrt(drift), self.time_constant_s)


@dataclass(frozen=True)
class Knots:
    """record (k,) ascending: the records of the INS that are knots; seconds (k,) their times; inner (k - 1,): whether
    observations may lie between a knot and the next (not between two passes)."""

    record: Integers
    seconds: Array
    inner: NDArray[np.bool_]

    def interval_of(self, record: Integers) -> Integers:
        """The interval, by its first knot, in which the step from each record to the next lies; (n,)."""
        return np.asarray(np.clip(np.searchsorted(self.record, record, side="right") - 1, 0, len(self.record) - 2))


def knots_of(record: Integers, seconds: Array, spacing_s: float, gap_s: float) -> Knots:
    """Knots for observations after these records (ascending, each once); ``seconds``: of all records of the INS.

    Evenly spaced over each run of records without a gap, at most ``spacing_s`` apart where records allow.
    """
    breaks = np.flatnonzero(np.diff(seconds[record]) > gap_s)
    found, inner = [], []
    for first, last in zip(record[np.r_[0, breaks + 1]], record[np.r_[breaks, len(record) - 1]] + 1, strict=True):
        wanted = max(1, int(np.ceil((seconds[last] - seconds[first]) / spacing_s)))
        times = np.linspace(seconds[first], seconds[last], wanted + 1)
        nearest = first + np.searchsorted(seconds[first : last + 1], times - 1e-9)
        run = np.unique(np.clip(nearest, first, last))
        found.append(run)
        inner.append(np.r_[np.ones(len(run) - 1, dtype=bool), False])
    knots = np.concatenate(found)
    return Knots(knots, seconds[knots], np.concatenate(inner)[:-1])


@dataclass(frozen=True)
class Drift:
    """The drift ξ found so far: values (k, 6) m and rad at its knots, target frame."""

    knots: Knots
    values: Array

    def at(self, seconds: Array) -> Array:
        """ξ (n, 6) at moments (n,), linear between the knots."""
        return np.array([np.interp(seconds, self.knots.seconds, column) for column in self.values.T]).T

    def moved(self, step: Array) -> "Drift":
        """After a step (k, 6)."""
        return Drift(self.knots, self.values + step)
