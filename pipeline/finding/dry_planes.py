"""Planes above the water in the laser's points: which can serve, which cannot and why, and where the water is."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Mapper, serial
from pipeline.errors import RawDataError
from pipeline.finding.dry_plane import LEVEL_DEG, DryPlane
from pipeline.finding.gaps import EMPTY, USUAL, dry_gaps, gaps_below, in_gaps, top_m
from pipeline.finding.plane_cells import CELL_M, CORNERS, FEWEST, OFF_M, UNEVEN_M, cells_on
from pipeline.finding.stacked_planes import with_stacks_joined
from pipeline.maths.adjustment.profiles import NORMAL
from pipeline.maths.surfaces.flatness import cells_of, flatness, plane_axes
from pipeline.maths.surfaces.growing import GrowthLimits, Plane, grown_regions, plane_of_voxels
from pipeline.maths.surfaces.outline import area, clipped, convex_hull, inside, shrunk, simplified
from pipeline.maths.surfaces.voxels import voxels_with_rows

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
VOXEL_M = 0.3
CUT, SMOOTH_M = 3.0, 0.001  # robust sigmas of distances from a plane, and the least such sigma
FEWEST_CELLS, REFITS = 8, 5  # cells of a plane, fits of a plane to its cells
GROWTH = GrowthLimits(thickness_m=0.03, distance_m=0.06, least_voxels=12)
SAMPLE = 4000  # points of a plane that are kept for pictures, and tell its scatter; up to twice as many
MARGIN_M = 0.1  # of the outline: inside the outermost cells' means
EDGE_CELL_M, EDGE_MARGIN_M = 0.1, 0.02  # the same of the last outline, where the points are dense enough
BEYOND_M = VOXEL_M + MARGIN_M  # so far outside the first outline the last one may lie
WAVES_M, OF_HEIGHT = 0.3, 0.25  # above the lowest points: waves, splash, the water's echoes; at most this share
LEAST_M, BOW_M, COVERED = 1.0, 0.03, 0.6  # extent; bow; share of the cells seen, but for gaps
RISE_M, FEW_M2 = 0.4, 0.1  # least rise of its dry part; area of the densest plane with as many points as it needs
NEAR_WATER_M = 0.5  # largest height of a plane's lower end above the water
COLUMN_SPREAD_M, FEWEST_COLUMNS, FULL = 0.1, 6, 20  # columns of points that end at the water; points of a column
FOOT_M = 0.5  # of a column, round its lowest points


def dry_planes(points_m: Array, boat_m: Array, mapper: Mapper = serial) -> list[DryPlane]:
    """Return the planes among points (n, 3), the largest first.

    Parameters
    ----------
    points_m : (n, 3) array
        The points, z up.
    boat_m : (3,) array
        Where the boat was in the mean.
    mapper : Mapper, optional
        Spreads the planes on the memory of this process.
    """
    voxels, row = voxels_with_rows(points_m, VOXEL_M)
    regions = grown_regions(voxels, GROWTH)
    number = np.full(len(voxels), -1)
    for k, rows in enumerate(regions):
        number[rows] = k
    of_point = number[row]
    order = np.argsort(of_point, kind="stable")
    ends = np.searchsorted(of_point[order], np.arange(len(regions) + 1))
    of_regions = [order[ends[k] : ends[k + 1]] for k in range(len(regions))]
    plane_of = partial(_plane, points_m, boat_m=boat_m)
    found = list(mapper(plane_of, of_regions, (plane_of_voxels(voxels, rows) for rows in regions)))
    level_m = _lowest_ends(found)
    known_m = -np.inf if level_m is None else level_m
    found = with_stacks_joined(found, of_regions, order[: ends[0]], points_m, known_m, plane_of)
    return _dense_enough(sorted(found, key=lambda plane: -plane.flat.width_m * plane.flat.height_m))


def _dense_enough(planes: Sequence[DryPlane]) -> list[DryPlane]:
    """Return the planes, with those refused besides that lie on a few points by chance, such as spray."""
    densest = max((plane.points / area(plane.outline_m) for plane in planes if not plane.refused), default=0.0)
    return [
        replace(plane, refused=plane.refused or f"only {plane.points} points on it")
        if plane.points < FEW_M2 * densest
        else plane
        for plane in planes
    ]


def _plane(all_m: Array, rows: Integers, grown: Plane | DryPlane, boat_m: Array) -> DryPlane:
    """Return the plane of a region, toward the boat; rows: of its points among all; grown: about the plane.

    A grown region goes round its corners: by 6 cm into the next wall, which turns the plane of 3 m by 0.4°. So the
    plane is fitted again, to the means of the cells that lie on it, until it stays. Points just above the water are not
    used, for some of them are echoes of waves and splash, beside the wall and before it; nor are cells that stand off
    more than the wall is uneven, for they see a part of a fender or of a ladder. The outline is that of points in
    the plane, whatever lies before them or behind them.
    """
    points_m, normal, distance_m = all_m[rows], grown.normal, grown.distance_m
    lowest_m, highest_m = np.quantile(points_m[:, 2], [0.01, 0.99])
    waves_m = float(lowest_m + min(WAVES_M, OF_HEIGHT * (highest_m - lowest_m)))
    dry_m = points_m[points_m[:, 2] > waves_m]
    for _ in range(REFITS):
        cells_m, outline = cells_on(dry_m, normal, distance_m, CELL_M, MARGIN_M)
        used = cells_m[inside(outline, cells_m @ plane_axes(normal).T)]
        away = np.abs(used @ normal - distance_m)
        used = used[away <= _scatter_cut_m(away)]
        if len(outline) < 3 or len(used) < FEWEST_CELLS:
            break
        mean = used.mean(axis=0)
        normal = np.linalg.svd(used - mean, full_matrices=False)[2][2]
        distance_m = float(normal @ mean)
    sense = 1.0 if normal @ boat_m > distance_m else -1.0
    normal, distance_m = sense * normal, sense * distance_m
    in_it_m = dry_m[np.abs(dry_m @ normal - distance_m) <= UNEVEN_M]  # without ledges, which spoil whole cells
    _, outline = cells_on(in_it_m, normal, distance_m, CELL_M, MARGIN_M)
    away = np.abs(all_m @ normal - distance_m)
    near = (away <= UNEVEN_M) & (all_m[:, 2] > waves_m)
    on_m, away = all_m[near], away[near]
    outline = _near_the_edge(on_m, away, normal, outline)
    away = points_m @ normal - distance_m
    on = np.abs(away) <= OFF_M
    in_plane, heights, away = points_m[on] @ plane_axes(normal).T, points_m[on, 2], away[on]
    heights_m = on_m[_between_ends(outline, on_m @ plane_axes(normal).T), 2]
    outline, gaps_m = _below(outline, normal, distance_m, top_m(heights_m)), dry_gaps(heights_m)
    within = inside(outline, in_plane)
    judged = within & ~in_gaps(heights, gaps_m)
    flat = flatness(in_plane[judged], away[judged], CELL_M)
    cells_m, _ = cells_on(points_m, normal, distance_m, CELL_M, MARGIN_M)
    if len(cells_m):  # the extent is that of all cells
        width, height = (np.ptp(cells_m @ plane_axes(normal).T, axis=0) + CELL_M).tolist()
        flat = replace(flat, width_m=width, height_m=height)
    made = DryPlane(
        normal=normal,
        distance_m=distance_m,
        rms_m=float(np.sqrt(np.mean(away[within] ** 2))) if within.any() else 0.0,
        points=int(within.sum()),
        flat=flat,
        outline_m=outline,
        lowest_m=float(np.quantile(heights, 0.01)) if len(heights) else np.inf,
        column_ends_m=_column_ends(in_plane[:, 0], heights),
        sample_m=np.column_stack([in_plane[:, 0], heights, away])[:: max(1, len(heights) // SAMPLE)],
        gaps_m=gaps_m,
    )
    return replace(made, refused=_refusal(made))


def _scatter_cut_m(away_m: Array) -> float:
    """Return :data:`CUT` robust sigmas of distances (n,) >= 0 from a plane."""
    return CUT * max(NORMAL * float(np.median(away_m)) if len(away_m) else 0.0, SMOOTH_M)


def _near_the_edge(on_m: Array, away_m: Array, normal: Array, coarse: Array) -> Array:
    """Return the outline (k, 2) of the points (n, 3) on a plane by small cells; the coarse one if they are too few.

    Means of the outermost cells lie up to half a cell inside the edge, and voxels at a corner belong to neither wall:
    together a fifth of a narrow wall's points. So the outline is that of the outermost cells' points themselves. Points
    of the next wall lie near the plane, too, as far beyond the edge as they may be off the plane. So they may be off by
    three sigmas of the wall's own points: an end that stands off by more is left out. (By 3 cm, the pans of sheet
    piling came out 4 to 6 cm too wide, and the scatter of their edges passed for noise of the INS.)
    """
    in_plane = on_m @ plane_axes(normal).T
    some = slice(None, None, len(on_m) // SAMPLE | 1)  # an odd step: scanners' lines alternate
    within = inside(coarse, in_plane[some])
    if len(coarse) < 3 or not within.any():
        return coarse
    in_plane = in_plane[away_m <= _scatter_cut_m(away_m[some][within])]
    low, high = coarse.min(axis=0), coarse.max(axis=0)
    in_plane = in_plane[np.all((in_plane > low - BEYOND_M) & (in_plane < high + BEYOND_M), axis=1)]
    cells, inverse, count = cells_of(in_plane, EDGE_CELL_M)
    usual = float(np.quantile(count[count >= FEWEST], USUAL)) if np.any(count >= FEWEST) else 0.0
    full = count >= max(FEWEST, EMPTY * usual)  # beside a wall's end, points of the next one lie in its plane
    middles_m = np.asarray((cells + 0.5) * EDGE_CELL_M, dtype=np.float64)
    if full.sum() * EDGE_CELL_M**2 < COVERED * area(coarse):
        return coarse
    outermost = full & ~inside(shrunk(convex_hull(middles_m[full]), EDGE_CELL_M), middles_m)
    return simplified(shrunk(convex_hull(in_plane[outermost[inverse]]), EDGE_MARGIN_M), CORNERS)


def _between_ends(outline_m: Array, in_plane_m: Array) -> NDArray[np.bool_]:
    """Return which points (n, 2) lie in an outline, apart from its ends, where points of the next walls lie as well."""
    within = inside(outline_m, in_plane_m)
    if len(outline_m) and np.ptp(outline_m[:, 0]) > 3 * MARGIN_M:
        low, high = outline_m[:, 0].min() + MARGIN_M, outline_m[:, 0].max() - MARGIN_M
        within &= (in_plane_m[:, 0] > low) & (in_plane_m[:, 0] < high)
    return within


def _below(outline_m: Array, normal: Array, distance_m: float, high_m: float) -> Array:
    """Return the part (k, 2) of an outline that lies below a height; the whole of a level plane's."""
    _, up = plane_axes(normal)
    if not np.isfinite(high_m) or up[2] < np.sin(np.radians(LEVEL_DEG)):
        return outline_m
    lower = clipped(outline_m, np.array([0.0, -1.0]), -(high_m - distance_m * normal[2]) / up[2])
    return lower if len(lower) else outline_m


