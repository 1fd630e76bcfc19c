"""Identify single soundings of the file with soundings of the run, however the mount was entered.

The start comes from :mod:`pipeline.entry_check.fingerprints`, or else from the hypothesis whose placing of some of the
run's soundings meets most points of the file. From there on, nearest points and the fit of a mount and a shift take
turns, with a narrower gate each time (iterative closest points).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.entry_check.fingerprints import FilePoints, matched
from pipeline.entry_check.leave_one_out import time_groups
from pipeline.entry_check.mount_fit import FREE_ALL, SIZE, FittedMount, fit_mount
from pipeline.entry_check.run_soundings import RunSoundings
from pipeline.mount import Mounted

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

GATES_M = (0.2, 0.1, 0.05, 0.03)
TRIED = 600  # soundings with which a start is tried
TRIED_GATE_M = 0.008  # a start is exact, but for rounded settings
BEST_STARTS = 6
PROBE_M = np.array([[0.31, 0.0, 0.0], [0.0, 0.31, 0.0], [0.0, 0.0, 0.31], [-0.23, 0.19, 0.0]])
LEAST_PAIRS = 60
# Share of the run's soundings that must be found again, and how many times what chance finds: the more are found, the
# less they need to be above chance, which finds many in a file that is dense or rounded.
CLEAR = ((0.01, 8.0), (0.1, 4.0), (0.4, 2.0))
WELL_ORDERED = 1000  # soundings in pairs that the order proves: no more are needed
FITTED = 4000  # pairs of each step before the last
LEVEL_SEARCH_M = 0.01  # horizontal distance of the points whose heights are compared
LEVEL_BIN_M = 0.01
LEVEL_TRIED = 150
WITHOUT_HEIGHTS = 150  # starts that are tried with other heights


@dataclass(frozen=True)
class Pairs:
    """Soundings of the run and where the file has them.

    Attributes
    ----------
    soundings
        The n soundings that were found again.
    points_pool_m
        (n, 3): the file's points.
    found
        Number of the run's soundings that were found again.
    share, chance
        Their share, and the share that a placing at a wrong place would have found.
    negated
        Whether the file's heights are depths, positive down.
    how
        "order" (of pings and beams in the file) or "places".
    delay_s
        By how much the software's poses are late, roughly.
    evenness
        Of pairs by places: least share of a pass (or a part) that was found, by the largest. What stands elsewhere is
        not found at all; pairs by order are found wherever they stand.
    """

    soundings: RunSoundings
    points_pool_m: Array
    found: int
    share: float
    chance: float
    negated: bool
    how: str
    delay_s: float = 0.0
    evenness: float = 1.0


def identify(soundings: RunSoundings, file: FilePoints, starts: Sequence[Mounted]) -> Pairs | None:
    """Return the pairs; None if the file's soundings are not found among the run's.

    Parameters
    ----------
    soundings
        The run's.
    file
        The file's points near the track.
    starts
        Mounts that may have been entered, the likeliest first.
    """
    return (
        from_fingerprints(soundings, file)
        or from_places(soundings, file, starts, negated=False)
        or from_places(soundings, file.with_depths(), starts, negated=True)
    )


def from_fingerprints(soundings: RunSoundings, file: FilePoints) -> Pairs | None:
    """Return the pairs by distances within pings and by the file's order; None if these tell nothing."""
    found = matched(soundings, file)
    if found is None:
        return None
    turned = file.with_depths() if found.negated else file
    number, points = len(np.unique(found.own)), turned.points_m[found.other]
    in_order = Pairs(
        soundings.rows(found.own), points, number, number / len(soundings.t_ns), 0.0, found.negated, "order",
        found.fitted.delay_s,
    )  # fmt: skip
    if found.in_order and number >= WELL_ORDERED:
        return in_order
    pairs = _refined(soundings, turned, found.fitted, Way(found.negated, "order", GATES_M))
    return pairs or (in_order if found.in_order else None)


def from_places(soundings: RunSoundings, file: FilePoints, starts: Sequence[Mounted], negated: bool) -> Pairs | None:
    """Return the pairs that are near each other by the best start; None if no start finds more than chance."""
    some = soundings.rows(np.linspace(0, len(soundings.t_ns) - 1, TRIED).astype(int))
    tree, level = cKDTree(file.points_m), cKDTree(file.points_m[:, :2])
    gate = TRIED_GATE_M + 1.8 * file.rounding_m
    for with_heights in (True, False):
        scored = []
        for number, start in enumerate(starts if with_heights else starts[:WITHOUT_HEIGHTS]):
            lift = 0.0 if with_heights else _lift(some, file, level, start)
            distance, _ = tree.query(_placed(some, start, lift), distance_upper_bound=gate)
            scored.append((-int(np.isfinite(distance).sum()), number, lift))
        for _, number, lift in sorted(scored)[:BEST_STARTS]:
            start = starts[number]
            fitted = FittedMount(
                start.R_body_from_sensor, start.lever_arm_body_m, np.array([0.0, 0.0, lift]), 1.0,
                np.zeros((SIZE, SIZE)), 0.0, np.empty(0),
            )  # fmt: skip
            pairs = _refined(soundings, file, fitted, Way(negated, "places", (2 * gate, gate)))
            if pairs is not None:
                return pairs
    return None


