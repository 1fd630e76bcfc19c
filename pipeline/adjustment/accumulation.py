"""One reading of the labelled points: sums by epoch at a state, and what the next reading's weights follow from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import Scene
from pipeline.adjustment.weighting import GROUPS, Weighting
from pipeline.artefacts.streams import Batch, Stream
from pipeline.maths.adjustment.interval_sums import EpochSums, epoch_sums, merged
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pose_errors import Drift
from pipeline.maths.adjustment.robust import LEAST_SCALE, histogram, scale_of
from pipeline.maths.adjustment.variance_components import rescaled, scatter

Array = NDArray[np.float64]
LEAST_FREE = 30  # degrees of freedom for a variance factor


@dataclass(frozen=True)
class Counts:
    """Of a group of observations: how many, Σ of robust weights, how many were cut, reduced; |v| against what is
    expected of it (histogram)."""

    count: int
    weights: float
    cut: int
    reduced: int
    histogram: Array

    def __add__(self, other: "Counts") -> "Counts":
        return Counts(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class Reading:
    """Both sensors' sums, counts by group."""

    sums: Mapping[str, EpochSums]
    counts: Mapping[str, Counts]

    def observations(self, sensor: str) -> int:
        return sum(one.count for name, one in self.counts.items() if name.startswith(sensor))


def _read(
    batch: Batch, scene: Scene, sensor: str, state: State, drift: Drift | None, weighting: Weighting
) -> tuple[EpochSums, dict[str, Counts]]:
    seen = scene.observe(sensor, batch, state, drift, weighting)
    robust, weight = weighting.weights(seen)
    normalised = weighting.normalised(seen)
    sums = epoch_sums(seen.record, seen.share, seen.surface, seen.adjusted(weight), weight, seen.v_m)
    counts = {}
    for number in np.flatnonzero(np.bincount(seen.group)).tolist():
        rows = seen.group == number
        w = robust[rows]
        cut = int(np.sum(w == 0))
        reduced = int(np.sum(w < 1)) - cut
        counts[GROUPS[number]] = Counts(len(w), float(w.sum()), cut, reduced, histogram(normalised[rows]))
    return sums, counts


def read(
    streams: Mapping[str, Stream], scene: Scene, state: State, drift: Drift | None, weighting: Weighting
) -> Reading:
    """All points of these sensors once."""
    sums, counts = {}, dict[str, Counts]()
    for sensor, stream in streams.items():
        pieces = []
        for piece, found in stream.fold(_read, scene, sensor, state, drift, weighting):
            pieces.append(piece)
            for name, one in found.items():
                counts[name] = counts[name] + one if name in counts else one
        sums[sensor] = merged(pieces)
    return Reading(sums, {name: counts[name] for name in GROUPS if name in counts})


def refactored(reading: Reading, state: State, weighting: Weighting) -> tuple[Reading, Weighting]:
    """The reading with the variance factors that its own scatter shows; a group too small for one takes the sensor's
    other."""
    flat = np.array([surface.level for surface in state.surfaces])
    factors, sums = dict(weighting.factors), {}
    for sensor, one in reading.sums.items():
        names = ["laser"] * len(flat) if sensor == "laser" else [GROUPS[2] if level else GROUPS[1] for level in flat]
        scatters = {name: scatter(one, np.array(names)[one.surface] == name) for name in dict.fromkeys(names)}
        enough = {name: max(by.factor, LEAST_SCALE**2) for name, by in scatters.items() if by.free >= LEAST_FREE}
        of_sensor = next(iter(enough.values()), 1.0)
        changes = {name: enough.get(name, of_sensor) for name in scatters}
        factors |= {name: factors[name] * change for name, change in changes.items()}
        sums[sensor] = rescaled(one, {number: changes[name] for number, name in enumerate(names)})
    return replace(reading, sums=sums), replace(weighting, factors=factors)


def scales_of(reading: Reading) -> dict[str, float]:
    """Robust scales of |v| against what is expected of it, by group."""
    return {name: scale_of(one.histogram) for name, one in reading.counts.items()}