def _column_ends(along_m: Array, heights_m: Array) -> Array:
    """Return the height (c,) of the lowest points of each column of a cell's width that has points enough."""
    column = np.floor(along_m / CELL_M).astype(np.int64)
    counts = np.bincount(column - column.min(initial=0))
    order = np.argsort(column, kind="stable")
    columns = np.split(heights_m[order], np.cumsum(counts)[:-1])
    return np.array([_end(one) for one in columns if len(one) >= FULL])


def _end(heights_m: Array) -> float:
    """Return the height at which a column's points end, but for a few below it, such as images in the water.

    Of all points a fiftieth lies below: on a wall of 4 m that is 8 cm. So those within half a metre are asked again.
    """
    about_m = np.partition(heights_m, len(heights_m) // 50)[len(heights_m) // 50]
    foot_m = heights_m[np.abs(heights_m - about_m) <= FOOT_M]
    return float(np.partition(foot_m, len(foot_m) // 25)[len(foot_m) // 25])


def _refusal(plane: DryPlane) -> str:
    """Return why a plane cannot serve, without regard to the water; "" if it can."""
    flat = plane.flat
    if plane.level:
        return "level"
    if min(flat.width_m, flat.height_m) < LEAST_M or len(plane.outline_m) < 3:
        return f"smaller than {LEAST_M:g} m"
    rise_m = float(np.ptp(plane.corners_m(plane.outline_m)[:, 2]))
    if rise_m < RISE_M:
        return f"rises by {rise_m:.1f} m alone"
    if flat.uneven_m > UNEVEN_M:
        return f"uneven, {1000 * flat.uneven_m:.0f} mm"
    if flat.bow_m > BOW_M:
        return f"bent by {1000 * flat.bow_m:.0f} mm"
    if flat.covered < COVERED * (1 - float(np.diff(plane.gaps_m, axis=1).sum()) / rise_m):
        return f"only {100 * flat.covered:.0f} % of it seen"
    return ""


def water_level_m(planes: Sequence[DryPlane]) -> float:
    """Return the height at which the planes' points end; an error if too few of their columns end at one height."""
    level_m = _lowest_ends(planes)
    if level_m is None:
        raise RawDataError(
            "laser: no wall or slope whose points end at one height, the water's; pass nearer to a wall, so that the "
            "laser sees it down to the water"
        )
    return level_m


def _lowest_ends(planes: Sequence[DryPlane]) -> float | None:
    """Return the middle of the densest ends of the planes' columns; None if too few end at one height.

    Walls that end higher (on piles, behind a fender) end at other heights, and are fewer.
    """
    ends = np.sort(np.concatenate([plane.column_ends_m for plane in planes if not plane.refused] or [np.empty(0)]))
    within = np.searchsorted(ends, ends + COLUMN_SPREAD_M, "right") - np.arange(len(ends))
    if not len(ends) or within.max() < FEWEST_COLUMNS:
        return None
    first = int(np.argmax(within))
    return float(np.median(ends[first : first + within[first]]))


def reaching_water(planes: Sequence[DryPlane], level_m: float) -> list[DryPlane]:
    """Return the planes, with those refused besides that end above the water, or lie below it."""
    found = []
    for plane in planes:
        above = plane.lowest_m - level_m
        if not plane.refused and above > NEAR_WATER_M and not _ends_with_a_gap(plane, level_m):
            plane = replace(plane, refused=f"ends {above:.1f} m above the water")
        elif not plane.refused and plane.corners_m(plane.outline_m)[:, 2].max() < level_m + WAVES_M:
            plane = replace(plane, refused="lies below the water: a mirror image")
        found.append(plane)
    return found


def _ends_with_a_gap(plane: DryPlane, level_m: float) -> bool:
    """Return whether gaps of a wall repeat, and the next one reaches from its lowest points to the water."""
    above = plane.lowest_m - level_m
    next_ones = gaps_below(plane.gaps_m - level_m, above, -above)
    return len(next_ones) > 0 and bool(next_ones[-1, 0] <= COLUMN_SPREAD_M)
