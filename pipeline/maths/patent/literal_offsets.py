"""The patent's offsets, word for word [0126-0128]: three differences in ENU, once, taken as the body's axes.

Numbers in brackets are paragraphs of patent CN 105425246 B. As printed: ENU has its origin at the target, x east and y
north [0099]. The differences along its X, Y and Z *are* the corrections of the lever arm [0124]. That holds only where
the target's wall runs north and the boat sails along it, so that the INS's axes agree with ENU's: the text asks for
that [0098, 0100]. Elsewhere the differences belong to other axes and the lever arm comes out wrong. With the wall at
180° its horizontal correction has the wrong sign, and the error is doubled. With the wall at 45° P1 runs along Y, and
there is no result. (The angles do not know north: full angles and the patent's cosines stay the same when both sensors'
normals turn about z.)

Readings, where the text leaves a choice. Corrections are laser minus MBES, since the laser's data are the standard
[0124]. Means are over all points of all passes. Z: the pair of the dry and the wet face with the most points (the text:
with a suitable amount of data). Y: the lines are the planes' traces on z = 0, the level of the target's centre, and the
parallel to Y goes through the centroid of the laser's points on P1. X is not applied before Y is taken: the text does
not say so, and a shift ΔX of the MBES's points appears in Y as ΔX n_x / n_y, on a 45° face in full.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import Plane
from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.patent.lifted_moments import plane_moments
from pipeline.maths.patent.literal_planes import SessionPlanes, literal_matrix
from pipeline.maths.patent.offsets import DryFace, WetFace, height_pair

Array = NDArray[np.float64]
PARALLEL = 1e-3  # rad: a trace nearer than this to the direction of Y is not cut by a parallel to Y


@dataclass(frozen=True)
class LiteralOffsets:
    """Differences (3,) m along X, Y, Z of ENU, which are the corrections in body axes; the pair of faces for Z."""

    enu_m: Array
    pair: dict[str, float | str]


def literal_offsets(
    planes: SessionPlanes,
    faces: tuple[Sequence[DryFace], Sequence[WetFace]],
    azimuth_rad: float,
    angles_rad: Array,
    lever_arm_m: Array,
) -> LiteralOffsets:
    """Compute X, Y, Z as printed, with the mount (I + Ω) · coarse.

    Parameters
    ----------
    planes
        Points of both sensors on P1 to P3.
    faces
        Horizontal faces that the laser sees, and those that the sonar sees.
    azimuth_rad
        Direction of the target's +y, clockwise from true north.
    angles_rad
        Corrections (δθ, δγ, δφ) (3,) of the angles.
    lever_arm_m
        Coarse lever arm (3,), body axes.

    Raises
    ------
    DegenerateGeometryError
        A sensor sees no horizontal face, or P1 runs along Y.
    """
    R_enu_from_target = rotation_z(-azimuth_rad)
    dry, wet = faces
    if not dry or not wet:
        raise DegenerateGeometryError(f"the {'sonar' if dry else 'laser'} sees no horizontal face well enough for Z")
    wall = planes.mbes_plane("P2", angles_rad, lever_arm_m)
    dx = (R_enu_from_target @ (planes.laser["P2"].centroid_m - wall.centroid_m))[0]
    laser_p1, slanted = planes.laser["P1"], planes.mbes_plane("P1", angles_rad, lever_arm_m)
    x_m = float((R_enu_from_target @ laser_p1.centroid_m)[0])
    dy = _cut(laser_p1, R_enu_from_target, x_m) - _cut(slanted, R_enu_from_target, x_m)
    above = max(dry, key=lambda face: face.count)
    below = max(wet, key=lambda face: face.lifted[-1, -1])
    placed = plane_moments(below.lifted, literal_matrix(angles_rad), lever_arm_m)
    pair = height_pair(above, below, placed)
    return LiteralOffsets(np.array([dx, dy, pair["dz_m"]], dtype=np.float64), pair | {"weight": 1.0})


def _cut(plane: Plane, R_enu_from_target: Array, x_m: float) -> float:
    """Return the y (m) at which the trace of the plane on z = 0 meets the parallel to Y at x = x_m, in ENU."""
    n = R_enu_from_target @ plane.normal
    if abs(n[1]) < PARALLEL * np.hypot(n[0], n[1]):
        raise DegenerateGeometryError("P1 runs along the Y axis of ENU: no parallel to Y cuts it, and Y has no result")
    return float((plane.distance_m - n[0] * x_m) / n[1])
