"""Labels of points: the face on which each lies, or the reason why it lies on none.

The conditions are those of :func:`pipeline.maths.target.labelling.label_points`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import CUBE, FLAGS, FLOAT, LINE, MATRIX, Block, compiled, named
from pipeline.maths.kernels.faces import FACES, FaceTables, clearance, inside, nearest_plane, product

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
LABELLED, OFF_SURFACE, NEAR_EDGE, GRAZING, NOT_AMONG = 0, 1, 2, 3, 4  # reasons
MOST_SLANTED = 0.01  # smallest cosine of incidence by which the length of a round beam's spot is computed
TINY = float(np.finfo(np.float64).tiny)


class Beams(NamedTuple):
    """Rays: direction (3, n), range_m (n,); half (2, 3, m), half widths across and along for one metre of range.

    m is n, or 0 for round beams; near_m (2,) and stray: as of :class:`pipeline.maths.target.beams.TargetBeams`.
    """

    direction: Array
    range_m: Array
    half: Array
    near_m: Array
    stray: float


class Limits(NamedTuple):
    """The limits of :class:`pipeline.maths.target.labelling.LabelSettings`; sine of the smallest grazing angle."""

    gate_m: float
    margin_m: float
    sine: float
    lowest_m: float
    highest_m: float
    spot_m: float
    corner_factor: float
    ramp_m: float


class Labels(NamedTuple):
    """What is written: face (n,), cosine (n,), edge_weight (n,), reason (n,)."""

    face: NDArray[np.int16]
    cosine: Array
    edge_weight: Array
    reason: NDArray[np.int8]


class LabelScratch(NamedTuple):
    """Scratch memory: met (3,), foot (3,), spread (3, 3)."""

    met: Array
    foot: Array
    spread: Array


BEAMS = named(Beams, MATRIX, LINE, CUBE, LINE, FLOAT)
LIMITS = named(Limits, *[FLOAT] * 8)
LABELS = named(Labels, Block("int16", 1), LINE, LINE, Block("int8", 1))
SCRATCH = named(LabelScratch, LINE, LINE, MATRIX)


@compiled()
def _spread(i: int, beams: Beams, normal: Array, reached_m: float, spread: Array) -> None:
    """Write the half axes of a beam's footprint on a plane, and the vector by which it may stray, as rows."""
    d = beams.direction
    slant = normal[0] * d[0, i] + normal[1] * d[1, i] + normal[2] * d[2, i]
    for row in range(3):
        half = beams.half[row % 2]
        times = beams.stray * reached_m if row == 2 else max(reached_m, beams.near_m[row])
        along = times * (normal[0] * half[0, i] + normal[1] * half[1, i] + normal[2] * half[2, i]) / slant
        for k in range(3):
            spread[row, k] = times * half[k, i] - along * d[k, i]


@compiled()
def _spare(
    i: int, number: int, met: Array, foot: Array, reached_m: float, cosine: float, beams: Beams, faces: FaceTables,
    limits: Limits, spread: Array,
) -> float:  # fmt: skip
    """Return by how much a point lies within the limits of a face that its ray meets; 0 or less: not within them."""
    if not inside(faces, number, foot, limits.margin_m / 2) >= 0.0:
        return -1.0
    half = 0.0
    if beams.half.shape[2]:
        _spread(i, beams, faces.normal[number], reached_m, spread)
        spare = clearance(faces, number, met, spread, limits.margin_m, limits.corner_factor)
        half = limits.corner_factor * (abs(spread[0, 2]) + abs(spread[1, 2]))
    else:
        margin = max(limits.margin_m, limits.spot_m / max(cosine, MOST_SLANTED))
        spare = inside(faces, number, met, margin) - margin
    return min(spare, min(limits.highest_m - met[2], met[2] - limits.lowest_m) - half)


