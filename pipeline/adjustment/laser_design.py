"""The laser's own fine calibration: what the target's design tells, and which of the six these passes can give."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.from_tables import target_frame
from pipeline.config.pool import LaserFit, Verdict
from pipeline.config.session import Laser
from pipeline.maths.adjustment.design_constraints import Design
from pipeline.maths.adjustment.parameters import SIX
from pipeline.maths.adjustment.solution import solve
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.maths.target.model import TargetModel

Array = NDArray[np.float64]
VAGUE = 10.0  # rad or m: what is known of an unknown before any point, where nothing is


def design_of(model: TargetModel, target_pose: pd.DataFrame, settings: LaserFit) -> Design:
    """The target by design in the frame in which it was found; where it was surveyed to stand, there."""
    planes = {}
    for family in model.families:
        corners = [model.faces[k].vertices_m - model.faces[k].offset_m * family.normal for k in family.faces]
        planes[family.name] = family.normal, np.concatenate(corners).mean(axis=0)
    pose = target_pose.iloc[0]
    turned = np.radians(float(pose["azimuth_correction_deg"]))
    place = settings.origin_sigma_m
    heading, plumb = settings.azimuth_sigma_deg, np.radians(settings.plumb_sigma_deg)
    heading_rad = np.inf if heading is None else np.radians(heading)
    sigma = [np.inf if place is None else place] * 3 + [plumb, plumb, heading_rad]
    return Design(
        planes,
        float(np.radians(settings.face_sigma_deg)),
        settings.face_sigma_m,
        np.r_[target_frame(target_pose).shift_m, 0.0, 0.0, turned],
        np.array(sigma),
    )


def coarse_covariance(laser: Laser, settings: LaserFit) -> Array:
    """How sure the coarse mount is, (6, 6) in rad and m: as surveyed, else as the pool's config has it.

    Of a mount that a fine calibration has written only what that held is as surveyed: the rest is to be found anew.
    """
    sigma = np.repeat([np.radians(settings.coarse_sigma_deg), settings.coarse_sigma_m], 3)
    found = np.diag(sigma**2)
    if laser.mount_covariance is None:
        return found
    given, origin = np.array(laser.mount_covariance), laser.mount_origin
    if origin is None or origin.method == "coarse":
        return given
    kept = [place for name, place, *_ in PARAMETERS if name in origin.held]
    found[np.ix_(kept, kept)] = given[np.ix_(kept, kept)]
    return found


def bounds_of(coarse: Array, settings: LaserFit, limits: Verdict) -> Array:
    """Sigmas (6,) that the six must come out with to be found: within the verdict's limits, and surer than they were;
    ``coarse`` (6, 6)."""
    wanted = np.repeat([np.radians(limits.max_sigma_deg), limits.max_sigma_m], 3)
    return np.asarray(np.minimum(wanted, settings.hold_share * np.sqrt(np.diag(coarse))))


def held_of(normal: Array, free: Sequence[int], bounds: Array) -> dict[int, float]:
    """Which of the six to hold: those whose sigma would be above its bound (6,), the worst first, until the others'
    are not; with that sigma.

    What is held is no longer in the others' way: two that only together cannot be told apart are one too many.
    """
    held: dict[int, float] = {}
    while len(held) < SIX:
        left = [number for number in free if number not in held]
        prior = np.zeros(len(normal))
        prior[left] = VAGUE**-2
        found = solve(normal + np.diag(prior), np.zeros(len(normal)), left)
        six = [k for k in range(SIX) if k not in held]
        sigma = np.sqrt(np.diag(found.covariance))[: len(six)]
        worst = int(np.argmax(sigma / bounds[six]))
        if sigma[worst] <= bounds[six[worst]]:
            break
        held[six[worst]] = float(sigma[worst])
    return held
