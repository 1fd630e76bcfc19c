"""Coverage: how much of a target in a pose the laser saw, and two such hypotheses compared where they differ.

A *hypothesis* is a target in a pose. Its upright faces above its own water are cut into cells of about 0.1 m by 0.1 m.
(Level faces do not count: the laser sees them too flat.) The laser says of each cell one of three things:

* It is *seen*: a laser point lies within 0.06 m of the surface, with its foot within 0.1 m of the cell's centre.
* It is *missed*: no point lies there, although two rays or more of the scanner meet the cell before any other face, not
  flatter than 15°. They went through the face that the hypothesis puts there, or came back from nowhere.
* Neither: the scanner did not look there. That is no evidence.

The *agreement* of a hypothesis is Σ a_k over its seen cells less Σ a_k over its missed cells, a_k in m² of surface.

Why this is the score. Let a share 1 - p of the cells that the scanner looks at be seen where there is a face, and a
share p where there is none. Then a seen cell makes "here is a face" more probable than "here is none" by the factor
(1 - p) / p, a missed cell less probable by the same factor, and a cell at which the scanner did not look changes
nothing. So the logarithm of the likelihood ratio is ln((1 - p) / p) times the number of seen cells less the number of
missed ones: proportional to the agreement. The factor of proportion is not known, because neighbouring cells fail
together: one plank hides many. So the area itself is compared with a limit.

Two hypotheses are compared in the *strip* where they differ: the cells of each that lie farther than 0.1 m from the dry
surface of the other. Everywhere else both say the same, and only the chance of sampling would tell them apart. A seen
cell of one hypothesis in its strip contradicts the other: by the other, its points lie on nothing, or under the water.
A missed cell contradicts the hypothesis itself. The margin of one over the other is

    margin = agreement of one in its strip - agreement of the other in its strip.

Points are not kept far below the water of the pose that was found. So no cell of a rival below it counts.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.target.model import TargetFrame, TargetModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
CELL_M = 0.1  # side of a cell; a cell's centre lies higher than this above the water
DIFFERENT_M = 0.1  # two surfaces farther apart than this differ
ON_FACE_M = 0.06  # a point farther than this from the surface does not lie on it
NEAR_M = 0.1  # a cell is seen if the foot of a point lies within this of its centre
FEWEST_RAYS = 2  # fewer rays that meet a cell do not show that the scanner looks there
FLATTEST = np.sin(np.radians(15.0))  # a ray that meets a face at less than 15° need not come back


class Surface(Protocol):
    """The surface of a target, target frame."""

    def __call__(self, points_m: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return the nearest points (n, 3) m on the surface, and the numbers of their faces (n,)."""
        ...

    def ranges(self, origins_m: Array, directions: Array) -> Array:
        """Return the distances (n,) m to the surface along unit rays (n, 3); infinite for rays that miss it."""
        ...


@dataclass(frozen=True)
class Scan:
    """What the laser saw and where it looked, pool frame.

    Parameters
    ----------
    points_m
        Laser points (n, 3), evenly spaced.
    origins_m, directions
        Rays (r, 3) that the scanner sent, whether they came back or not; directions are unit vectors.
    """

    points_m: Array
    origins_m: Array
    directions: Array


@dataclass(frozen=True)
class Cells:
    """Cells of a target's faces, target frame: centres (n, 3) m, unit normals (n, 3), areas (n,) m²."""

    centres_m: Array
    normals: Array
    areas_m2: Array

    def of(self, rows: Flags) -> "Cells":
        """Return some of the cells, by a mask (n,)."""
        return Cells(self.centres_m[rows], self.normals[rows], self.areas_m2[rows])


def dry_cells(model: TargetModel) -> Cells:
    """Return the cells of the upright faces above the water that the laser may see."""
    centres, normals, areas = [np.empty((0, 3))], [np.empty((0, 3))], [np.empty(0)]
    for face in model.faces:
        if face.level or face.seen == "wet":
            continue
        points, area_m2 = face.cells(CELL_M)
        points = points[points[:, 2] > model.water_level_m + CELL_M]
        centres.append(points)
        normals.append(np.tile(face.normal, (len(points), 1)))
        areas.append(np.full(len(points), area_m2))
    return Cells(np.concatenate(centres), np.concatenate(normals), np.concatenate(areas))


