"""Roughness of walls: what all passes see at the same place, and no ping alone shows.

A wall as it is (stones, joints, mussels, weed) stands off its plane by a field h that is alike over decimetres. A
slow boat's pings are centimetres apart, and each pass sees the same field again. As independent noise it seems to
average out over thousands of pings; it averages out over the few patches of the wall.

Let lines (a ping's soundings on a surface) have the means m_i with the weights W_i = Σ w at the places y_i along the
wall, evenly over a length L, ω = Σ W_i / L. Their mean M = Σ W_i m_i / Σ W_i has the variance

    1 / Σ W_i + G / L,      G = ∫ C(t) dt,      C the covariance of the lines' means by h at places t apart,

if L is long beside the correlation. So the *design effect* (:mod:`~pipeline.maths.adjustment.ping_noise`) of the means
is larger by ω G. G follows from blocks of the wall of length s. The mean M_Bp of a block in pass p contains h, alike in
all passes, and errors of the pass (noise, drift), which are not. So for two passes p, q

    E M_Bp M_Bq = V(s),      s V(s) → G from below as s grows,      ω G = W_B V(s),   W_B = ω s.

The mean over blocks and pairs of passes is the estimate of V. Each pass is first freed of a line in y, which drift may
give it and surfaces' parameters take up; of n blocks this takes 2 degrees of freedom, so V counts n / (n - 2) times.

Whether V is certain says the analysis of variance of one factor, the block (Fisher 1925, "Statistical methods for
research workers", 40): with P passes, S₁ = Σ_B (Σ_p M_Bp)² / P and S₂ = Σ M_Bp² - S₁,

    F = (S₁ / (n - 2)) / (S₂ / ((P - 1)(n - 2)))

has Fisher's distribution without roughness, if blocks of a pass are independent. All tests of a surface together have
the chance of an error that 3 sigmas have. (A normal limit for V, whose distribution is skew, found roughness on 6 of 16
places with smooth walls.) Where drift makes the blocks of a pass alike, the scatter of the estimates by pairs of passes
shows it: V must exceed 3 of its sigmas, too. Few pairs cannot be tested, because V is never above E M²: there roughness
is what makes four fifths of it. In a single pass it cannot be told from the pass's errors: all of E M² beyond noise
counts as roughness.

A short wall has few long blocks. So its short blocks say how rough it is, and all walls of the place together say by
how much s V(s) grows from there, the most of all sizes. Where the long blocks of one wall say more, they hold. A wall
too short for any block is as rough as the roughest of the others, by its own weight per length.

Before anything is sailed, G follows from a field of the RMS r, the same in all directions, with the correlation
exp(-d² / 2 l²) at a distance d. The mean over a line of height H has the covariance ∫ C dz / H with another if H is
long beside l, so G = ∫∫ C dz dt / H = 2π r² l² / H, and with the area A = H L

    ω G = Σ W / A · 2π r² l².

The slopes of the lines along the wall's height have the same form, with Σ w τ² as weights. Of a field that is alike
over less than the wall's height both add the same: the weight of soundings per area times ∫ C over the area. So the
larger of the two holds for means and slopes.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.interval_sums import N_MOVED, Intervals, blocks
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.ping_differences import CERTAIN, Lines
from pipeline.maths.adjustment.ping_noise import DesignEffects
from pipeline.maths.adjustment.pose_errors import N_POSE, DriftEstimate

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SIZES_M = (0.25, 0.5, 1.0, 2.0)  # lengths of blocks
FEWEST_PAIRS = CERTAIN**2  # of block means, for a test
MOSTLY_ALIKE = 0.8  # part of E M² that must be alike in both passes where a test is not possible
FEWEST_BLOCKS, DETREND = 4, 2  # blocks in a pass; parameters of the line that it is freed of
LARGEST_CHANCE = math.erfc(CERTAIN / math.sqrt(2)) / 2 / (2 * len(SIZES_M))  # of each size, and of means and slopes
LEAST_SHARE = 0.1  # of the usual weight of a block: one with less is not used


@dataclass(frozen=True)
class Roughness:
    """Roughness by surface, (s,) each: what it adds to the design effects, and the RMS (m) of patches of the wall."""

    added: Array
    patch_m: Array

    @property
    def effects(self) -> DesignEffects:
        """Return the design effects of roughness beside the sensor's noise."""
        return DesignEffects(1 + self.added, 1 + self.added)


