"""Search for the pose of the target in the laser's points."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.target.coverage import Scan
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.maths.target.placements import TargetPose, TiltedTarget
from pipeline.maths.target.registration import (
    SearchCriteria,
    SearchResult,
    TargetSurface,
    refine,
    search,
    surface_score,
)
from pipeline.target.matching import SCORE_REACH_M, dry_labeller, gate_of, planes_of_faces
from pipeline.target.rivals import best_rival
from pipeline.target.samples import LaserSample
from pipeline.target.search_results import LocatedTarget
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
LEAST_M = 0.02  # errors that points share: in what moves them by less over the whole search they tell nothing
TILT_SIGMAS = (0.1, 0.1, 0.1, 1.0, 1.0, 1.0)  # rad and m: so large that only the points count


def search_target_pose(
    dry: LaserSample, scan: Scan, model: TargetModel, settings: Segment, azimuth_known: bool
) -> LocatedTarget:
    """Return the pose of the target in dry laser points, and how well its best rival fits.

    Rivals are other heights, and the mirrored target. If the target repeats, a shift by one period changes only its
    ends. On the patent's target a shift by half a period with left and right exchanged does the same. What the laser
    saw of the ends decides (:mod:`pipeline.target.rivals`).

    Parameters
    ----------
    dry
        Laser points above the water, pool frame.
    scan
        The same points' voxel means, and the rays of the scanner.
    model
        The target by design.
    settings
        Settings of stage segment.
    azimuth_known
        True: the azimuth is configured; false: it is estimated from the track.
    """
    sigmas = _pose_sigmas(model, settings, azimuth_known)
    closest = ClosestSurface(model)
    surface = TargetSurface(closest, planes_of_faces(model))
    limits = 1.3 * sigmas + np.array([0.02, 0.05, 0.05, 0.02])
    coarse = _best_start(TargetPose(dry.voxel_means_m, sigmas), surface, model.half_period_m, azimuth_known, limits)
    label = dry_labeller(model, settings)
    points = TargetPose(dry.points_m, sigmas)
    # the edges of a found target may have drawn the pose to where no point is above the water: begin within the limits
    start = np.clip(coarse.parameters, -limits, limits) if model.found else coarse.parameters
    pose = refine(points, start, label, surface.planes, least_m=LEAST_M)
    taken_back = model.found and bool(np.isfinite(pose.scale_m))  # with points on its faces, not by the limits alone
    frame = TargetFrame(rotation_z(pose.parameters[0]), pose.parameters[1:])
    tilted = TiltedTarget(points.points(pose.parameters), np.array(TILT_SIGMAS))
    return LocatedTarget(
        frame=frame,
        azimuth_correction_rad=pose.parameters[0],
        pose=pose,
        tilt=refine(tilted, np.zeros(6), label, surface.planes, rounds=2),
        rival=best_rival(scan, frame, model, closest, settings.ambiguity_share),
        gate_m=gate_of(pose, settings),
        within=coarse.or_within(pose.parameters, limits, edges_known=not taken_back),
        pose_sigmas=sigmas,
    )


def _pose_sigmas(model: TargetModel, settings: Segment, azimuth_known: bool) -> Array:
    """Return the a-priori sigmas (4,) of the errors of azimuth (rad) and origin (m): the search limits."""
    azimuth = np.radians(settings.search_azimuth_deg if azimuth_known else max(10.0, settings.search_azimuth_deg))
    reach_xy = settings.search_horizontal_m
    reach_z = reach_xy if model.repeats_m is None else settings.search_vertical_e * model.half_period_m
    return np.array([azimuth, reach_xy, reach_xy, reach_z])


def _best_start(
    placement: TargetPose, surface: TargetSurface, half_period_m: float, azimuth_known: bool, limits: Array
) -> SearchResult:
    """Return the best pose of a search that starts from a grid of azimuths, horizontal shifts and heights."""
    azimuth, reach_xy, _, reach_z = placement.prior_sigmas
    turns = np.linspace(-azimuth, azimuth, 5 if azimuth_known else 13)
    steps = (-0.8, 0.0, 0.8)
    starts = [
        [np.array([turn, reach_xy * x, reach_xy * y, reach_z * z]) for turn in turns for x in steps for y in steps]
        for z in steps
    ]

    def same(p: Array, q: Array) -> bool:
        return bool(np.max(np.abs(p[1:] - q[1:])) < half_period_m / 2)

    def quality(p: Array) -> float:
        return surface_score(placement, p, surface.closest, SCORE_REACH_M)

    return search(placement, starts, surface, SearchCriteria(same, quality, limits, starts_per_group=2))
