"""Planes of the cloud that are one wall, one above the other: gaps between blocks, a pipe or a walkway part them.

Regions grow from voxel to voxel and end at a gap. The part above it ends above the water, or is too small, and the part
below it may be too low; together they serve, and the plane is that of a higher wall. They are joined if the plane of
both together passes through the middle of each, and serves. A course of blocks not much higher than a voxel makes no
region; its points join the plane in which they lie. What is far less dense than the plane does not join: water mirrors
walls. Planes beside each other are not joined: above the water they lie in one plane, but below it each has its own
errors.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.gaps import EMPTY, USUAL
from pipeline.maths.surfaces.flatness import plane_axes
from pipeline.maths.surfaces.outline import area

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
GAP_M = 2.0  # largest difference of height between the upper end of one and the lower end of the next
SHARED = 0.5  # of the width of the narrower one: least part in which both stand
NEAR_M = 0.05  # largest distance of the smaller one's corners from the larger one's plane
SAME_M = 0.01  # largest distance of either one's middle from the plane of both
DENSE = 0.3  # of the plane's points to each area, or height: least that what joins it must have
ON_M = 0.03  # largest distance of a course's points from the plane
COURSE_M = 0.1  # heights in which a course's points are counted


def with_stacks_joined(
    planes: Sequence[DryPlane],
    rows: Sequence[Integers],
    free: Integers,
    points_m: Array,
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
    plane_of : callable
        Makes the plane of the points of some rows, given about where it lies.
    """
    left = sorted(range(len(planes)), key=lambda k: (-planes[k].points, k))
    thin = [rows[k] for k in left if len(planes[k].outline_m) < 3]  # lower or narrower than its margins
    free = np.sort(np.concatenate([free, *thin]))
    found, free_m, taken = [], points_m[free], np.zeros(len(points_m), dtype=bool)
    while left:
        first = left.pop(0)
        plane, points = planes[first], rows[first]
        if taken[points].any():
            continue  # a course of another plane
        courses = free[in_courses(plane, points_m[points], free_m)]
        if len(courses):
            joined = plane_of(np.concatenate([points, courses]), plane)
            if is_one(joined, (plane,)):
                plane, points = joined, np.concatenate([points, courses])
                taken[courses] = True
        while True:
            for other in left:
                if may_be_one(plane, planes[other]):
                    together = np.concatenate([points, rows[other]])
                    joined = plane_of(together, plane)
                    if is_one(joined, (plane, planes[other])):
                        plane, points = joined, together
                        left.remove(other)
                        break
            else:
                break
        found.append(plane)
    return found


def in_courses(plane: DryPlane, own_m: Array, free_m: Array) -> NDArray[np.bool_]:
    """Return which points (k,) of no plane are courses of a wall over or under its own points, or in their gaps."""
    if plane.level or len(plane.outline_m) < 3 or not len(own_m):
        return np.zeros(len(free_m), dtype=bool)
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
    if larger.level or smaller.level or min(len(larger.outline_m), len(smaller.outline_m)) < 3:
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


def is_one(joined: DryPlane, parts: Sequence[DryPlane]) -> bool:
    """Return whether the plane of some planes' points serves, and passes through the middle of each of them."""
    middles = (part.corners_m(part.middle_m[None])[0] for part in parts)
    return not joined.refused and all(abs(one @ joined.normal - joined.distance_m) <= SAME_M for one in middles)
