"""The faces of a target as arrays, which compiled loops take."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.faces import FaceTables
from pipeline.maths.target.face import Face

Array = NDArray[np.float64]
ROUNDING_M = 1e-6  # rounding of the heights of points on a horizontal face


def face_tables(faces: Sequence[Face], seen: str) -> FaceTables:
    """Return the arrays of all faces, and the planes of those that are seen.

    Among parallel planes a point belongs to the nearest. So one projection and one search serve all tops and bottoms,
    instead of forty.

    Parameters
    ----------
    faces
        The faces of the target, by number.
    seen
        Faces whose planes count: "dry" (those that the laser uses), "wet" (those that the sonar uses), or "both" (all).
    """
    planes = _parallel_planes(faces, seen)
    offsets = [sorted(of_axis) for of_axis in planes.values()]
    in_planes = [of_axis[offset] for of_axis in planes.values() for offset in sorted(of_axis)]
    edges = [face.inward_edges for face in faces]
    creases = [_crease(face.normal, line) for face in faces for line in face.creases_m]
    return FaceTables(
        axis=np.array(list(planes), dtype=np.float64).reshape(-1, 3),
        first_plane=_firsts(offsets),
        offset_m=np.array([offset for ascending in offsets for offset in ascending], dtype=np.float64),
        first_of_plane=_firsts(in_planes),
        face_of_plane=np.array([number for numbers in in_planes for number in numbers], dtype=np.int64),
        normal=np.array([face.normal for face in faces]),
        height_m=np.array([_heights(face) for face in faces]),
        first_edge=_firsts([inward for inward, _ in edges]),
        inward=np.concatenate([inward for inward, _ in edges]),
        edge_offset_m=np.concatenate([offset for _, offset in edges]),
        outer=np.array([outer for face in faces for outer in face.outer_edges or [False] * len(face.vertices_m)]),
        first_crease=_firsts([face.creases_m for face in faces]),
        crease=np.array([axes for axes, _ in creases], dtype=np.float64).reshape(-1, 3, 3),
        half_m=np.array([half for _, half in creases], dtype=np.float64),
    )


def _parallel_planes(faces: Sequence[Face], seen: str) -> dict[tuple[float, ...], dict[float, list[int]]]:
    """Return the numbers of the seen faces by axis (one direction for parallel planes) and offset along it."""
    parallel: dict[tuple[float, ...], dict[float, list[int]]] = {}
    for number, face in enumerate(faces):
        if seen != "both" and face.seen not in (seen, "both"):
            continue
        sign = np.sign(face.normal[np.flatnonzero(np.abs(face.normal) > 1e-9)[0]])
        axis = tuple((sign * face.normal + 0.0).tolist())
        # Tops of one side and bottoms of the other lie at one height from different sums: rounding makes one plane.
        parallel.setdefault(axis, {}).setdefault(round(float(sign * face.distance_m), 9), []).append(number)
    return parallel


def _firsts(lists: Sequence[Sequence[object] | Array]) -> NDArray[np.int64]:
    """Return where each list begins in all of them joined, and the end."""
    return np.cumsum([0, *map(len, lists)], dtype=np.int64)


def _heights(face: Face) -> tuple[float, float]:
    z = face.vertices_m[:, 2]
    return float(z.min()) - ROUNDING_M, float(z.max()) + ROUNDING_M


def _crease(normal: Array, line: Array) -> tuple[Array, float]:
    """Return the unit vectors across and along a crease (2, 3), and its middle, as rows; and half of its length."""
    start, end = line
    half = float(np.linalg.norm(end - start)) / 2
    along = (end - start) / (2 * half)
    return np.array([np.cross(normal, along), along, (start + end) / 2]), half
