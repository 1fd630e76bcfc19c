"""Loops shared by the sums of both sensors, second part: what a point counts, and the sums of a group of points.

A *group* is the points between two INS records, on all surfaces. Its points are looked at twice: first for their
weights and distances, whose weighted means tell the noise that an interval's points share
(:func:`pipeline.maths.adjustment.design_matrix.sensor_noise`), then for the sums. In between they lie in ``kept``,
which stays in the processor's cache.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import CUBE, FLOAT, LINE, MATRIX, NUMBERS, compiled, named

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
N_MOVED = 3  # features on which a pose error acts
COUNT, CUT, REDUCED, INFORMATION, FIRST_BIN = 0, 1, 2, 3, 4  # columns of the statistics of a surface
V, WEIGHT, COMMON, EDGE, MEAN, ROBUST, PLAIN, SIZE = range(8)  # columns of ``kept``
FEATURES = 8  # first of the features among them; slopes follow
COSINE = FEATURES + 2  # of the angle between ray and normal, n · d
OBSERVED = (V, MEAN, ROBUST, PLAIN, SIZE, COSINE)  # columns of ``kept`` that are the rows of ``observed``


class Points(NamedTuple):
    """Points, ascending in time. n: their number; a *record* is counted among those of the batch that have points.

    place_m (3, n): the laser's in the target frame, the soundings in the sonar's own; edge (n,): weight near edges;
    surface (n,): number of the surface; height_m (n,): of the face over its surface; record, share, slot (n,): see
    :func:`~pipeline.maths.kernels.interval_slots.slots_of`.
    """

    place_m: Array
    edge: Array
    surface: Integers
    height_m: Array
    record: Integers
    share: Array
    slot: Integers


class Records(NamedTuple):
    """Of each INS record: turns (r, 3) rad by the drift, target frame; shift (r, s, F), factors of q in v's change."""

    turns: Array
    shift: Array


class Surfaces(NamedTuple):
    """Of each surface: axes (s, 3, 3), rows t1, t2, n, target frame; distance_m (s,) from the frame's origin."""

    axes: Array
    distance_m: Array


class Noise(NamedTuple):
    """The stochastic model (:class:`pipeline.maths.adjustment.weighting.Weighting`).

    factor, edge_share, scale (s,); k0, k1: bounds of IGG III; white (6,): standard deviations of a record's noise, m
    and rad; bin_width: of the histogram of the normalised |v|; range_m, angle_rad: the sensor's standard deviations.
    """

    factor: Array
    edge_share: Array
    scale: Array
    k0: float
    k1: float
    white: Array
    bin_width: float
    range_m: float
    angle_rad: float


class Sums(NamedTuple):
    """What is added to. g: number of slots; F: features q of the sensor.

    statistics (s, 4 + bins): COUNT … FIRST_BIN; normal (g, F, F), swept (g, 3, F), swept_twice (g, 3, 3), right (g, F),
    right_swept (g, 3): see :class:`pipeline.maths.adjustment.interval_sums.IntervalSums`; scalars (g, 3): Σ w v², Σ e,
    Σ e². Written: observed (6, n): of each point v, the mean of the noise that was taken from it, the robust weight,
    the full weight without it, the normalised |v| (zero if the robust weight is zero) and COSINE; or (6, 0): nothing.
    """

    statistics: Array
    normal: Array
    swept: Array
    swept_twice: Array
    right: Array
    right_swept: Array
    scalars: Array
    observed: Array


class GroupScratch(NamedTuple):
    """Scratch memory: kept (m, k), a row for each point of a group; means (s, 2): Σ w, Σ w v of its points by surface.

    q (F,): features of a point; vectors (3, 3): of the sensor's loop.
    """

    kept: Array
    means: Array
    q: Array
    vectors: Array


POINTS = named(Points, MATRIX, LINE, NUMBERS, LINE, NUMBERS, LINE, NUMBERS)
RECORDS = named(Records, MATRIX, CUBE)
SURFACES = named(Surfaces, CUBE, LINE)
NOISE = named(Noise, LINE, LINE, LINE, FLOAT, FLOAT, LINE, FLOAT, FLOAT, FLOAT)
SUMS = named(Sums, MATRIX, CUBE, CUBE, CUBE, MATRIX, MATRIX, MATRIX, MATRIX)
SCRATCH = named(GroupScratch, MATRIX, MATRIX, LINE, MATRIX)


def group_scratch(largest: int, surfaces: int, features: int) -> GroupScratch:
    """Return the scratch memory for groups of so many points at most."""
    kept = np.zeros((largest, FEATURES + 2 * (features - 1)))
    return GroupScratch(kept, np.empty((surfaces, 2)), np.empty(features), np.empty((3, 3)))


@compiled()
def robust_weight(normalised: float, k0: float, k1: float) -> float:
    """Return the weight of IGG III, :func:`pipeline.maths.adjustment.robust_weights.igg3_weights`."""
    size = abs(normalised)
    if size <= k0:
        return 1.0
    if size >= k1:
        return 0.0
    return k0 / size * ((k1 - size) / (k1 - k0)) ** 2


