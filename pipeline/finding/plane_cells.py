"""Cells of a plane that see one surface, which lies in the plane."""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.surfaces.flatness import cells_of, of_one_surface, plane_axes
from pipeline.maths.surfaces.outline import convex_hull, shrunk, simplified

Array = NDArray[np.float64]
CELL_M = 0.25  # side of a cell
OFF_M = 0.15  # points farther off belong to something in front of the plane, or behind it
UNEVEN_M = 0.03  # largest distance of a cell's mean from the plane
FEWEST, CORNERS = 4, 8  # points of a cell; most corners of an outline


def cells_on(
    points_m: Array, normal: Array, distance_m: float, cell_m: float, margin_m: float
) -> tuple[Array, Array]:
    """Return the means (c, 3) of the points in each cell of a plane that lie on it, and their outline (k, 2).

    Single points far out make no cell.
    """
    away, axes = points_m @ normal - distance_m, plane_axes(normal)
    near = np.abs(away) <= OFF_M
    points, away = points_m[near], away[near]
    _, inverse, count = cells_of(points @ axes.T, cell_m)
    sums = np.array([np.bincount(inverse, weights=axis, minlength=len(count)) for axis in (*points.T, away, away**2)])
    full = count >= FEWEST
    of_cells = (sums[:, full] / count[full]).T
    means, off, squares = of_cells[:, :3], of_cells[:, 3], of_cells[:, 4]
    means = means[(np.abs(off) <= UNEVEN_M) & of_one_surface(off, squares)]
    return means, simplified(shrunk(convex_hull(means @ axes.T), margin_m), CORNERS)
