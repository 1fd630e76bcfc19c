"""Stripes of height in which a face is not the plane that it is elsewhere: a footing, a ledge, growth, splash.

The mean residuals of a sensor on a face go with the height along a line, if the face is a plane (turned or shifted
as it may be). The line is a robust one (:mod:`~pipeline.maths.adjustment.profiles`). Heights off the line by more than
the tolerance and their noise are a stripe; at the ends of a face, near the water or its foot, also heights that are so
in the mean. It is made wider on both sides, because beams are wide and noise moves
points across its edges.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.adjustment.point_sums import summed
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.residual_places import heights_on_surface, places_on_surface
from pipeline.artefacts.streams import Batch, Stream
from pipeline.gps_time import NS
from pipeline.maths.adjustment.parameters import State, kind_of
from pipeline.maths.adjustment.profiles import (
    FEWEST_BINS,
    Profiles,
    off_line,
    profile_of,
    profiles_of,
    roughness_allowance,
)
from pipeline.maths.adjustment.residual_means import (
    BinMean,
    BinnedResiduals,
    ResidualSums,
    residual_sums,
)

Array = NDArray[np.float64]
BIN_M = 0.1  # height of a bin
AT_END = 6  # heights at either end of a face that may be off together
CERTAIN = 5.0  # sigmas by which a height must be off the line
JOINED_BINS = 3  # stripes with fewer good heights between them are one, and reach to the end of the face
BESIDE_M = 0.15  # by which a stripe is made wider
LEAST_SHARE = 0.05  # of the usual number of points: a height with fewer shows what a cut has left


@dataclass(frozen=True)
class Stripe:
    """Heights of a face, m above the water, at which a sensor's points are left out.

    off_m: by how much they stand off; points: how many lie on them.
    """

    sensor: str
    face: int
    low_m: float
    high_m: float
    off_m: float
    points: int

    def within(self, others: Sequence["Stripe"]) -> bool:
        """Return whether one of the others leaves out as much already, but for a height of a bin."""
        return any(
            (other.sensor, other.face) == (self.sensor, self.face)
            and other.low_m <= self.low_m + BIN_M
            and other.high_m >= self.high_m - BIN_M
            for other in others
        )

    @property
    def whole(self) -> bool:
        """Return whether the face is left out at all heights."""
        return self.low_m == -np.inf and self.high_m == np.inf


@dataclass(frozen=True)
class OutsideStripes:
    """Leaves those of a sensor's points that do not lie in stripes; soundings are placed by the mount of a state."""

    model: ObservationModel
    state: State
    sensor: str
    stripes: tuple[Stripe, ...]

    def __call__(self, batch: Batch) -> Batch:
        """Return the rows that are left."""
        kept = np.ones(len(batch["face"]), dtype=bool)
        stripes = [stripe for stripe in self.stripes if stripe.sensor == self.sensor]
        kept &= ~np.isin(batch["face"], [stripe.face for stripe in stripes if stripe.whole])
        rows = np.flatnonzero(kept & np.isin(batch["face"], [stripe.face for stripe in stripes]))
        some = {name: column[rows] for name, column in batch.items()}
        height = places_on_surface(self.model, self.sensor, some, self.state)[:, 2] - self.model.wet_heights_m[1]
        for stripe in stripes if len(rows) else ():
            kept[rows[(some["face"] == stripe.face) & (height > stripe.low_m) & (height < stripe.high_m)]] = False
        return {name: column[kept] for name, column in batch.items()}


def profiles_by_height(
    problem: CalibrationProblem, adjustment: MountAdjustment, sensor: str, stream: Stream
) -> Profiles:
    """Return by face the mean residuals of a sensor's points by height, from the lowest on.

    Parameters
    ----------
    problem : CalibrationProblem
        Model of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    sensor, stream : str, Stream
        The sensor, and its labelled points.
    """
    return profiles_of(stream.fold(_sums_by_height, problem.model, sensor, adjustment.values))


