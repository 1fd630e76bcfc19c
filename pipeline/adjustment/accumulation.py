"""One reading of all labelled points: sums by interval at the current values, and new variance factors."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.artefacts.streams import Batch, Stream
from pipeline.maths.adjustment.interval_sums import IntervalSums, LinearisedPoints, interval_sums, merged
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.weighting import (
    GROUPS,
    LEAST_SCALE,
    Weighting,
    group_of,
    histogram,
    rescaled,
    robust_scale,
    scatter,
)

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
LEAST_DOF = 30  # smallest number of degrees of freedom for a variance factor


@dataclass(frozen=True)
class GroupStatistics:
    """Statistics of a group of observations.

    count: number of observations; weights: sum of their robust weights; cut: number of observations with the robust
    weight zero; reduced: number with a robust weight between zero and one; histogram: counts of the normalised |v|.
    """

    count: int
    weights: float
    cut: int
    reduced: int
    histogram: Array

    def __add__(self, other: "GroupStatistics") -> "GroupStatistics":
        return GroupStatistics(
            **{name: getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__}
        )


@dataclass(frozen=True)
class Accumulation:
    """Result of one reading of all points: interval sums by sensor, and statistics by group of observations."""

    sums: Mapping[str, IntervalSums]
    groups: Mapping[str, GroupStatistics]

    @property
    def records(self) -> Integers:
        """The INS records that begin an interval of any sensor, ascending, each once."""
        return np.unique(np.concatenate([sums.record for sums in self.sums.values()]))

    def observations(self, sensor: str) -> int:
        """Return the number of a sensor's observations."""
        return sum(group.count for name, group in self.groups.items() if name.startswith(sensor))

    def robust_scales(self) -> dict[str, float]:
        """Return the robust scale of the normalised |v|, by group."""
        return {name: robust_scale(group.histogram) for name, group in self.groups.items()}


def _accumulate_batch(
    batch: Batch, model: ObservationModel, sensor: str, values: CurrentValues
) -> tuple[IntervalSums, dict[str, GroupStatistics]]:
    observations, weighting = model.linearise(sensor, batch, values), values.weighting
    robust, weight = weighting.weights(observations)
    normalised = weighting.normalised(observations)
    points = LinearisedPoints(
        record=observations.record,
        surface=observations.surface,
        share=observations.share,
        features=observations.features_at_adjusted(weight),
        weight=weight,
        v_m=observations.v_m,
    )
    groups = {}
    for number in np.flatnonzero(np.bincount(observations.group)).tolist():
        rows = observations.group == number
        w = robust[rows]
        cut = int(np.sum(w == 0))
        groups[GROUPS[number]] = GroupStatistics(
            count=len(w),
            weights=float(w.sum()),
            cut=cut,
            reduced=int(np.sum(w < 1)) - cut,
            histogram=histogram(normalised[rows]),
        )
    return interval_sums(points), groups


def accumulate(streams: Mapping[str, Stream], model: ObservationModel, values: CurrentValues) -> Accumulation:
    """Return the sums and the statistics over all points.

    Parameters
    ----------
    streams : mapping of Stream
        Labelled points by sensor.
    model : ObservationModel
        Model that turns points into observations.
    values : CurrentValues
        Parameters, drift and weights at which to linearise.
    """
    sums, groups = {}, dict[str, GroupStatistics]()
    for sensor, stream in streams.items():
        pieces = []
        for piece, statistics in stream.fold(_accumulate_batch, model, sensor, values):
            pieces.append(piece)
            for name, group in statistics.items():
                groups[name] = groups[name] + group if name in groups else group
        sums[sensor] = merged(pieces)
    return Accumulation(sums, {name: groups[name] for name in GROUPS if name in groups})


def reweighted(accumulation: Accumulation, state: State, weighting: Weighting) -> tuple[Accumulation, Weighting]:
    """Return the sums rescaled by new variance factors, and the weighting with these factors.

    The scatter within the intervals changes the factor of each group. A group with too few degrees of freedom takes the
    change of the sensor's other group; if both have too few, their factors stay.

    Parameters
    ----------
    accumulation : Accumulation
        Sums with the weights of ``weighting``.
    state : State
        State with the surfaces. The sonar's observations of horizontal surfaces are a group.
    weighting : Weighting
        Weights with which the sums were made.
    """
    factors, sums = dict(weighting.factors), {}
    for sensor, intervals in accumulation.sums.items():
        names = [GROUPS[group_of(sensor, surface.level)] for surface in state.surfaces]
        scatters = {
            name: scatter(intervals, np.array(names)[intervals.surface] == name) for name in dict.fromkeys(names)
        }
        enough = {name: max(part.factor, LEAST_SCALE**2) for name, part in scatters.items() if part.dof >= LEAST_DOF}
        default = next(iter(enough.values()), 1.0)
        changes = {name: enough.get(name, default) for name in scatters}
        factors |= {name: factors[name] * change for name, change in changes.items()}
        sums[sensor] = rescaled(intervals, {number: changes[name] for number, name in enumerate(names)})
    return replace(accumulation, sums=sums), replace(weighting, factors=factors)
