"""Whether blocks of a wall stand off it alike in all passes: the analysis of variance.

In pass p a block B of a wall has the mean M_Bp, less a line along the wall. What is alike in all passes has the
variance V = E M_Bp M_Bq over pairs of passes (:mod:`~pipeline.maths.adjustment.roughness`).

The analysis of variance of one factor, the block, says whether V is certain (Fisher 1925, "Statistical methods for
research workers", 40): with P passes, S₁ = Σ_B (Σ_p M_Bp)² / P and S₂ = Σ M_Bp² - S₁,

    F = (S₁ / (n - 2)) / (S₂ / ((P - 1)(n - 2)))

has Fisher's distribution without roughness, if blocks of a pass are independent. All tests of a place together have the
chance of an error that 3 sigmas have. (A normal limit for V, whose distribution is skew, found roughness on 6 of 16
places with smooth walls.) Where drift makes the blocks of a pass alike, the scatter of the estimates by pairs of passes
shows it: V must exceed 3 of its sigmas, too.

Few pairs cannot be tested, because V is never above E M²: there roughness is likely where V makes four fifths of it. On
a wall that one pass alone has seen, roughness cannot be told from the pass's errors: all of E M² beyond noise is V.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.ping_differences import CERTAIN

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SIZES_M = (0.25, 0.5, 1.0, 2.0)  # lengths of blocks
FEWEST_PAIRS = CERTAIN**2  # of block means, for a test
MOSTLY_ALIKE = 0.8  # part of E M² that must be alike in both passes where a test is not possible
FEWEST_BLOCKS, DETREND = 4, 2  # blocks in a pass; parameters of the line that it is freed of
LARGEST_CHANCE = math.erfc(CERTAIN / math.sqrt(2)) / 2 / (2 * len(SIZES_M))  # of each size, and of means and slopes
LEAST_SHARE = 0.1  # of the usual weight of a block: one with less is not used


@dataclass(frozen=True)
class OfBlocks:
    """What blocks of one size say.

    added: ω G, below zero if V is; certain: whether V is certain, or likely where it is not tested; tested: by the
    analysis of variance; dof: degrees of freedom of V.
    """

    added: float = 0.0
    certain: bool = False
    tested: bool = False
    dof: int = 0


@dataclass(frozen=True)
class PlacedLines:
    """Values of lines (n,) on one surface, their weights, places along the wall (m), and numbers of their passes."""

    value: Array
    weight: Array
    place_m: Array
    run: Integers

    def by_size(self, walls: int = 1, weight: float | None = None) -> list[OfBlocks]:
        """Return what blocks of each size say.

        walls: how many are tested at the place; weight: of all lines on the surface, where these are a part of them.
        """
        of_all = 1.0 if weight is None else weight / float(self.weight.sum())
        by_size = [self._of_blocks(size, LARGEST_CHANCE / walls) for size in SIZES_M]
        return [replace(one, added=of_all * one.added) for one in by_size]

    def _of_blocks(self, size_m: float, chance: float) -> OfBlocks:
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
        return _of_block_means(mean, np.where(used, weight, 0.0), used, chance)


def _without_line(place: Array, value: Array, weight: Array) -> Array:
    """Return the values (n,) less their weighted line over the places."""
    design, root = np.stack([np.ones(len(place)), place - place.mean()], axis=1), np.sqrt(weight)
    line, *_ = np.linalg.lstsq(design * root[:, None], value * root, rcond=None)
    return np.asarray(value - design @ line)


def _of_block_means(mean: Array, weight: Array, used: NDArray[np.bool_], chance: float) -> OfBlocks:
    """Return what block means (passes, blocks) say, with their weights; zero where not used; chance: of a test."""
    count = used.sum(axis=0)
    n, pairs = int(np.sum(count > 0)), float(np.sum(count * (count - 1)) / 2)
    if n < FEWEST_BLOCKS or (pairs == 0 and len(mean) > 1):
        return OfBlocks()
    squares, of_block, tested = np.sum(mean**2, axis=0), weight.sum(axis=0), False
    mean_square = squares.sum() / count.sum()
    if pairs > 0:
        V = np.sum(mean.sum(axis=0) ** 2 - squares) / 2 / pairs
        alike = _chance(mean, used) if pairs > FEWEST_PAIRS else None
        tested = alike is not None
        if alike is None:  # of so few no V is certain, for it is never above E M²
            certain = MOSTLY_ALIKE * mean_square < V
        else:
            certain = CERTAIN * _sigma_by_pairs(mean, used) < V and alike < chance
    else:
        noise = np.mean(1 / of_block[count > 0])
        V = mean_square - noise
        certain = CERTAIN * noise * np.sqrt(2 / n) < V
    V *= n / (n - DETREND)
    return OfBlocks(V * float(np.sum(of_block**2) / np.sum(of_block)), bool(certain), tested, n - DETREND)


def _chance(mean: Array, used: NDArray[np.bool_]) -> float | None:
    """Return the chance that block means are as much alike without roughness, by the F test; None: too few for it."""
    from scipy.special import fdtrc

    count = used.sum(axis=0)
    blocks_seen, passes = np.sum(count > 0), np.sum(np.any(used, axis=1))
    alike = np.sum(mean.sum(axis=0) ** 2 / np.maximum(count, 1))
    own = np.sum(mean**2) - alike
    dof_alike = blocks_seen - DETREND
    dof_own = count.sum() - DETREND * passes - dof_alike
    if dof_own < 1 or own <= 0:
        return None
    return float(fdtrc(dof_alike, dof_own, alike / dof_alike / (own / dof_own)))


def _sigma_by_pairs(mean: Array, used: NDArray[np.bool_]) -> float:
    """Return the standard deviation of V from its scatter over pairs of passes; zero for a single pair."""
    first, second = np.triu_indices(len(mean), 1)
    common = np.sum(used[first] & used[second], axis=1)
    first, second, common = (each[common > 0] for each in (first, second, common))
    of_pair = np.sum(mean[first] * mean[second], axis=1) / common
    return float(np.std(of_pair, ddof=1) / np.sqrt(len(of_pair))) if len(of_pair) > 1 else 0.0
