"""Errors of the recorded poses, eliminated from the normal equations: white noise of each record, and slow drift.

Both sensors hang on one body, so that at a moment they share the error e = (δ, ω) of its pose (target frame; X -> X +
δ + ω × r). Between records it is interpolated as the poses are, and it has two parts:

    e(t) = ξ(t) + (1 - s) w_k + s w_{k+1},        t = t_k + s (t_{k+1} - t_k)

* w_k: white noise of record k, w ~ N(0, W), W diagonal (position, attitude);
* ξ: drift, a first-order Gauss-Markov process of standard deviations σ (6,) and time constant τ, through all passes and
  the time between them (Gelb 1974, 3.8), given at *knots* and linear between them. Of two knots d apart,
  ξ_{j+1} = φ ξ_j + N(0, (1 - φ²) σ²), φ = exp(-d / τ). Linear interpolation leaves out what the process does between
  knots, up to σ √(d / 2τ): at 15 mm, 200 s and d = 0.5 s 0.5 mm, at 5 s 1.7 mm, which is too much.

Knots lie at records. Within an interval between two knots the w form a chain: each group of observations touches two
neighbours. They are eliminated one after the other (block Thomas), all intervals side by side; what is left, the
Schur complement, touches the common unknowns x and the interval's two knots. The record at a knot counts as two, one in
each interval: one record in two hundred.

What is left is an arrow: knots banded, x its border. Banded Cholesky (LAPACK pbtrf) eliminates the knots; the Schur
complement on x is its inverse covariance with all pose errors unknown, and the knots follow from x.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from pipeline.maths.epochs import EpochSums

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SIX = 6  # δ x, y, z in m; ω x, y, z in rad; target frame
INTERVALS = 64  # eliminated side by side


@dataclass(frozen=True)
class PoseNoise:
    """Standard deviations: white (6,) of each record, drift (6,) with its time constant; zero: none."""

    white: Array
    drift: Array
    time_constant_s: float


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
class Blocks:
    """Normal equations of groups of observations before any pose error is eliminated, group by group.

    record, share (g,): where between records, on average. With design C (3, u) of the common unknowns and K (3, 6) of
    the pose error, and the group's sums N_k = Σ w sᵏ q qᵀ, b_k = Σ w sᵏ q v: common (g, u, u) = CᵀN₀C, mixed
    (g, 2, 6, u) = KᵀN_kC, pose (g, 3, 6, 6) = KᵀN_kK, right (g, u) = Cᵀb₀, right_pose (g, 2, 6) = Kᵀb_k.
    """

    record: Integers
    share: Array
    common: Array
    mixed: Array
    pose: Array
    right: Array
    right_pose: Array


def blocks_of(sums: EpochSums, common: Array, pose: Array) -> Blocks:
    """From the sums and the design: C (g, 3, u), K (g, 3, 6)."""
    turned = np.swapaxes(pose, 1, 2)
    return Blocks(
        sums.record,
        sums.share,
        np.swapaxes(common, 1, 2) @ sums.normal[:, 0] @ common,
        turned[:, None] @ sums.normal[:, :2] @ common[:, None],
        turned[:, None] @ sums.normal @ pose[:, None],
        np.einsum("gqu,gq->gu", common, sums.right[:, 0]),
        np.einsum("gqe,gkq->gke", pose, sums.right),
    )


def joined(parts: Sequence[Blocks]) -> Blocks:
    """The blocks of several sensors."""
    return Blocks(*(np.concatenate([getattr(one, name) for one in parts]) for name in Blocks.__dataclass_fields__))


@dataclass(frozen=True)
class Reduced:
    """Normal equations of x and of each interval's two knots, white noise eliminated.

    normal (j, u + 12, u + 12) and right (j, u + 12) by interval: x, then the knots before and after.
    """

    normal: Array
    right: Array

    @property
    def unknowns(self) -> int:
        return int(self.normal.shape[1] - 2 * SIX)


def reduce_white(blocks: Blocks, knots: Knots, seconds: Array, white: Array) -> Reduced:
    """Blocks summed by interval, with the white noise of single records eliminated."""
    intervals, unknowns = len(knots.record) - 1, blocks.right.shape[1]
    width = unknowns + 2 * SIX
    normal, right = np.zeros((intervals, width, width)), np.zeros((intervals, width))
    interval = knots.interval_of(blocks.record)
    order = np.argsort(interval, kind="stable")
    ends = np.searchsorted(interval[order], np.arange(intervals + 1))
    for first in range(0, intervals, INTERVALS):
        last = min(first + INTERVALS, intervals)
        rows = order[ends[first] : ends[last]]
        part = _chain(blocks, rows, interval[rows] - first, last - first, knots, first, seconds)
        whole = not np.any(white > 0)
        normal[first:last], right[first:last] = (part.normal, part.right) if whole else part.eliminated(white)
    return Reduced(normal, right)


@dataclass(frozen=True)
class _Chain:
    """Intervals side by side (j), their records one after another (l).

    normal (j, y, y), right (j, y) of y = (x, knot before, knot after); inner (j, l, 6, 6): a record's own block,
    next (j, l - 1, 6, 6): with its successor; mixed (j, l, 6, y); right_inner (j, l, 6).
    """

    normal: Array
    right: Array
    inner: Array
    next: Array
    mixed: Array
    right_inner: Array

    def eliminated(self, white: Array) -> tuple[Array, Array]:
        """Schur complement on y. With w = √W u, u ~ N(0, 1), the prior is the unit matrix, and W = 0 no exception."""
        scale = white
        normal, right = self.normal.copy(), self.right.copy()
        own, left = np.zeros_like(self.inner[:, 0]), None
        for step in range(self.inner.shape[1]):
            block = self.inner[:, step] * scale[:, None] * scale + np.eye(SIX)
            border = np.concatenate([self.mixed[:, step], self.right_inner[:, step, :, None]], axis=2) * scale[:, None]
            if left is not None:
                block, border = block - own, border - left
            if step + 1 < self.inner.shape[1]:
                ahead = self.next[:, step] * scale[:, None] * scale
                solved = np.linalg.solve(block, np.concatenate([ahead, border], axis=2))
                back = np.swapaxes(ahead, 1, 2)
                own, left = back @ solved[:, :, :SIX], back @ solved[:, :, SIX:]
                solved = solved[:, :, SIX:]
            else:
                solved = np.linalg.solve(block, border)
            taken = np.swapaxes(border[:, :, :-1], 1, 2) @ solved
            normal -= taken[:, :, :-1]
            right -= taken[:, :, -1]
        return normal, right


def _chain(
    blocks: Blocks, rows: Integers, place: Integers, count: int, knots: Knots, first: int, seconds: Array
) -> _Chain:
    """The groups ``rows`` of ``count`` intervals from ``first`` on; ``place``: the interval of each, from 0."""
    u = blocks.right.shape[1]
    width = u + 2 * SIX
    since = blocks.record[rows] - knots.record[first + place]
    length = int(since.max()) + 2 if len(rows) else 1
    share = blocks.share[rows]
    t = seconds[blocks.record[rows]] + share * (seconds[blocks.record[rows] + 1] - seconds[blocks.record[rows]])
    begin, end = knots.seconds[first + place], knots.seconds[first + place + 1]
    after = ((t - begin) / (end - begin))[:, None, None]
    pose, mixed, pull = blocks.pose[rows], blocks.mixed[rows], blocks.right_pose[rows]
    # of y = (x, knot before, knot after): KᵀN_k (C, K (1 - a), K a)
    wide = np.concatenate([mixed, pose[:, :2] * (1 - after[:, None]), pose[:, :2] * after[:, None]], axis=3)
    tied = np.swapaxes(mixed[:, 0], 1, 2)
    top = np.concatenate([blocks.common[rows], tied * (1 - after), tied * after], axis=2)
    full = np.concatenate([top, wide[:, 0] * (1 - after), wide[:, 0] * after], axis=1)
    pulls = (blocks.right[rows], pull[:, 0] * (1 - after[:, 0]), pull[:, 0] * after[:, 0])
    normal, right = np.zeros((count, width, width)), np.zeros((count, width))
    np.add.at(normal, place, full)
    np.add.at(right, place, np.concatenate(pulls, axis=1))
    inner, ahead = np.zeros((count, length, SIX, SIX)), np.zeros((count, length - 1, SIX, SIX))
    border, right_inner = np.zeros((count, length, SIX, width)), np.zeros((count, length, SIX))
    squared = (pose[:, 0] - 2 * pose[:, 1] + pose[:, 2], pose[:, 2])  # of (1 - s)² and s²
    for offset in (0, 1):
        at = (place, since + offset)
        np.add.at(inner, at, squared[offset])
        np.add.at(border, at, wide[:, 1] if offset else wide[:, 0] - wide[:, 1])
        np.add.at(right_inner, at, pull[:, 1] if offset else pull[:, 0] - pull[:, 1])
    np.add.at(ahead, (place, since), pose[:, 1] - pose[:, 2])  # of (1 - s) s
    return _Chain(normal, right, inner, ahead, border, right_inner)


@dataclass(frozen=True)
class Eliminated:
    """Normal equations of x alone, (u, u) and (u,), and what gives the knots back: step = free - tied · x, (k, 6)."""

    normal: Array
    right: Array
    tied: Array
    free: Array

    def knots(self, step: Array) -> Array:
        """The step of the knots that goes with a step of x; (k, 6)."""
        return np.asarray(self.free - self.tied @ step)


def eliminate_drift(reduced: Reduced, knots: Knots, noise: PoseNoise, current: Array) -> Eliminated:
    """The knots eliminated under their prior; ``current`` (k, 6): their values, at which the equations were made.

    In units of σ: Σ_j |ξ_{j+1} - φ ξ_j|² / (1 - φ²) + |ξ_0|². Components without drift (σ = 0) stay as they are.
    """
    u, count = reduced.unknowns, len(knots.record)
    scale = noise.drift
    before, after = slice(u, u + SIX), slice(u + SIX, u + 2 * SIX)
    own, ahead = np.zeros((count, SIX, SIX)), reduced.normal[:, before, after].copy()
    border, right = np.zeros((count, SIX, u)), np.zeros((count, SIX))
    for place, of in ((slice(0, -1), before), (slice(1, None), after)):
        own[place] += reduced.normal[:, of, of]
        border[place] += reduced.normal[:, of, :u]
        right[place] += reduced.right[:, of]
    own, ahead = (block * scale[:, None] * scale for block in (own, ahead))
    border, right = border * scale[:, None], right * scale
    phi = np.exp(-np.diff(knots.seconds) / noise.time_constant_s)
    variance = 1 - phi**2
    unit = np.eye(SIX)
    own[0] += unit
    own[:-1] += (phi**2 / variance)[:, None, None] * unit
    own[1:] += (1 / variance)[:, None, None] * unit
    ahead -= (phi / variance)[:, None, None] * unit
    value = np.divide(current, scale, out=np.zeros_like(current), where=scale > 0)
    shock = (value[1:] - phi[:, None] * value[:-1]) / variance[:, None]
    right[0] += value[0]
    right[1:] += shock
    right[:-1] -= phi[:, None] * shock
    factor = cholesky_banded(_banded(own, ahead), lower=True)
    sides = np.concatenate([border.reshape(-1, u), right.reshape(-1, 1)], axis=1)
    solved = cho_solve_banded((factor, True), sides)
    crossed = border.reshape(-1, u).T @ solved
    back = solved.reshape(count, SIX, u + 1) * scale[:, None]
    common, pull = reduced.normal[:, :u, :u].sum(axis=0), reduced.right[:, :u].sum(axis=0)
    return Eliminated(common - crossed[:, :u], pull - crossed[:, u], back[:, :, :u], -back[:, :, u])


def _banded(own: Array, ahead: Array) -> Array:
    """Lower band (12, 6k) of the matrix with these blocks on and right above its diagonal."""
    count = len(own)
    band = np.zeros((2 * SIX, SIX * count))
    for row in range(SIX):
        for column in range(SIX):
            if row >= column:
                band[row - column, column::SIX] = own[:, row, column]
            band[SIX + row - column, column : SIX * (count - 1) : SIX] = ahead[:, column, row]
    return band


def drift_at(knots: Knots, values: Array, seconds: Array) -> Array:
    """ξ (n, 6) at moments (n,), linear between the knots' values (k, 6)."""
    return np.array([np.interp(seconds, knots.seconds, column) for column in values.T]).T

