"""Planes of the cloud that are one wall, one above the other: gaps between blocks, a pipe or a walkway part them.

Regions grow from voxel to voxel and end at a gap. The part above it ends above the water, or is too small, and the part
below it may be too low; together they make a higher wall. They are joined to a part that serves alone, if the plane of
both together serves, and each part lies in it from end to end: what is set back would lean the plane. A course of
blocks not much higher than a voxel makes no region, or one whose own plane its ledge has turned; its points join the
plane in which they lie. What lies below the water, or is far less dense than the plane, does not join: water mirrors
walls. Planes beside each other are not joined: above the water they lie in one plane, but below it each has its own
errors.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.gaps import EMPTY, USUAL
from pipeline.finding.plane_cells import CELL_M, cells_on
from pipeline.maths.surfaces.flatness import plane_axes
from pipeline.maths.surfaces.outline import area

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
GAP_M = 2.0  # largest difference of height between the upper end of one and the lower end of the next
SHARED = 0.5  # of the width of the narrower one: least part in which both stand
NEAR_M = 0.05  # largest distance of the smaller one's corners from the larger one's plane
SAME_M = 0.004  # largest distance of each part's own plane from that of both, over its cells
FEWEST_CELLS = 3  # of a part
DENSE = 0.3  # of the plane's points to each area, or height: least that what joins it must have
LEAST_M2 = 0.01  # an outline of less area is none
THIN_M = 0.75  # a lower part is a course: what lies before it and behind it turns its own plane
ON_M = 0.03  # largest distance of a course's points from the plane
COURSE_M = 0.1  # heights in which a course's points are counted
MOST_FAILED = 8  # parts that do not join: with more no further ones are tried, for each takes all points
BELOW_M = 0.3  # a part that reaches so far below the water is an image


def with_stacks_joined(
    planes: Sequence[DryPlane],
    rows: Sequence[Integers],
    free: Integers,
    points_m: Array,
    level_m: float,
    plane_of: Callable[[Integers, DryPlane], DryPlane],
) -> list[DryPlane]:
    """Return the planes, those that are one wall as one.

    Parameters
    ----------
    planes : sequence of DryPlane
        Planes of the cloud.
    rows : sequence of (n,) arrays
        Rows of the points of each.
    free : (k,) array
        Rows of the points that lie in none.
    points_m : (m, 3) array
        All points.
    level_m : float
        Height of the water, as far as it is known: -inf if not.
    plane_of : callable
        Makes the plane of the points of some rows, given about where it lies.
    """
    left = sorted(range(len(planes)), key=lambda k: (-planes[k].points, k))
    thin = [rows[k] for k in left if planes[k].flat.height_m < THIN_M or not _has_outline(planes[k])]
    free = np.sort(np.concatenate([free, *thin]))
    free = free[points_m[free, 2] > level_m]
    found, free_m, taken = [], points_m[free], np.zeros(len(points_m), dtype=bool)
    while left:
        first = left.pop(0)
        plane, points = planes[first], rows[first]
        if taken[points].mean() > 0.5:
            continue  # a course of another plane
        if plane.refused:  # a part that cannot serve alone does not say how others lean
            found.append(plane)
            continue
        courses = free[in_courses(plane, points_m[points], free_m) & ~taken[free]]
        if len(courses):
            joined = plane_of(np.concatenate([points, courses]), plane)
            if all(lies_in(joined, points_m[part]) for part in (points, courses)):
                plane, points = joined, np.concatenate([points, courses])
                taken[courses] = True
        failed = set[int]()
        for _ in range(2):  # what is too far from the first may be near enough to both
            for other in list(left):
                if planes[other].lowest_m <= level_m - BELOW_M or other in failed or len(failed) >= MOST_FAILED:
                    continue
                if taken[rows[other]].mean() > 0.5:  # as courses
                    continue
                if may_be_one(plane, planes[other]):
                    joined = plane_of(np.concatenate([points, rows[other]]), plane)
                    if all(lies_in(joined, points_m[part]) for part in (points, rows[other])):
                        plane, points = joined, np.concatenate([points, rows[other]])
                        left.remove(other)
                    else:
                        failed.add(other)
        found.append(plane)
    return found


def in_courses(plane: DryPlane, own_m: Array, free_m: Array) -> NDArray[np.bool_]:
    """Return which points (k,) of no plane are courses of a wall over or under its own points, or in their gaps."""
    along, ends = free_m @ plane_axes(plane.normal)[0], plane.outline_m[:, 0]
    on = (np.abs(free_m @ plane.normal - plane.distance_m) <= ON_M) & (along >= ends.min()) & (along <= ends.max())
    low = own_m[:, 2].min() - GAP_M
    course, of_own = (np.floor((one[:, 2] - low) / COURSE_M).astype(np.int64) for one in (free_m, own_m))
    on &= (course >= 0) & (course <= of_own.max() + round(GAP_M / COURSE_M))
    own = np.bincount(of_own, minlength=of_own.max() + round(GAP_M / COURSE_M) + 1)
    usual = float(np.quantile(own[own > 0], USUAL))
    full = np.bincount(course[on], minlength=len(own)) >= DENSE * usual
    on[on] = (full & (own < EMPTY * usual))[course[on]]
    return np.asarray(on)


def may_be_one(larger: DryPlane, smaller: DryPlane) -> bool:
    """Return whether a plane stands over or under a larger one, in about its plane."""
    if smaller.level or not (_has_outline(larger) and _has_outline(smaller)):
        return False
    dense = [plane.points / area(plane.outline_m) for plane in (larger, smaller)]
    if dense[1] < DENSE * dense[0]:
        return False
    corners_m = smaller.corners_m(smaller.outline_m)
    if np.abs(corners_m @ larger.normal - larger.distance_m).max() > NEAR_M:
        return False
    along, of_larger = corners_m @ plane_axes(larger.normal)[0], larger.outline_m[:, 0]
    shared = min(along.max(), of_larger.max()) - max(along.min(), of_larger.min())
    heights, of_larger_m = corners_m[:, 2], larger.corners_m(larger.outline_m)[:, 2]
    gap = max(heights.min() - of_larger_m.max(), of_larger_m.min() - heights.max())
    return bool(shared >= SHARED * min(np.ptp(along), np.ptp(of_larger)) and gap <= GAP_M)


def lies_in(plane: DryPlane, points_m: Array) -> bool:
    """Return whether a plane serves, and a part of it, by its points (n, 3), lies in it from end to end."""
    cells_m, _ = cells_on(points_m, plane.normal, plane.distance_m, CELL_M, 0.0)
    if plane.refused or len(cells_m) < FEWEST_CELLS:
        return False
    design = np.column_stack([np.ones(len(cells_m)), (cells_m - cells_m.mean(axis=0)) @ plane_axes(plane.normal).T])
    off_m = design @ np.linalg.lstsq(design, cells_m @ plane.normal - plane.distance_m, rcond=None)[0]
    return bool(np.abs(off_m).max() <= SAME_M)


def _has_outline(plane: DryPlane) -> bool:
    return len(plane.outline_m) >= 3 and area(plane.outline_m) >= LEAST_M2