def _placed(soundings: RunSoundings, start: Mounted, lift_m: float) -> Array:
    placed = soundings.placed(start.R_body_from_sensor, start.lever_arm_body_m)
    return np.asarray(placed + np.array([0.0, 0.0, lift_m]))


def _lift(some: RunSoundings, file: FilePoints, level: cKDTree, start: Mounted) -> float:
    """Return the height difference that most points below or above a placed sounding have in common."""
    placed = _placed(some.rows(np.arange(0, TRIED, TRIED // LEVEL_TRIED)), start, 0.0)
    near = level.query_ball_point(placed[:, :2], LEVEL_SEARCH_M + file.rounding_m)
    counts = np.array([len(rows) for rows in near])
    if not counts.sum():
        return 0.0
    lifts = file.points_m[np.concatenate([np.array(rows, dtype=int) for rows in near]), 2] - np.repeat(
        placed[:, 2], counts
    )
    bins, number = np.unique(np.round(lifts / LEVEL_BIN_M), return_counts=True)
    likely = lifts[np.abs(lifts - bins[np.argmax(number)] * LEVEL_BIN_M) <= LEVEL_BIN_M]
    return float(np.median(likely))


@dataclass(frozen=True)
class Way:
    """How the start was found, and the gates of the iteration that follows; ``negated``, ``how`` as in Pairs."""

    negated: bool
    how: str
    gates_m: tuple[float, ...]


def _refined(soundings: RunSoundings, file: FilePoints, fitted: FittedMount, way: Way) -> Pairs | None:
    """Return the pairs at the end of the iteration; None if no more are found than by chance."""
    tree = cKDTree(file.points_m)
    thin = soundings.rows(np.arange(0, len(soundings.t_ns), max(1, len(soundings.t_ns) // (4 * FITTED))))
    for gate in way.gates_m:
        own, other = _nearest(tree, fitted.predicted(thin), gate)
        if len(own) < LEAST_PAIRS:
            return None
        step = max(1, len(own) // FITTED)
        fitted = fit_mount(thin.rows(own[::step]), file.points_m[other[::step]], FREE_ALL, fitted.delay_s)
    gate = float(np.clip(3 * fitted.scatter_m, 1.8 * file.rounding_m + 0.002, GATES_M[-1]))
    predicted = fitted.predicted(soundings)
    own, other = _nearest(tree, predicted, gate)
    by_chance = max(len(_nearest(tree, predicted + probe, gate)[0]) for probe in PROBE_M) / len(predicted)
    share = len(own) / len(predicted)
    if len(own) < LEAST_PAIRS or not _is_clear(share, by_chance):
        return None
    return Pairs(
        soundings.rows(own), file.points_m[other], len(own), share, by_chance, way.negated, way.how, fitted.delay_s,
        _evenness(soundings, own),
    )  # fmt: skip


def _is_clear(share: float, by_chance: float) -> bool:
    """Return whether a share of the run's soundings is so far above what chance finds that it is the same soundings.

    >>> _is_clear(0.044, 0.008), _is_clear(0.12, 0.025), _is_clear(0.082, 0.03), _is_clear(0.5, 0.2)
    (False, True, False, True)
    """
    return any(share >= max(least, times * by_chance) for least, times in CLEAR)


def _evenness(soundings: RunSoundings, own: Integers) -> float:
    group = time_groups(soundings.t_ns)
    shares = np.bincount(group[own], minlength=group.max() + 1) / np.bincount(group)
    return float(shares.min() / shares.max())


def _nearest(tree: cKDTree, predicted: Array, gate_m: float) -> tuple[Integers, Integers]:
    """Return the numbers of predicted points and of the file's points that are each other's nearest within a gate."""
    distance, place = tree.query(predicted, distance_upper_bound=gate_m)
    own = np.flatnonzero(np.isfinite(distance))
    order = own[np.argsort(distance[own], kind="stable")]
    other, first = np.unique(place[order], return_index=True)
    return order[first], other