def expected_roughness(weight: Array, area_m2: Array, rms_m: float, length_m: float) -> Array:
    """Return what roughness that is known beforehand adds to the design effects (s,) of surfaces.

    Parameters
    ----------
    weight : (s,) array
        Σ W of all soundings on each surface, 1/m².
    area_m2 : (s,) array
        Their areas under water; nothing is added where it is zero.
    rms_m : float
        RMS r of the surfaces about their planes, m.
    length_m : float
        Length l over which they are alike, m.
    """
    per_area = np.divide(weight, area_m2, out=np.zeros(len(weight)), where=area_m2 > 0)
    return np.asarray(per_area * 2 * np.pi * rms_m**2 * length_m**2)


def roughness(
    sums: Intervals,
    surfaces: Sequence[ObservedSurface],
    body: BodyMotion,
    drift: DriftEstimate,
    gap_s: float,
) -> Roughness:
    """Return the roughness of the surfaces as one sensor sees it.

    Parameters
    ----------
    sums : Intervals
        The sensor's intervals, with the residuals at the adjusted values.
    surfaces : sequence of ObservedSurface
        The surfaces, in the order of their numbers in the sums.
    body : BodyMotion
        The motion of the body.
    drift : DriftEstimate
        The drift estimated so far.
    gap_s : float
        A longer time (s) without observations separates passes.
    """
    added, patch_m = np.zeros((2, len(surfaces), len(SIZES_M))), np.zeros(len(surfaces))
    per_length, too_short = np.zeros(len(surfaces)), np.zeros(len(surfaces), dtype=bool)
    lines = Lines.of(sums, surfaces, np.zeros(N_POSE))
    place, run = _places(sums, surfaces, body, drift), _runs(lines.record, body.seconds, gap_s)
    for number in range(len(surfaces)):
        rows = np.flatnonzero(lines.surface == number)
        if not len(rows):
            continue
        along, sloping = _along(place[rows]), lines.sloping[rows]
        per_length[number] = lines.total[rows].sum() / max(float(np.ptp(along)), SIZES_M[0])
        of_blocks = _PlacedLines(lines.mean[rows], lines.total[rows], along, run[rows]).by_size()
        too_short[number] = np.ptp(along) < FEWEST_BLOCKS * SIZES_M[0]
        added[0, number], patch_m[number] = of_blocks[:, 0], of_blocks[:, 1].max()
        rows, along = rows[sloping], along[sloping]
        if len(rows):
            sense = np.where(lines.along[rows] @ lines.along[rows[0]] < 0, -1.0, 1.0)
            slopes = _PlacedLines(sense * lines.slope[rows], lines.spread[rows], along, run[rows])
            added[1, number] = slopes.by_size()[:, 0]
    both = added[:, :, :1] * (added > 0)
    total = both.sum(axis=(0, 1))
    growth = max(1.0, float(np.max(added.sum(axis=(0, 1), where=both > 0) / np.where(total > 0, total, np.inf))))
    of_surface = np.maximum(growth * added[:, :, 0], added.max(axis=2)).max(axis=0)
    G = np.max(of_surface[per_length > 0] / per_length[per_length > 0], initial=0.0)
    return Roughness(np.where(too_short, np.maximum(of_surface, G * per_length), of_surface), patch_m)


@dataclass(frozen=True)
class _PlacedLines:
    """Values of lines (n,) on one surface, their weights, places along the wall (m), and numbers of their passes."""

    value: Array
    weight: Array
    place_m: Array
    run: Integers

    def by_size(self) -> Array:
        """Return by size of the blocks what roughness adds to the design effect, and the RMS of the blocks, (k, 2)."""
        return np.array([self._of_blocks(size) for size in SIZES_M])

    def _of_blocks(self, size_m: float) -> tuple[float, float]:
        number = np.floor((self.place_m - self.place_m.min()) / size_m).astype(np.int64)
        runs, run = np.unique(self.run, return_inverse=True)
        shape = len(runs), int(number.max()) + 1
        cell, cells = run * shape[1] + number, shape[0] * shape[1]
        weight = np.bincount(cell, self.weight, cells).reshape(shape)
        total = np.bincount(cell, self.weight * self.value, cells).reshape(shape)
        mean, used = np.zeros(shape), np.zeros(shape, dtype=bool)
        for k in range(len(runs)):
            use = weight[k] > LEAST_SHARE * np.median(weight[k][weight[k] > 0])
            if use.sum() >= FEWEST_BLOCKS:
                of_block = total[k][use] / weight[k][use]
                mean[k, use], used[k] = _without_line(np.flatnonzero(use).astype(float), of_block, weight[k][use]), use
        return _of_block_means(mean, np.where(used, weight, 0.0), used)