def stripes_off(
    problem: CalibrationProblem,
    adjustment: MountAdjustment,
    profiles: Mapping[str, Profiles],
    tolerance_m: float,
) -> list[Stripe]:
    """Return the stripes of all upright faces.

    Parameters
    ----------
    problem : CalibrationProblem
        Model of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    profiles : mapping of Profiles
        Mean residuals by height, by sensor.
    tolerance_m : float
        Tolerance of a mean residual on a smooth wall, as for the tests of the residuals.
    """
    found, state = list[Stripe](), adjustment.state
    bows = dict(zip(state.names, state.additional_values().tolist(), strict=True))
    lowest_m, water_m = problem.model.wet_heights_m
    for sensor, by_face in profiles.items():
        for face, means in sorted(by_face.items()):
            surface = int(problem.model.faces.surface[face])
            if len(means) < FEWEST_BINS or state.surfaces[surface].level:
                continue
            smooth = tolerance_m, float(adjustment.rough[sensor].patch_m[surface])
            bow_m = bows.get(f"wet_{state.surfaces[surface].family}_bow", 0.0) if kind_of(sensor) == "mbes" else 0.0
            found += stripes_of_face((sensor, face), means, smooth, (bow_m, water_m - lowest_m))
    return found


def _sums_by_height(batch: Batch, model: ObservationModel, sensor: str, values: CurrentValues) -> ResidualSums:
    """Return the sums of a batch's residuals by face and height."""
    observed = summed(batch, model, sensor, values, residuals=True)
    v_m, _, _, plain, normalised, _ = observed.observed
    height = heights_on_surface(model, sensor, observed, values.state)
    return residual_sums(
        BinnedResiduals(
            first=observed.points["face"].astype(np.int64),
            second=np.floor(height / BIN_M).astype(np.int64),
            slot=observed.points["t_ns"] // NS,
            weight=plain,
            v_m=v_m,
            normalised=normalised,
        )
    )


def stripes_of_face(
    at: tuple[str, int], means: Sequence[BinMean], smooth: tuple[float, float], bow: tuple[float, float]
) -> list[Stripe]:
    """Return the stripes of one face.

    The adjustment may have bent the face to follow a step. So its profile is looked at twice: as it is, and without the
    bow that the residuals have been freed of, b 4 h (1 - h) with h from 0 at the lower end to 1 at the water. That
    which is nearer to its line, in the median, holds.

    Parameters
    ----------
    at : (str, int)
        The sensor, and the number of the face.
    means : sequence of BinMean
        Mean residuals by height, from the lowest on.
    smooth : (float, float)
        Tolerance of a height of a smooth wall, and the RMS of this wall's patches, m.
    bow : (float, float)
        The estimated bow b, and the depth of the faces' lower end, m.
    """
    least = LEAST_SHARE * float(np.median([mean.count for mean in means]))
    means = [mean for mean in means if mean.count >= least]
    number, value, sigma = profile_of(means)
    count = np.array([mean.count for mean in means])
    up = np.clip(1 + (number + 0.5) * BIN_M / bow[1], 0.0, 1.0)
    both = (off_line(number, profile) for profile in (value, value + bow[0] * 4 * up * (1 - up)))
    off_m = min(both, key=lambda off: float(np.median(np.abs(off))))
    tolerated_m = smooth[0] + roughness_allowance(smooth[1], off_m)
    is_off = np.abs(off_m) > np.maximum(tolerated_m, CERTAIN * sigma)
    for ends in (slice(None), slice(None, None, -1)):
        is_off[ends][: _off_at_end(off_m[ends], sigma[ends], tolerated_m)] = True
    stripes = []
    for start, stop in _runs(is_off):
        low = -np.inf if start == 0 else number[start] * BIN_M - BESIDE_M
        high = np.inf if stop == len(means) else (number[stop - 1] + 1) * BIN_M + BESIDE_M
        worst = start + int(np.argmax(np.abs(off_m[start:stop])))
        stripes.append(Stripe(*at, float(low), float(high), float(off_m[worst]), int(count[start:stop].sum())))
    return stripes


def _off_at_end(off_m: Array, sigma: Array, tolerated_m: float) -> int:
    """Return how many of the first heights are off together, where each alone is not certain; 0 if none are."""
    number = np.arange(1, AT_END + 1)
    mean = np.abs(np.cumsum(off_m[:AT_END])) / number
    of_mean = np.sqrt(np.cumsum(sigma[:AT_END] ** 2)) / number
    certain = np.where(mean > tolerated_m, mean / of_mean, 0.0)
    return int(np.argmax(certain)) + 1 if certain.max() > CERTAIN else 0


def _runs(is_off: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the runs of heights that are off: first and one past the last; few good heights between or beyond count."""
    places = np.flatnonzero(is_off)
    if not len(places):
        return
    ends = np.r_[-1, np.flatnonzero(np.diff(places) > JOINED_BINS), len(places) - 1]
    for before, last in pairwise(ends):
        start, stop = int(places[before + 1]), int(places[last]) + 1
        yield 0 if start < JOINED_BINS else start, len(is_off) if stop > len(is_off) - JOINED_BINS else stop
