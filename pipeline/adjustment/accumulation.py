"""One reading of all labelled points: sums by interval at the current values, and new variance factors."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import N_FEATURES, CurrentValues, ObservationModel
from pipeline.adjustment.point_sums import COLUMNS, summed
from pipeline.adjustment.stored_sums import StoredSums
from pipeline.artefacts.streams import Batch, Stream
from pipeline.maths.adjustment.interval_sums import Intervals, IntervalSums
from pipeline.maths.adjustment.parameters import State, kind_of
from pipeline.maths.adjustment.robust_weights import LEAST_SCALE, robust_scale
from pipeline.maths.adjustment.weighting import Weighting, edge_shares, rescaled, scatter, shrunk_factors
from pipeline.maths.kernels.interval_group import COUNT, CUT, FIRST_BIN, INFORMATION, REDUCED

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
PRIOR_POINTS = 22  # all points of a sensor count as this many beside those on a surface, for its robust scale
Group = tuple[str, int]  # observations of one sensor on one surface: name of the sensor, number of the surface


@dataclass(frozen=True)
class GroupStatistics:
    """Statistics of a group of observations.

    count: number of observations; cut: number of observations with the robust weight zero; reduced: number with a
    robust weight between zero and one; information: number of those not cut, each counted by its weight near edges;
    histogram: counts of the normalised |v|.
    """

    count: int
    cut: int
    reduced: int
    information: float
    histogram: Array

    def __add__(self, other: "GroupStatistics") -> "GroupStatistics":
        return GroupStatistics(
            **{name: getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__}
        )


@dataclass(frozen=True)
class Accumulation:
    """Result of one reading of all points: interval sums by sensor, and statistics by group of observations."""

    sums: Mapping[str, Intervals]
    groups: Mapping[Group, GroupStatistics]

    @property
    def records(self) -> Integers:
        """The INS records that begin an interval of any sensor, ascending, each once."""
        return np.unique(np.concatenate([sums.record for sums in self.sums.values()]))

    def observations(self, sensor: str) -> int:
        """Return the number of a sensor's observations."""
        return sum(group.count for (name, _), group in self.groups.items() if name == sensor)

    def robust_scales(self, n_surfaces: int) -> dict[str, Array]:
        """Return the robust scales (s,) of the normalised |v| by sensor and surface.

        The median of few |v| scatters. So all points of the sensor are added, with the weight of PRIOR_POINTS.
        """
        scales = {}
        for sensor in self.sums:
            histograms = {number: group.histogram for (name, number), group in self.groups.items() if name == sensor}
            total = np.sum(list(histograms.values()), axis=0)
            usual = total * (PRIOR_POINTS / total.sum())
            scales[sensor] = np.array([robust_scale(usual + histograms.get(k, 0.0)) for k in range(n_surfaces)])
        return scales


def _accumulate_batch(
    batch: Batch, model: ObservationModel, sensor: str, values: CurrentValues
) -> tuple[IntervalSums, dict[Group, GroupStatistics]]:
    of_batch = summed(batch, model, sensor, values)
    groups = {}
    for surface in np.flatnonzero(of_batch.statistics[:, COUNT]).tolist():
        row = of_batch.statistics[surface]
        groups[sensor, surface] = GroupStatistics(
            count=int(row[COUNT]),
            cut=int(row[CUT]),
            reduced=int(row[REDUCED]),
            information=float(row[INFORMATION]),
            histogram=row[FIRST_BIN:],
        )
    return of_batch.sums, groups


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
    groups: dict[Group, GroupStatistics] = {}

    def pieces(sensor: str, stream: Stream) -> Iterator[IntervalSums]:
        for piece, statistics in stream.only(COLUMNS[kind_of(sensor)]).fold(_accumulate_batch, model, sensor, values):
            for key, group in statistics.items():
                groups[key] = groups[key] + group if key in groups else group
            yield piece

    sums = {name: StoredSums.of(pieces(name, stream), N_FEATURES[kind_of(name)]) for name, stream in streams.items()}
    return Accumulation(sums, groups)


def reweighted(accumulation: Accumulation, state: State, weighting: Weighting) -> tuple[Accumulation, Weighting]:
    """Return the sums rescaled by new variance factors and edge shares, and the weighting with these.

    The scatter within the intervals changes the factor of each sensor and surface. Where it has few degrees of freedom,
    the sensor's other surfaces count as well.

    Parameters
    ----------
    accumulation : Accumulation
        Sums with the weights of ``weighting``.
    state : State
        State with the surfaces.
    weighting : Weighting
        Weights with which the sums were made.
    """
    factors, shares = dict(weighting.factors), dict(weighting.edge_shares)
    sums: dict[str, Intervals] = {}
    surfaces, level = np.arange(len(state.surfaces)), np.array([surface.level for surface in state.surfaces])
    for sensor, intervals in accumulation.sums.items():
        factor, share = weighting.factors_of(sensor, surfaces), weighting.edge_shares_of(sensor, surfaces)
        kept = weighting.robust_effects.kept
        parts = [scatter(intervals, intervals.surface == number, kept, share) for number in surfaces]
        change, dof = np.array([(part.factor, part.dof) for part in parts]).T
        factors[sensor] = shrunk_factors(np.maximum(factor * change, LEAST_SCALE**2), dof, level)
        shares[sensor] = edge_shares(intervals, len(surfaces))
        divisors = factors[sensor] * shares[sensor] / (factor * share)
        sums[sensor] = intervals.changed(partial(by_divisors, divisors=divisors))
    return replace(accumulation, sums=sums), replace(weighting, factors=factors, edge_shares=shares)


def by_divisors(sums: IntervalSums, _: Integers, divisors: Array) -> IntervalSums:
    """Return the sums with the weights divided by a number for each surface (s,), as a change of intervals."""
    return rescaled(sums, divisors)