def _without_line(place: Array, value: Array, weight: Array) -> Array:
    """Return the values (n,) less their weighted line over the places."""
    design, root = np.stack([np.ones(len(place)), place - place.mean()], axis=1), np.sqrt(weight)
    line, *_ = np.linalg.lstsq(design * root[:, None], value * root, rcond=None)
    return np.asarray(value - design @ line)


def _of_block_means(mean: Array, weight: Array, used: NDArray[np.bool_]) -> tuple[float, float]:
    """Return ω G and √V from block means (passes, blocks), zero where not used; zeros if V is not certain."""
    count = used.sum(axis=0)
    n = int(np.sum(count > 0))
    if n < FEWEST_BLOCKS:
        return 0.0, 0.0
    squares, of_block = np.sum(mean**2, axis=0), weight.sum(axis=0)
    mean_square, pairs = squares.sum() / count.sum(), np.sum(count * (count - 1)) / 2
    if pairs > 0:
        V = np.sum(mean.sum(axis=0) ** 2 - squares) / 2 / pairs
        if pairs <= FEWEST_PAIRS:  # of so few no V is certain, for it is never above E M²
            certain = MOSTLY_ALIKE * mean_square < V
        else:
            certain = CERTAIN * _sigma_by_pairs(mean, used) < V and _chance(mean, used) < LARGEST_CHANCE
    else:
        noise = np.mean(1 / of_block[count > 0])
        V = mean_square - noise
        certain = CERTAIN * noise * np.sqrt(2 / n) < V
    if not certain:
        return 0.0, 0.0
    V *= n / (n - DETREND)
    return float(V * np.sum(of_block**2) / np.sum(of_block)), float(np.sqrt(V))


def _chance(mean: Array, used: NDArray[np.bool_]) -> float:
    """Return the chance that the block means of passes are as much alike without roughness, by the F test."""
    from scipy.special import fdtrc

    count = used.sum(axis=0)
    blocks_seen, passes = np.sum(count > 0), np.sum(np.any(used, axis=1))
    alike = np.sum(mean.sum(axis=0) ** 2 / np.maximum(count, 1))
    own = np.sum(mean**2) - alike
    dof_alike = blocks_seen - DETREND
    dof_own = count.sum() - DETREND * passes - dof_alike
    return float(fdtrc(dof_alike, dof_own, alike / dof_alike / (own / dof_own)))


def _sigma_by_pairs(mean: Array, used: NDArray[np.bool_]) -> float:
    """Return the standard deviation of V from its scatter over pairs of passes; zero for a single pair."""
    first, second = np.triu_indices(len(mean), 1)
    common = np.sum(used[first] & used[second], axis=1)
    first, second, common = (each[common > 0] for each in (first, second, common))
    of_pair = np.sum(mean[first] * mean[second], axis=1) / common
    return float(np.std(of_pair, ddof=1) / np.sqrt(len(of_pair))) if len(of_pair) > 1 else 0.0


def _runs(record: Integers, seconds: Array, gap_s: float) -> Integers:
    """Return the number (g,) of the pass of each interval: passes are apart by more than ``gap_s``."""
    known, inverse = np.unique(record, return_inverse=True)
    return np.concatenate([[0], np.cumsum(np.diff(seconds[known]) > gap_s)])[inverse]


def _places(
    sums: Intervals, surfaces: Sequence[ObservedSurface], body: BodyMotion, drift: DriftEstimate
) -> Array:
    """Return the places (g, 2) m of the intervals' centroids along the tangents of their surfaces."""
    tangents, centres = (np.array([getattr(each, name) for each in surfaces]) for name in ("tangents", "centre_m"))

    def of_blocks() -> Iterator[Array]:
        for block in blocks(sums):
            off_m = body.poses(block.record, block.share, drift).positions_m - centres[block.surface]
            centroid = block.normal[:, 0, 1:N_MOVED] / block.normal[:, :1, 0]
            yield centroid + np.einsum("gki,gi->gk", tangents[block.surface], off_m)

    return np.concatenate([*of_blocks(), np.empty((0, 2))])


def _along(place_m: Array) -> Array:
    """Return the places (n,) m along the direction in which they (n, 2) spread most."""
    centred = place_m - place_m.mean(axis=0)
    return np.asarray(centred @ np.linalg.eigh(centred.T @ centred)[1][:, -1])