@compiled()
def _meet(
    i: int, points_m: Array, axis: Array, distance_m: float, beams: Beams, sine: float, met: Array, foot: Array
) -> float:  # fmt: skip
    """Write the place where a point's ray meets a plane, and the point's foot on it; return the range to the plane.

    For a ray that meets the plane at less than the angle of ``sine`` the foot is taken instead.
    """
    d = beams.direction
    slant = axis[0] * d[0, i] + axis[1] * d[1, i] + axis[2] * d[2, i]
    steep = abs(slant) >= max(sine, TINY)
    beyond = distance_m / slant if steep else 0.0
    for k in range(3):
        foot[k] = points_m[k, i] - distance_m * axis[k]
        met[k] = points_m[k, i] - beyond * d[k, i] if steep else foot[k]
    return beams.range_m[i] - beyond


@compiled((MATRIX, FLAGS, BEAMS, FACES, LIMITS, LABELS, SCRATCH))
def label(
    points_m: Array, among: Flags, beams: Beams, faces: FaceTables, limits: Limits, labels: Labels,
    scratch: LabelScratch,
) -> None:  # fmt: skip
    """Write the labels of points (3, n) in the target frame; ``among`` (n,): whether a point may have a label."""
    met, foot, spread = scratch
    d = beams.direction
    for i in range(points_m.shape[1]):
        labels.face[i], labels.cosine[i], labels.edge_weight[i] = -1, 0.0, 0.0
        if not among[i]:
            labels.reason[i] = NOT_AMONG
            continue
        nearest, seen, flat = np.inf, False, False
        for axis in range(len(faces.axis)):
            along = product(faces.axis, axis, points_m[0, i], points_m[1, i], points_m[2, i])
            plane = nearest_plane(faces, axis, along)
            distance = along - faces.offset_m[plane]
            if not abs(distance) <= limits.gate_m:
                continue
            reached = _meet(i, points_m, faces.axis[axis], distance, beams, limits.sine, met, foot)
            for k in range(faces.first_of_plane[plane], faces.first_of_plane[plane + 1]):
                number = faces.face_of_plane[k]
                within = met[2] >= faces.height_m[number, 0] and met[2] <= faces.height_m[number, 1]
                if not (within and met[2] > limits.lowest_m and met[2] < limits.highest_m):
                    continue
                if not inside(faces, number, met, 0.0) >= 0.0:
                    continue
                seen = True
                cosine = -product(faces.normal, number, d[0, i], d[1, i], d[2, i])
                if not cosine >= limits.sine:
                    flat = True
                    continue
                spare = _spare(i, number, met, foot, reached, cosine, beams, faces, limits, spread)
                if spare > 0.0 and abs(distance) < nearest:
                    nearest = abs(distance)
                    labels.face[i], labels.cosine[i] = number, cosine
                    labels.edge_weight[i] = min(1.0, spare / limits.ramp_m) if limits.ramp_m > 0.0 else 1.0
        if nearest < np.inf:
            labels.reason[i] = LABELLED
        elif flat:
            labels.reason[i] = GRAZING
        else:
            labels.reason[i] = NEAR_EDGE if seen else OFF_SURFACE


@compiled((MATRIX, MATRIX, MATRIX, LINE))
def rays(origins_m: Array, points_m: Array, direction: Array, range_m: Array) -> None:
    """Write the unit vectors (3, n) from origins to points (3, n), and the distances (n,)."""
    for i in range(len(range_m)):
        x, y, z = points_m[0, i] - origins_m[0, i], points_m[1, i] - origins_m[1, i], points_m[2, i] - origins_m[2, i]
        range_m[i] = np.sqrt(x * x + y * y + z * z)
        direction[0, i], direction[1, i], direction[2, i] = x / range_m[i], y / range_m[i], z / range_m[i]


@compiled((MATRIX, FLOAT, FACES, FLAGS))
def near_planes(points_m: Array, reach_m: float, faces: FaceTables, near: Flags) -> None:
    """Take away from ``near`` (n,) the points (3, n) that lie within ``reach_m`` of no plane."""
    for i in range(points_m.shape[1]):
        if not near[i]:
            continue
        near[i] = False
        for axis in range(len(faces.axis)):
            along = product(faces.axis, axis, points_m[0, i], points_m[1, i], points_m[2, i])
            if abs(along - faces.offset_m[nearest_plane(faces, axis, along)]) <= reach_m:
                near[i] = True