@dataclass(frozen=True)
class Hypothesis:
    """A target in a pose: its model, its frame in the pool, and its surface."""

    model: TargetModel
    frame: TargetFrame
    surface: Surface

    def agreement_m2(self, cells: Cells, scan: Scan) -> Array:
        """Return the contribution (n,) of each cell to the agreement: its area if seen, minus it if missed, or 0."""
        if not len(cells.areas_m2):
            return np.empty(0)
        seen = self._seen(cells, scan)
        missed = ~seen & (self._rays_that_meet(cells, scan) >= FEWEST_RAYS)
        return np.asarray(cells.areas_m2 * (seen.astype(float) - missed))

    def _seen(self, cells: Cells, scan: Scan) -> Flags:
        from scipy.spatial import cKDTree  # the import takes half a second

        points = self.frame.points_from_pool(scan.points_m)
        feet, _ = self.surface(points)
        feet = feet[np.sum((points - feet) ** 2, axis=1) < ON_FACE_M**2]
        if not len(feet):
            return np.zeros(len(cells.areas_m2), dtype=bool)
        distance, _ = cKDTree(feet).query(cells.centres_m, distance_upper_bound=NEAR_M)
        return np.asarray(np.isfinite(distance))

    def _rays_that_meet(self, cells: Cells, scan: Scan) -> NDArray[np.int64]:
        """Return the number (n,) of rays that meet each cell before any other face, and steeply enough."""
        from scipy.spatial import cKDTree

        directions = scan.directions @ self.frame.R_target_from_pool.T
        origins = self.frame.points_from_pool(scan.origins_m)
        ranges = self.surface.ranges(origins, directions)
        meets = np.flatnonzero(np.isfinite(ranges))
        directions = directions[meets]
        met = origins[meets] + ranges[meets, None] * directions
        distance, cell = cKDTree(cells.centres_m).query(met, distance_upper_bound=CELL_M)
        near = np.flatnonzero(np.isfinite(distance))
        cell = cell[near]
        steep = -np.sum(cells.normals[cell] * directions[near], axis=1) > FLATTEST
        return np.bincount(cell[steep], minlength=len(cells.areas_m2))

    def stands_at(self, points_pool_m: Array) -> Flags:
        """Return a mask (n,): true for points (n, 3) m within 0.1 m of the surface above the water."""
        points = self.frame.points_from_pool(points_pool_m)
        nearest, _ = self.surface(points)
        near = np.sum((points - nearest) ** 2, axis=1) <= DIFFERENT_M**2
        return np.asarray(near & (nearest[:, 2] > self.model.water_level_m - DIFFERENT_M))

    def above_water(self, points_pool_m: Array) -> Flags:
        """Return a mask (n,): true for points (n, 3) m that are as high above this hypothesis' water as its cells."""
        return np.asarray(self.frame.points_from_pool(points_pool_m)[:, 2] > self.model.water_level_m + CELL_M)


@dataclass(frozen=True)
class Comparison:
    """Margin (m²) of a pose over a rival, and the larger of the areas (m²) of their cells where they differ."""

    margin_m2: float
    strip_m2: float


class Found:
    """The hypothesis that a search found, with the agreement of each cell, to compare rivals with.

    ``agreement_m2`` is its agreement (m²) over all cells.
    """

    def __init__(self, hypothesis: Hypothesis, scan: Scan) -> None:
        self._hypothesis, self._scan = hypothesis, scan
        self._cells = dry_cells(hypothesis.model)
        self._centres_pool_m = hypothesis.frame.points_to_pool(self._cells.centres_m)
        self._of_cells = hypothesis.agreement_m2(self._cells, scan)
        self.agreement_m2 = float(self._of_cells.sum())

    def over(self, rival: Hypothesis) -> Comparison:
        """Return the margin over a rival."""
        own_strip = ~rival.stands_at(self._centres_pool_m)
        cells = dry_cells(rival.model)
        centres_pool_m = rival.frame.points_to_pool(cells.centres_m)
        strip = self._hypothesis.above_water(centres_pool_m) & ~self._hypothesis.stands_at(centres_pool_m)
        rivals = cells.of(strip)
        margin_m2 = self._of_cells[own_strip].sum() - rival.agreement_m2(rivals, self._scan).sum()
        strip_m2 = max(self._cells.areas_m2[own_strip].sum(), rivals.areas_m2.sum())
        return Comparison(float(margin_m2), float(strip_m2))