@compiled()
def common_variance(axes: Array, alpha: float, beta: float, share: float, white: Array) -> float:
    """Return the variance of the records' white noise in v, as ``common_variance`` of ``adjustment.weighting``.

    v changes by n · δ + ω · (β t1 - α t2); ``axes`` has the rows t1, t2, n.
    """
    total = 0.0
    for i in range(3):
        moved, turned = white[i] * axes[2, i], white[3 + i] * (beta * axes[0, i] - alpha * axes[1, i])
        total += moved * moved + turned * turned
    return ((1.0 - share) * (1.0 - share) + share * share) * total


@compiled()
def turn_features(row: Array, r: Array, records: Records, k: int, axes: Array, surface: int) -> None:
    """Add to V what drift and parameters change, and write α and β as seen with the drift's turn.

    ``row``: the point in ``kept``, with V and all features but α and β; ``r``: from the body, surface axes.
    """
    shift = records.shift[k, surface]
    v = row[V] + shift[0] + shift[1] * r[0] + shift[2] * r[1]
    for f in range(3, len(shift)):
        v += shift[f] * row[FEATURES + f - 1]
    row[V] = v
    t0, t1, t2 = 0.0, 0.0, 0.0
    for j in range(3):
        turn = records.turns[k, j]
        t0 += axes[0, j] * turn
        t1 += axes[1, j] * turn
        t2 += axes[2, j] * turn
    row[FEATURES] = r[0] + t1 * r[2] - t2 * r[1]
    row[FEATURES + 1] = r[1] + t2 * r[0] - t0 * r[2]


@compiled()
def weigh(row: Array, variance: float, surface: int, noise: Noise, statistics: Array) -> None:
    """Write the full weight of a point, and count it among the observations of its surface.

    ``row``: the point in ``kept``, with V, COMMON and EDGE; ``variance``: of the sensor's noise in v by the session.
    """
    scaled = noise.factor[surface] * variance
    normalised = row[V] / np.sqrt(scaled + row[COMMON])
    robust = robust_weight(normalised / noise.scale[surface], noise.k0, noise.k1)
    of_surface = statistics[surface]
    of_surface[COUNT] += 1.0
    if robust == 0.0:
        of_surface[CUT] += 1.0
    elif robust < 1.0:
        of_surface[REDUCED] += 1.0
    if robust > 0.0:
        of_surface[INFORMATION] += row[EDGE]
    bins = len(of_surface) - FIRST_BIN
    of_surface[FIRST_BIN + min(int(min(abs(normalised) / noise.bin_width, 1e9)), bins - 1)] += 1.0
    row[ROBUST] = robust
    row[PLAIN] = row[EDGE] / (scaled * noise.edge_share[surface])
    row[WEIGHT] = robust * row[PLAIN]
    row[SIZE] = abs(normalised) if robust > 0.0 else 0.0


@compiled()
def _add_point(q: Array, v: float, s: float, w: float, g: int, sums: Sums) -> None:
    """Add a point to the sums of its slot g: of products of features one triangle alone."""
    normal, swept, swept_twice = sums.normal[g], sums.swept[g], sums.swept_twice[g]
    right, right_swept = sums.right[g], sums.right_swept[g]
    for row in range(len(q)):
        wq = w * q[row]
        right[row] += wq * v
        for column in range(row + 1):
            normal[row, column] += wq * q[column]
    for row in range(N_MOVED):
        once = s * w * q[row]
        right_swept[row] += once * v
        for column in range(row, len(q)):
            swept[row, column] += once * q[column]
        for column in range(row, N_MOVED):
            swept_twice[row, column] += s * once * q[column]


@compiled()
def add_group(first: int, end: int, points: Points, scratch: GroupScratch, sums: Sums) -> None:
    """Add the points first to end to the sums of their slots, with the features at the adjusted points."""
    kept, means, q = scratch.kept, scratch.means, scratch.q
    features = len(q)
    means[:] = 0.0
    for p in range(first, end):
        row, mean = kept[p - first], means[points.surface[p]]
        mean[0] += row[WEIGHT]
        mean[1] += row[WEIGHT] * row[V]
        if sums.observed.shape[1]:
            for k in range(len(OBSERVED)):
                sums.observed[k, p] = row[OBSERVED[k]]
    for p in range(first, end):
        row, mean = kept[p - first], means[points.surface[p]]
        w, v = row[WEIGHT], row[V]
        if w <= 0.0:
            continue
        g = points.slot[p]
        information = row[COMMON] * mean[0]
        noise = v - information / (1.0 + information) * (mean[1] / mean[0])
        q[0] = 1.0
        for f in range(1, features):
            q[f] = row[FEATURES + f - 1] - row[FEATURES + features + f - 2] * noise
        _add_point(q, v, points.share[p], w, g, sums)
        sums.scalars[g, 0] += w * v * v
        sums.scalars[g, 1] += row[EDGE]
        sums.scalars[g, 2] += row[EDGE] * row[EDGE]


@compiled()
def mirror(sums: Sums) -> None:
    """Write the other triangles of the sums of all slots."""
    for g in range(len(sums.normal)):
        normal, swept, swept_twice = sums.normal[g], sums.swept[g], sums.swept_twice[g]
        for row in range(len(normal)):
            for column in range(row):
                normal[column, row] = normal[row, column]
        for row in range(N_MOVED):
            for column in range(row):
                swept[row, column] = swept[column, row]
                swept_twice[row, column] = swept_twice[column, row]
