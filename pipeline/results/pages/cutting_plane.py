"""Vertical planes that cut the target, for sections through it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.residual_tables import FEWEST

Array = NDArray[np.float64]
HALF_SLICE_M = 0.04  # half the thickness of a section


@dataclass(frozen=True)
class CuttingPlane:
    """A vertical plane on which a coordinate (``axis`` 0: x, 1: y) has the value ``at``, in metres."""

    axis: int
    at: float

    @property
    def along(self) -> int:
        """The index of the horizontal coordinate along the plane (0: x, 1: y)."""
        return 1 - self.axis

    def __str__(self) -> str:
        return f"{'xy'[self.axis]} = {round(self.at, 2) + 0.0:.2f} m"


def plane_through(corners: Sequence[Array], visible: NDArray[np.bool_]) -> CuttingPlane | None:
    """Return the vertical plane, x or y constant, that cuts most of the chosen faces; None if it would cut none.

    Planes midway between neighbouring coordinates of corners are tried. The best cuts the patent's target at half the
    depth of its blocks. Of other targets :func:`plane_by_points` shows more.

    Parameters
    ----------
    corners
        Corners (n, 3) m of each face, target frame.
    visible
        Mask of the chosen faces, one value for each face.
    """
    best: tuple[int, CuttingPlane] | None = None
    for axis in (0, 1):
        for at in _midway(corners, axis):
            plane = CuttingPlane(axis, at)
            number = sum(
                bool(cut_line(points, plane)) for points, has_points in zip(corners, visible, strict=True) if has_points
            )
            if number and (best is None or number > best[0]):
                best = number, plane
    return None if best is None else best[1]


def plane_by_points(
    corners: Sequence[Array], normals: Array, points_m: Mapping[str, Array], on_face: Mapping[str, Array]
) -> CuttingPlane | None:
    """Return the vertical plane that shows best whether walls and slopes go on below the water; None if none does.

    Near the best plane both sensors have most points on the same faces, of those that it cuts at a good angle. For each
    face the fewer of the two sensors' points count, then all points: in full on a wall that the plane cuts at right
    angles, a quarter on one at 45° to it or on a slope of 45°, not at all on a level face. Planes midway between
    neighbouring coordinates of corners are tried, then, if too few points lie there, those through the middle of each
    face's points.

    Parameters
    ----------
    corners
        Corners (n, 3) m of each face, target frame.
    normals
        Their normals (n, 3).
    points_m
        Points (k, 3) of each sensor that has any, target frame; the calibrated sensor is the last.
    on_face
        The number of the face of each of them (k,).
    """
    calibrated, face = list(points_m.values())[-1], list(on_face.values())[-1]
    middles = [np.median(calibrated[face == number], axis=0) for number in np.unique(face)]
    for tried in ([_midway(corners, axis) for axis in (0, 1)], [[at[axis] for at in middles] for axis in (0, 1)]):
        best: tuple[tuple[float, float], CuttingPlane] | None = None
        for axis in (0, 1):
            weight = normals[:, 1 - axis] ** 4
            for at in map(float, tried[axis]):
                plane = CuttingPlane(axis, at)
                cut = np.array([bool(cut_line(points, plane)) for points in corners])
                numbers = np.array([_near(points_m[name], on_face[name], plane, cut) for name in points_m])
                score = float(numbers.min(axis=0) @ weight), float((numbers @ weight).sum())
                if numbers[-1].sum() >= FEWEST and (best is None or score > best[0]):
                    best = score, plane
        if best is not None:
            return best[1]
    return None


def _near(points_m: Array, on_face: Array, plane: CuttingPlane, cut: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the number of points near the plane by face, (n,), 0 for faces that it does not cut."""
    near = np.abs(points_m[:, plane.axis] - plane.at) < HALF_SLICE_M
    return np.asarray(np.where(cut, np.bincount(on_face[near], minlength=len(cut)), 0))


def _midway(corners: Sequence[Array], axis: int) -> list[float]:
    """Return the values midway between neighbouring coordinates (0: x, 1: y) of the corners."""
    ends = np.unique(np.concatenate([points[:, axis] for points in corners]))
    return [float(at) for at in (ends[1:] + ends[:-1]) / 2]


def slopes_in(faces: pd.DataFrame, plane: CuttingPlane) -> Array:
    """Return the slope of each face, (n,): the change of the coordinate along the plane by the coordinate across it.

    With this slope points near the plane are moved along their face into the plane. It is ±1 for a face at 45° to the
    plane, and set to 0 for horizontal faces and for faces nearly parallel to the plane.
    """
    across, along = (faces[f"normal_{'xy'[axis]}_target_1"].to_numpy() for axis in (plane.axis, plane.along))
    aslant = np.abs(along) > 0.1
    return np.asarray(np.where(aslant, -across / np.where(aslant, along, 1.0), 0.0))


def cut_line(corners: Array, plane: CuttingPlane) -> list[Array]:
    """Return a list with the line (2, 3) in which the plane cuts a face; an empty list if the plane does not cut it."""
    closed = np.vstack([corners, corners[:1]])
    ends = []
    for first, second in pairwise(closed):
        before, after = first[plane.axis] - plane.at, second[plane.axis] - plane.at
        if before * after < 0:
            ends.append(
                first + (second - first) * (plane.at - first[plane.axis]) / (second[plane.axis] - first[plane.axis])
            )
    return [np.array(ends)] if len(ends) == 2 else []
