"""Labelling: a point lies on a face if its whole footprint lies within the face's polygon, with a margin.

No position is exact: under drift two labellings of one session differ by 5 mm along the wall. With sharp limits the
points of such a strip count fully or not at all, which moves the result by 0.15 of its sigma. So a point has a weight
that rises from 0 at the limits to 1 at the width W of a *ramp* within them. A shift by s then changes the weights of
the points on the ramp by s / W. The sum of the squared changes, and with it the variance of the result's change, is
s / W times that of sharp limits.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels import labels as kernel
from pipeline.maths.kernels.compiled import block
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.masks import clear_of_masks
from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

NO_FACE = -1
RAMP_STEPS = 6  # of the ramp beside what hides a footprint


@dataclass(frozen=True)
class LabelSettings:
    """Limits within which a point is labelled with a face.

    Parameters
    ----------
    gate_m
        Largest distance from the plane of the face.
    margin_m
        Smallest distance from the edges of the face.
    min_grazing_rad
        Smallest angle between the ray and the face.
    lowest_m, highest_m
        Heights in the target frame between which points count, with their whole footprints.
    spot_m
        Half the diameter of beams without half widths of their own, which are round and equally wide at all ranges.
    corner_factor
        How many half widths a beam's axis must be off what is much louder than a face: an inner corner, or the image of
        the target in the water's surface, beyond the heights.
    ramp_m
        Width of the ramp: so far within the limits a point has its full weight. 0: full weight everywhere.
    seen
        Faces to use: "dry" (those that the laser uses), "wet" (those that the sonar uses), or "both" (all).
    """

    gate_m: float
    margin_m: float
    min_grazing_rad: float
    lowest_m: float = -np.inf
    highest_m: float = np.inf
    spot_m: float = 0.0
    corner_factor: float = 1.0
    ramp_m: float = 0.0
    seen: str = "both"


@dataclass(frozen=True)
class Labels:
    """Face number (n,) of each point or -1, the cosine of its incidence, its weight by the ramp, and masks (n,).

    The masks are of the points without a face. off_surface: the ray meets no face's polygon within the gate and the
    heights; grazing: it meets one too flat, or from behind; near_edge: it meets one, and the footprint with its margin
    does not lie within the polygon; masked: a part of the footprint, with its margin, lies in a mask of the face.
    """

    face: NDArray[np.int16]
    cos_incidence: Array
    edge_weight: Array
    off_surface: Flags
    near_edge: Flags
    grazing: Flags
    masked: Flags


class BeamsOnFaces(Protocol):
    """Beams with the number (n,) of the face of each."""

    @property
    def faces(self) -> NDArray[np.int16]:
        """Face number (n,) of each beam."""
        ...

    def faces_at_corners(self, rows: Integers, beyond_m: float) -> Iterable[Integers]:
        """Yield the numbers of the faces that rays along one corner of these beams meet first, corner by corner.

        The number is -1 where a ray meets none. ``beyond_m``: the corners are so much farther apart on each side.
        """
        ...


def weight_beside_shadows(model: TargetModel, beams: BeamsOnFaces, ramp_m: float) -> Array:
    """Return the weights (n,) of beams, 0 if a part of the footprint is hidden, 1 if it is clear by the ramp.

    An edge in front hides part of the footprint, or another face stands out of it. Then a ray along a corner of the
    beam does not meet the plane of the beam's face first, and the echo is the mean of two surfaces. Footprints that are
    a little larger show how near that is: with S steps of the ramp the weight is k / (S + 1), where k is the first that
    is hidden in part, from 0.

    Parameters
    ----------
    model
        The target.
    beams
        Beams with a face each.
    ramp_m
        Width of the ramp, on the face; 0: the weights are 0 and 1.
    """
    planes = {plane: k for k, plane in enumerate(dict.fromkeys((face.family, face.offset_m) for face in model.faces))}
    plane = np.array([planes[face.family, face.offset_m] for face in model.faces] + [-1])

    def hidden(rows: Integers, beyond_m: float) -> Flags:
        mask = np.zeros(len(rows), dtype=bool)
        for met in beams.faces_at_corners(rows, beyond_m):
            mask |= plane[met] != plane[beams.faces[rows]]
        return mask

    weight, rows = np.ones(len(beams.faces)), np.arange(len(beams.faces))
    rows = rows[hidden(rows, ramp_m)]
    for k in range(RAMP_STEPS):
        ends = hidden(rows, ramp_m * k / RAMP_STEPS)
        weight[rows[ends]] = k / (RAMP_STEPS + 1)
        rows = rows[~ends]
    weight[rows] = RAMP_STEPS / (RAMP_STEPS + 1)
    return weight


def label_points(
    model: TargetModel,
    points_m: Array,
    beams: TargetBeams,
    settings: LabelSettings,
    among: Flags | None = None,
) -> Labels:
    """Label points by the faces of the target.

    A point belongs to a face if it lies within the gate of the face's plane, and its ray meets the front of the face at
    the smallest grazing angle or more, and its whole footprint lies within the polygon and between the heights. The
    footprint is taken at the point in which the ray meets the plane. From the polygon's edges it keeps the margin, or
    the beam's stray if that is larger. From edges that may be inner corners the beam's axis also keeps some half
    widths: a side lobe may hear them. If several faces qualify, the one with the nearest plane is taken.

    The point in which the ray meets the plane does not depend on the measured range; nor does the footprint there. With
    the measured point instead, a range too long would move it into a grazed face at one edge and out at the other. The
    remaining points would tilt the face: cov(distance from the plane, place) = σ² sin i cos i. (Along the water line
    alone that was a fifth of the sigma of roll.) The measured point must still lie within the polygon by half the
    margin, which noise does not exceed: a strong echo of a corner lies at the corner, wherever its beam points.

    Parameters
    ----------
    model
        The target.
    points_m
        Points (n, 3) m, target frame.
    beams
        Rays of the points.
    settings
        Limits for the labels.
    among
        Mask (n,) of the points that may have a label; None: all. The others have no reason.
    """
    sine = float(np.sin(settings.min_grazing_rad)) if beams.directions.any() else 0.0
    limits = kernel.Limits(
        gate_m=settings.gate_m,
        margin_m=settings.margin_m,
        sine=sine,
        lowest_m=settings.lowest_m,
        highest_m=settings.highest_m,
        spot_m=settings.spot_m,
        corner_factor=settings.corner_factor,
        ramp_m=settings.ramp_m,
    )
    n = len(points_m)
    labels = kernel.Labels(np.empty(n, np.int16), np.empty(n), np.empty(n), np.empty(n, np.int8))
    every = np.ones(n, dtype=bool) if among is None else np.require(among, bool, ("C", "W"))
    scratch = kernel.LabelScratch(np.empty(3), np.empty(3), np.empty((3, 3)))
    kernel.label(block(points_m.T), every, _beam_arrays(beams), model.tables(settings.seen), limits, labels, scratch)
    clear = _clear_of_masks(model, labels.face, points_m, beams, settings)
    return Labels(
        face=np.where(clear > 0, labels.face, np.int16(NO_FACE)),
        cos_incidence=labels.cosine,
        edge_weight=np.minimum(labels.edge_weight, clear),
        off_surface=labels.reason == kernel.OFF_SURFACE,
        near_edge=labels.reason == kernel.NEAR_EDGE,
        grazing=labels.reason == kernel.GRAZING,
        masked=clear <= 0,
    )


def _clear_of_masks(
    model: TargetModel, face_of_point: NDArray[np.int16], points_m: Array, beams: TargetBeams, settings: LabelSettings
) -> Array:
    """Return the weights (n,) of points by the ramp beside the masks of their faces, 0 in a mask."""
    weight = np.ones(len(points_m))
    for number, face in enumerate(model.faces):
        if face.masks_m:
            rows = np.flatnonzero(face_of_point == number)
            spare_m = clear_of_masks(face, rows, points_m, beams, settings.margin_m, settings.spot_m)
            weight[rows] = np.clip(spare_m / settings.ramp_m if settings.ramp_m else spare_m > 0, 0.0, 1.0)
    return weight


def near_planes(model: TargetModel, points_m: Array, reach_m: float, among: Flags, seen: str) -> Flags:
    """Return which of the points among (n,) lie within ``reach_m`` of the plane of a face; parameters as above."""
    near = np.array(among, dtype=bool)
    kernel.near_planes(block(points_m.T), reach_m, model.tables(seen), near)
    return near


def _beam_arrays(beams: TargetBeams) -> kernel.Beams:
    halves = [half.T for half in beams.half_widths]
    half = np.zeros((2, 3, len(beams.ranges_m) if halves else 0))
    half[: len(halves)] = halves if halves else half[:0]
    near_m = np.array(beams.near_m, dtype=np.float64)
    return kernel.Beams(block(beams.directions.T), block(beams.ranges_m), half, near_m, float(beams.stray))
