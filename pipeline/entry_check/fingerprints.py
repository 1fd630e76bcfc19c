"""Find single soundings of a file among the run's by what no mount changes: the distances between beams of one ping.

All soundings of a ping are placed with one pose and one mount. So the distances between neighbouring beams are the same
in the run and in the file, however wrong the mount, the CRS's origin or the height reference is. Noise makes them as
individual as a fingerprint: 5 neighbours have 10 distances, of 15 some are taken. Exported files keep the order of
pings and beams; where a file holds every n-th beam alone, beams n apart are compared.

Windows that follow each other as in the run are right, whatever poses the software had. Where the order tells nothing,
those count that one mount explains.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.entry_check.mount_fit import FREE_ALL, FittedMount, best_rotation, fit_mount, freed
from pipeline.entry_check.ordering import Windows, in_order, whole_pings
from pipeline.entry_check.run_soundings import RunSoundings

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
WINDOW, WIDE_WINDOW = 5, 15  # beams; the wide one where coordinates are rounded to more than COARSE_M
COARSE_M = 0.002
LAGS = (1, 2, 3, 4)
MOST_QUERIES, MOST_WIDE_QUERIES = 20_000, 40_000
TRIALS, DRAWN = 400, 3  # windows of a trial
CLOSE_M = 0.15  # windows that a mount explains; a height reference that is wrong by 10 m tilts them by so much
LEAST_WINDOWS = 8
DELAYS_S = (0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0, 18.0, -18.0, 19.0, -19.0, 37.0, -37.0)  # GPS, UTC, TAI; whole seconds
DELAY_TRIED = 1500  # soundings
LEAST_WHOLE = 0.5  # of the beams of matched pings; another session over the same target has no whole pings alike
POOR_M = 0.01  # a larger scatter may be a delay's,
LESS = 0.5  # which counts if it lessens the scatter so much


@dataclass(frozen=True)
class FilePoints:
    """Points of the file near the track, in the file's order, pool frame.

    Attributes
    ----------
    points_m
        (n, 3), heights up.
    row
        (n,): number of the row in the file.
    rounding_m
        Half the step of the coordinates.
    """

    points_m: Array
    row: Integers
    rounding_m: float

    def with_depths(self) -> "FilePoints":
        """Return the points with heights of the opposite sign."""
        return replace(self, points_m=self.points_m * [1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Matches:
    """Soundings and points that belong together, by their distances.

    Attributes
    ----------
    own, other
        (m,): numbers of soundings and of the file's points.
    negated
        Whether the file's heights are depths. Distances do not show it; a mount explains one sign better.
    fitted
        A first mount.
    in_order
        Whether the order proves each pair; else they are those that the mount explains.
    """

    own: Integers
    other: Integers
    negated: bool
    fitted: FittedMount
    in_order: bool


def matched(soundings: RunSoundings, file: FilePoints) -> Matches | None:
    """Return what belongs together; None if distances tell nothing."""
    beams = WINDOW if file.rounding_m < COARSE_M else WIDE_WINDOW
    file_rows = _windows_of_file(file, beams)
    for lag in LAGS:
        run_rows = _windows_of_run(soundings, beams, lag)
        if len(run_rows) < LEAST_WINDOWS or len(file_rows) < LEAST_WINDOWS:
            continue
        both = _alike(soundings.points_mbes_m[run_rows], file.points_m[file_rows], file.rounding_m)
        for (own, other), order in zip(both, (slice(None), slice(None, None, -1)), strict=True):
            windows = Windows(run_rows[own], file_rows[other][:, order], lag)
            found = _by_order(soundings, file, windows) or _by_mount(soundings, file, windows)
            if found is not None:
                return found
    return None


def _by_order(soundings: RunSoundings, file: FilePoints, windows: Windows) -> Matches | None:
    chain = in_order(windows)
    if chain is None:
        return None
    limit_m = 0.004 + 2 * file.rounding_m
    (own, other), share = whole_pings(chain, soundings, file.points_m, file.row, limit_m)
    if share < LEAST_WHOLE:
        return None
    some = np.arange(0, len(own), max(1, len(own) // DELAY_TRIED))
    run, there = soundings.rows(own[some]), other[some]
    tried = [(fit_mount(run, one.points_m[there], FREE_ALL), one) for one in _signs(file)]
    fitted, points = min(tried, key=lambda one: one[0].scatter_m)
    if fitted.scatter_m > POOR_M:
        free = freed("shift_x", "shift_y", "shift_z", "delay")
        late = [(fit_mount(run, one.points_m[there], free, s), one) for one in _signs(file) for s in DELAYS_S]
        better = min(late, key=lambda one: one[0].scatter_m)
        fitted, points = better if better[0].scatter_m < LESS * fitted.scatter_m else (fitted, points)
    if fitted.scatter_m > CLOSE_M:
        return None
    return Matches(own, other, points is not file, fitted, True)


def _by_mount(soundings: RunSoundings, file: FilePoints, windows: Windows) -> Matches | None:
    rows = windows.run_rows, windows.file_rows
    explained = [(_consistent(soundings, heights, *rows), heights) for heights in _signs(file)]
    (used, error_m), points = min(explained, key=lambda one: one[0][1])
    if error_m == np.inf:
        return None
    own, other = rows[0][used].ravel(), rows[1][used].ravel()
    return Matches(
        own, other, points is not file, fit_mount(soundings.rows(own), points.points_m[other], FREE_ALL), False
    )


def _signs(file: FilePoints) -> tuple[FilePoints, FilePoints]:
    return file, file.with_depths()


def _windows_of_run(soundings: RunSoundings, beams: int, lag: int) -> Integers:
    """Return rows (w, beams) of beams of one ping that are ``lag`` beams apart."""
    first = np.arange(max(len(soundings.t_ns) - (beams - 1) * lag, 0))
    rows = first[:, None] + lag * np.arange(beams)
    last = rows[:, -1]
    whole = soundings.ping[first] == soundings.ping[last]
    whole &= soundings.beam[last] - soundings.beam[first] == (beams - 1) * lag
    return np.asarray(rows[whole])


def _windows_of_file(file: FilePoints, beams: int) -> Integers:
    """Return rows (w, beams) of points that follow each other in the file, evenly taken."""
    first = np.arange(max(len(file.row) - beams + 1, 0))
    rows = first[:, None] + np.arange(beams)
    rows = rows[file.row[rows[:, -1]] - file.row[first] == beams - 1]
    return np.asarray(rows)[:: max(1, len(rows) // (MOST_QUERIES if beams == WINDOW else MOST_WIDE_QUERIES))]


def _alike(run: Array, file: Array, rounding_m: float) -> tuple[tuple[Integers, Integers], tuple[Integers, Integers]]:
    """Return the numbers of windows with the same distances: (w, beams, 3) each; and if the file's order is reversed.

    A match counts if the next best is clearly worse, and if the distances differ by no more than rounding allows, or by
    2 mm, for other software may trace the rays a little differently.
    """
    tree = cKDTree(_distances(run))
    limit = np.sqrt(tree.m) * max(0.002, rounding_m)
    found = []
    for features in (_distances(file), _distances(file[:, ::-1])):
        distance, place = tree.query(features, k=2, distance_upper_bound=2 * limit)
        good = np.flatnonzero((distance[:, 0] < limit) & (distance[:, 0] < 0.6 * distance[:, 1]))
        found.append((place[good, 0], good))
    return found[0], found[1]


def _distances(windows: Array) -> Array:
    """Return all distances of a short window (w, 10), of a wide one those of beams 4, 7 and 14 apart, (w, 20)."""
    one, other = np.triu_indices(windows.shape[1], 1)
    if windows.shape[1] == WIDE_WINDOW:
        wanted = np.isin(other - one, (4, 7, 14))
        one, other = one[wanted], other[wanted]
    return np.asarray(np.linalg.norm(windows[:, one] - windows[:, other], axis=2))


def _consistent(
    soundings: RunSoundings, file: FilePoints, run_rows: Integers, file_rows: Integers
) -> tuple[NDArray[np.bool_], float]:
    """Return a mask (w,) of the windows that one mount explains, and their median error (inf: there are too few).

    The mount is that of a few drawn windows which explains most (random sample consensus).

    Parameters
    ----------
    soundings, file
        Both sides.
    run_rows, file_rows
        (w, beams): rows of windows that look alike.
    """
    windows, beams = run_rows.shape
    best, error_m = np.zeros(windows, dtype=bool), np.inf
    if windows < LEAST_WINDOWS:
        return best, error_m
    flat = run_rows.ravel()
    x = soundings.points_mbes_m[flat].reshape(windows, beams, 3)
    b = soundings.rows(flat).in_body(file.points_m[file_rows.ravel()]).reshape(windows, beams, 3)
    random = np.random.default_rng(0)
    for _ in range(TRIALS):
        drawn = random.choice(windows, DRAWN, replace=False)
        R, t = best_rotation(x[drawn].reshape(-1, 3), b[drawn].reshape(-1, 3), np.ones(DRAWN * beams))
        errors = np.linalg.norm(b - x @ R.T - t, axis=2).max(axis=1)
        explained = errors < CLOSE_M
        if explained.sum() > best.sum():
            best = explained
        if best.sum() > 0.9 * windows:
            break
    if best.sum() < max(LEAST_WINDOWS, 0.02 * windows):
        return best, np.inf
    used = run_rows[best].ravel()
    fitted = fit_mount(soundings.rows(used), file.points_m[file_rows[best].ravel()], FREE_ALL)
    return best, fitted.scatter_m
