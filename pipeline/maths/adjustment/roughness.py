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

A line that covers a part of the height alone has the mean and the slope of the wall's shape there (a bow, the water's
refraction): where a ledge hides the rest, all passes see this alike. So pings' lines whose heights have less than half
of the variance that is usual in their pass say nothing of V. (A scanner's intervals see parts of the height anyway.)
They have their weight in the wall's mean all the same: ω is that of all lines, whichever of them V is taken from.

A test says whether V is certain (:mod:`~pipeline.maths.adjustment.rough_blocks`). On a wall with too few blocks for it,
what makes roughness likely holds for this wall.

Where the test finds V certain on one wall of a place, all its walls are likely rough. There V of the means of the
shortest blocks, of which there are most, holds on each wall, certain or not, but for a negative one. All walls together
say by how much s V(s) grows from there, the most of all sizes; V falls with s, so at most as s does. Where the long
blocks of one wall say more, and are certain, they hold.

G H (H: the height of the lines, see below) of a wall with n blocks that are independent has the relative variance
2 / (n - 2), large for a short wall. Say the walls of a place differ in it by half of it, τ = 1/2. Then the best mean of
a wall's own G H and that of the place, by all walls together, gives the place the weight of 2 / τ² = 8 blocks. A wall
too short for blocks is as rough as the place.

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
COVERING = 0.5  # of the usual variance of a line's heights: with less it covers a part of them
OF_PLACE = 8  # degrees of freedom that the place's roughness counts as


@dataclass(frozen=True)
class Roughness:
    """Roughness by surface, (s,) each: what it adds to the design effects, and the RMS (m) of its shortest blocks.

    shown: whether a test has found the place rough.
    """

    added: Array
    patch_m: Array
    shown: bool = False

    @classmethod
    def none(cls, surfaces: int, shown: bool = False) -> "Roughness":
        """Return that of so many surfaces of which nothing is known, but whether a test has found the place rough."""
        return cls(np.zeros(surfaces), np.zeros(surfaces), shown)

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
    fans: bool,
    shown: bool = False,
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
    fans : bool
        Whether an interval holds whole fans of beams, a ping's; those of a scanner hold parts of its turn.
    shown : bool
        Whether a test has found the place rough already, as with more of its walls.
    """
    shape = 2, len(surfaces), len(SIZES_M)
    added, certain, tested = np.zeros(shape), np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    per_length, dof, height_m = np.zeros(len(surfaces)), np.zeros(len(surfaces)), np.ones(len(surfaces))
    lines = Lines.of(sums, surfaces, np.zeros(N_POSE))
    place, run = _places(sums, surfaces, body, drift), _runs(lines.record, body.seconds, gap_s)
    walls = np.unique(lines.surface)
    for number in walls.tolist():
        rows = np.flatnonzero(lines.surface == number)
        along, total = _along(place[rows]), lines.total[rows].sum()
        per_length[number] = total / max(float(np.ptp(along)), SIZES_M[0])
        height_m[number] = max(float(np.sqrt(12 * lines.spread[rows].sum() / total)), SIZES_M[0])
        means, slopes = of_wall(lines, rows, along, run[rows], fans, len(walls))
        dof[number] = means[0].dof
        for kind, by_size in enumerate((means, slopes)):
            added[kind, number] = [one.added for one in by_size]
            certain[kind, number] = [one.certain for one in by_size]
            tested[kind, number] = [one.tested for one in by_size]
    return Walls(added, certain, tested, per_length, height_m, dof).roughness(shown)


def of_wall(
    lines: Lines, rows: Integers, along_m: Array, run: Integers, fans: bool, walls: int
) -> tuple[list[OfBlocks], list[OfBlocks]]:
    """Return what blocks of each size say of a wall, by the means of its lines and by their slopes.

    Parameters
    ----------
    lines : Lines
        The lines of all walls.
    rows : (n,) array
        The wall's own among them, with their places along it (along_m, m) and the numbers of their passes (run).
    fans : bool
        Whether a line must cover the height (module docstring); what the others weigh counts all the same.
    walls : int
        How many walls are tested at the place.
    """
    total, spread = lines.total[rows], lines.spread[rows]
    used = covering(spread / total, run) if fans else np.ones(len(rows), dtype=bool)
    means = PlacedLines(lines.mean[rows][used], total[used], along_m[used], run[used])
    of_means, of_slopes = means.by_size(walls, total.sum()), [OfBlocks()] * len(SIZES_M)
    used &= lines.sloping[rows]
    if used.any():
        along, slope = lines.along[rows][used], lines.slope[rows][used]
        sense = np.where(along @ along[0] < 0, -1.0, 1.0)
        slopes = PlacedLines(sense * slope, spread[used], along_m[used], run[used])
        of_slopes = slopes.by_size(walls, spread.sum())
    return of_means, of_slopes


@dataclass(frozen=True)
class Walls:
    """What the blocks of all walls say: by means and slopes of lines, wall, and size of the blocks, (2, s, k) each.

    added: ω G, below zero where V is, zero without blocks; certain, tested: of V. By wall (s,): per_length: ω, zero for
    a wall without lines; height_m: H of its lines; dof: degrees of freedom of the means of the shortest blocks.
    """

    added: Array
    certain: NDArray[np.bool_]
    tested: NDArray[np.bool_]
    per_length: Array
    height_m: Array
    dof: Array

    def roughness(self, shown: bool = False) -> Roughness:
        """Return the roughness of each wall, as all walls of the place show it together; ``shown``: before."""
        reached = np.any(self.tested, axis=(0, 2))
        counts = self.certain & (self.tested | ~reached[:, None])
        effects = own = np.max(np.where(counts, self.added, 0.0), axis=(0, 2), initial=0.0)
        shown |= bool(np.any(self.certain & self.tested))
        if shown:
            of_slopes = np.where(counts[1, :, 0], self.added[1, :, 0], 0.0)
            of_shortest = np.maximum(self.added[0, :, 0], of_slopes)
            shared = self._with_the_place(np.maximum(self._growth() * of_shortest, own))
            effects = np.where(reached, shared, np.maximum(shared, own))
        V = effects / np.where(self.per_length > 0, self.per_length, np.inf) / SIZES_M[0] / self._growth()
        return Roughness(effects, np.sqrt(V), shown)

    def _growth(self) -> float:
        """Return s V(s) of the size of blocks for which it is largest, over that of the shortest blocks."""
        shortest = np.sum(self.added[:, :, :1] * (self.added != 0), axis=(0, 1))
        ratio = self.added.sum(axis=(0, 1)) / np.where(shortest > 0, shortest, np.inf)
        return float(np.clip(ratio, 1.0, np.array(SIZES_M) / SIZES_M[0]).max())

    def _with_the_place(self, effects: Array) -> Array:
        """Return effects (s,) in which each wall has G H of its own and that of the place."""
        per_area = self.per_length / self.height_m
        own = effects / np.where(per_area > 0, per_area, np.inf)
        of_place = float(np.sum(self.dof * own) / max(np.sum(self.dof), 1.0))
        return np.asarray(per_area * (self.dof * own + OF_PLACE * of_place) / (self.dof + OF_PLACE))


def _runs(record: Integers, seconds: Array, gap_s: float) -> Integers:
    """Return the number (g,) of the pass of each interval: passes are apart by more than ``gap_s``."""
    known, inverse = np.unique(record, return_inverse=True)
    return np.concatenate([[0], np.cumsum(np.diff(seconds[known]) > gap_s)])[inverse]


def covering(variance_m2: Array, run: Integers) -> NDArray[np.bool_]:
    """Return which lines (n,) cover the heights that are usual in their pass, by the variance of their heights."""
    numbers, inverse = np.unique(run, return_inverse=True)
    usual = np.array([np.median(variance_m2[inverse == k]) for k in range(len(numbers))])
    return np.asarray(variance_m2 >= COVERING * usual[inverse])


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
