"""Masks: parts of faces where no point counts, because a ladder or a fender stands before the face.

A mask is a rectangle: places along the face, to the right as the boat sees it, from the middle of the face's extent;
and heights. A point lies where its ray meets the face's plane, with its whole footprint, as for the edges of a face
(:mod:`~pipeline.maths.target.labelling`): by the measured point a mask's edge would tilt the face.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.labels import MOST_SLANTED
from pipeline.maths.surfaces.flatness import plane_axes
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.face import Face

Array = NDArray[np.float64]
MOST_LEVEL = 0.98  # |n_z| of a face that may have masks: a level one has no right and left, and one height


def along_face(face: Face, points_m: Array) -> Array:
    """Return the places (n,) m of points (n, 3) along a face."""
    right = plane_axes(face.normal)[0]
    ends = face.vertices_m @ right
    return np.asarray(points_m @ right - (ends.min() + ends.max()) / 2)


def outside_masks(face: Face, along_m: Array, heights_m: Array, half_m: tuple[Array, Array]) -> Array:
    """Return how far (n,) footprints lie outside the nearest mask of a face, below zero inside it.

    Parameters
    ----------
    face : Face
        The face, with masks.
    along_m, heights_m : (n,) array
        Places of the footprints' middles along the face, and their z.
    half_m : ((n,) array, (n,) array)
        Their half extents along the face, and in height, with margins.
    """
    spare = np.full(len(along_m), np.inf)
    for left_m, right_m, low_m, high_m in face.masks_m:
        beside = np.maximum(left_m - along_m, along_m - right_m) - half_m[0]
        beyond = np.maximum(low_m - heights_m, heights_m - high_m) - half_m[1]
        spare = np.minimum(spare, np.maximum(beside, beyond))
    return spare


def clear_of_masks(
    face: Face, rows: NDArray[np.int64], points_m: Array, beams: TargetBeams, margin_m: float, spot_m: float
) -> Array:
    """Return how far (n,) the footprints of points on a face are clear of its masks, below zero inside one.

    Parameters
    ----------
    face : Face
        The face, with masks.
    rows : (n,) array
        Numbers of the points that lie on it.
    points_m : (m, 3) array
        All points.
    beams : TargetBeams
        Their rays.
    margin_m, spot_m : float
        Margin of a footprint; half the diameter of beams without widths of their own.
    """
    right, ray = plane_axes(face.normal)[0], beams.directions[rows]
    approach = ray @ face.normal
    away = (points_m[rows] @ face.normal - face.distance_m) / np.where(approach, approach, -np.inf)
    on_plane, reached_m = points_m[rows] - away[:, None] * ray, beams.ranges_m[rows] - away
    if beams.half_widths:
        spreads, stray_m = beams.spreads(rows, face.normal, reached_m), beams.stray_on(rows, face.normal, reached_m)
        half_m = [
            sum((np.abs(spread @ axis) for spread in spreads), start=np.maximum(np.abs(stray_m @ axis), margin_m))
            for axis in (right, np.array([0.0, 0.0, 1.0]))
        ]
    else:
        half_m = 2 * [np.maximum(margin_m, spot_m / np.maximum(np.abs(approach), MOST_SLANTED) * (approach != 0))]
    return outside_masks(face, along_face(face, on_plane), on_plane[:, 2], (half_m[0], half_m[1]))
