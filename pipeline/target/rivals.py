"""Rivals of the target's pose: other heights and the mirrored target, and how far the pose found is ahead of them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.target.coverage import Found, Hypothesis, Scan
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.maths.target.placements import TargetPose
from pipeline.maths.target.registration import TargetSurface, converge
from pipeline.target.matching import planes_of_faces
from pipeline.target.surface import ClosestSurface

REACHES_M = (0.15, 0.1, 0.07, 0.05)
LOOSE = 1.0  # rad and m: a single point that determines a direction outweighs this prior 400 times


@dataclass(frozen=True)
class BestRival:
    """The rival nearest to being as good as the pose found.

    Parameters
    ----------
    name
        Which rival it is; "none" for a target that has no other pose.
    agreement_m2, rival_agreement_m2
        Agreement of the pose found, and the same less its margin over the rival; 0 for "none".
    ambiguous
        Whether the margin is too small.
    """

    name: str
    agreement_m2: float
    rival_agreement_m2: float
    ambiguous: bool


def best_rival(
    scan: Scan, frame: TargetFrame, model: TargetModel, surface: ClosestSurface, share: float
) -> BestRival:
    """Return the rival whose margin is the smallest, compared with the least that it must be.

    With a rival half a period off, the two poses differ by a strip of the wall, as wide as the wall and half a period
    high, above and below the target. The margin must be ``share`` of its area. Otherwise the laser did not see the ends
    well enough: the pose is ambiguous. The mirrored target at the same height may differ by less than that. Then the
    margin must be ``share`` of the area in which it differs; if it differs nowhere above the water, it is no rival,
    because its pose is the same.

    Parameters
    ----------
    scan
        What the laser saw and where it looked.
    frame
        The target's frame as found.
    model, surface
        The target by design, and its surface.
    share
        Least margin, as a share of the area in which the pose and a rival differ at least.
    """
    found = Found(Hypothesis(model, frame, surface), scan)
    least_m2 = share * model.width_m * model.half_period_m
    best, most_behind_m2 = BestRival("none", found.agreement_m2, 0.0, False), -np.inf
    for rival, name, higher_m in _rivals(model):
        rival_surface = ClosestSurface(rival)
        start = TargetFrame(frame.R_target_from_pool, frame.origin_pool_m + np.array([0.0, 0.0, higher_m]))
        fitted = _fitted(start, scan, TargetSurface(rival_surface, planes_of_faces(rival)))
        compared = found.over(Hypothesis(rival, fitted, rival_surface))
        needed_m2 = least_m2 if higher_m else min(least_m2, share * compared.strip_m2)
        if not higher_m and not compared.strip_m2:
            continue
        behind_m2 = needed_m2 - compared.margin_m2
        if behind_m2 > most_behind_m2:
            most_behind_m2 = behind_m2
            best = BestRival(name, found.agreement_m2, found.agreement_m2 - compared.margin_m2, behind_m2 > 0)
    return best


def _rivals(model: TargetModel) -> Iterator[tuple[TargetModel, str, float]]:
    """Yield the model of each rival, its name, and how much higher (m) it stands."""
    period_m = model.repeats_m
    if period_m is not None:
        yield model, "one period higher", period_m
        yield model, "one period lower", -period_m
    for mirrored in model.mirror_images:
        yield mirrored, "left and right exchanged", 0.0
        if period_m is not None:
            yield mirrored, "left and right exchanged, half a period higher", period_m / 2
            yield mirrored, "left and right exchanged, half a period lower", -period_m / 2


def _fitted(start: TargetFrame, scan: Scan, surface: TargetSurface) -> TargetFrame:
    """Return the frame (turned by β, moved by o) to which a rival converges from a start.

    The start is the origin of the parameters, with a loose prior: directions that the points do not determine, such as
    the height of a wall without edges, stay there. From x = Rz(β) (x_start - o) and x_start = R (x_pool - p) follow the
    rotation Rz(β) R and the origin p + Rᵀ o.
    """
    placement = TargetPose(start.points_from_pool(scan.points_m), np.full(4, LOOSE))
    turn_rad, *shift_m = converge(placement, np.zeros(4), surface, REACHES_M)
    return TargetFrame(rotation_z(turn_rad) @ start.R_target_from_pool, start.points_to_pool(np.array([shift_m]))[0])
