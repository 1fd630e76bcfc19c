"""Vertical planes that cut the target, for sections through it."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
        return f"{'xy'[self.axis]} = {self.at:.2f} m"


def plane_through(corners: Sequence[Array], visible: NDArray[np.bool_]) -> CuttingPlane | None:
    """Return the vertical plane, x or y constant, that cuts most of the chosen faces; None if it would cut none.

    Planes midway between neighbouring coordinates of corners are tried. The best cuts the patent's target at half the
    depth of its blocks, and a plain wall at right angles to its face.

    Parameters
    ----------
    corners
        Corners (n, 3) m of each face, target frame.
    visible
        Mask of the chosen faces, one value for each face.
    """
    best: tuple[int, CuttingPlane] | None = None
    for axis in (0, 1):
        ends = np.unique(np.concatenate([points[:, axis] for points in corners]))
        for at in ((ends[1:] + ends[:-1]) / 2).tolist():
            plane = CuttingPlane(axis, at)
            number = sum(
                bool(cut_line(points, plane)) for points, has_points in zip(corners, visible, strict=True) if has_points
            )
            if number and (best is None or number > best[0]):
                best = number, plane
    return None if best is None else best[1]


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
