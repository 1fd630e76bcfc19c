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

Whether V is certain says a test (:mod:`~pipeline.maths.adjustment.rough_blocks`). Only where no wall of the place has
enough blocks for it, what makes roughness likely on a wall holds for this wall.

Where the test finds V certain on one wall of a place, all its walls are likely rough, for they stand in the same
water. There V of the means of the shortest blocks, of which there are most, holds on each wall, certain or not, but for
a negative one.

A short wall has few long blocks. So its short blocks say how rough it is, and all walls of the place together say by
how much s V(s) grows from there, the most of all sizes. Where the long blocks of one wall say more, they hold.

G of a wall with n blocks has the relative variance 2 / (n - 2), large for a short wall. Say the walls of a place differ
in G by half of it, τ = 1/2. Then the best mean of a wall's own G and that of the place, by all walls together, gives
the place the weight of 2 / τ² = 8 blocks. A wall too short for blocks is as rough as the place.

Before anything is sailed, G follows from a field of the RMS r, the same in all directions, with the correlation
exp(-d² / 2 l²) at a distance d. The mean over a line of height H has the covariance ∫ C dz / H with another if H is
long beside l, so G = ∫∫ C dz dt / H = 2π r² l² / H, and with the area A = H L

    ω G = Σ W / A · 2π r² l².

The slopes of the lines along the wall's height have the same form, with Σ w τ² as weights. Of a field that is alike
over less than the wall's height both add the same: the weight of soundings per area times ∫ C over the area. So the
larger of the two holds for means and slopes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.interval_sums import N_MOVED, Intervals, blocks
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.ping_differences import Lines
from pipeline.maths.adjustment.ping_noise import DesignEffects
from pipeline.maths.adjustment.pose_errors import N_POSE, DriftEstimate
from pipeline.maths.adjustment.rough_blocks import SIZES_M, OfBlocks, PlacedLines

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
OF_PLACE = 8  # degrees of freedom that the place's roughness counts as


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
    added, certain, tested = np.zeros((3, 2, len(surfaces), len(SIZES_M)))
    per_length, dof, patch_m = np.zeros((3, len(surfaces)))
    lines = Lines.of(sums, surfaces, np.zeros(N_POSE))
    place, run = _places(sums, surfaces, body, drift), _runs(lines.record, body.seconds, gap_s)
    for number in range(len(surfaces)):
        rows = np.flatnonzero(lines.surface == number)
        if not len(rows):
            continue
        along, sloping = _along(place[rows]), lines.sloping[rows]
        per_length[number] = lines.total[rows].sum() / max(float(np.ptp(along)), SIZES_M[0])
        means = PlacedLines(lines.mean[rows], lines.total[rows], along, run[rows]).by_size()
        dof[number], patch_m[number] = means[0].dof, max(one.patch_m for one in means)
        rows, along, slopes = rows[sloping], along[sloping], [OfBlocks()] * len(SIZES_M)
        if len(rows):
            sense = np.where(lines.along[rows] @ lines.along[rows[0]] < 0, -1.0, 1.0)
            slopes = PlacedLines(sense * lines.slope[rows], lines.spread[rows], along, run[rows]).by_size()
        for values, name in ((added, "added"), (certain, "certain"), (tested, "tested")):
            values[:, number] = [[getattr(one, name) for one in by_size] for by_size in (means, slopes)]
    if np.any(tested):
        of_place = certain * tested
        of_place[0, :, 0] = 1.0
        effects = all_walls(added * of_place, per_length, dof) * np.any(certain * tested)
    else:
        effects = np.max(added * certain, axis=(0, 2))
    return Roughness(effects, np.where(effects > 0, patch_m, 0.0))


def all_walls(added: Array, per_length: Array, dof: Array) -> Array:
    """Return the effects ω G (s,) of walls, as all walls of the place together show them.

    Parameters
    ----------
    added : (2, s, k) array
        ω G by the means and by the slopes of lines, by wall and size of the blocks, the shortest first.
    per_length : (s,) array
        ω, zero for a wall without lines.
    dof : (s,) array
        Degrees of freedom of the shortest blocks; zero where there are too few.
    """
    both = added[:, :, :1] * (added > 0)
    total = both.sum(axis=(0, 1))
    growth = max(1.0, float(np.max(added.sum(axis=(0, 1), where=both > 0) / np.where(total > 0, total, np.inf))))
    G = np.maximum(growth * added[:, :, 0], added.max(axis=2)).max(axis=0) / np.where(per_length > 0, per_length, 1.0)
    of_place = float(np.sum(dof * G) / max(np.sum(dof), 1.0))
    return np.asarray(per_length * (dof * G + OF_PLACE * of_place) / (dof + OF_PLACE))


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
