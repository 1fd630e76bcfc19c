"""Search for the pose of the target in the laser's points."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.maths.target.placements import TargetPose, TiltedTarget
from pipeline.maths.target.registration import (
    SearchCriteria,
    SearchResult,
    TargetSurface,
    converge,
    refine,
    search,
    surface_score,
)
from pipeline.target.matching import SCORE_REACH_M, dry_labeller, gate_of, planes_of_faces
from pipeline.target.samples import VOXEL_M, LaserSample
from pipeline.target.search_results import LocatedTarget
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
RIVAL_REACHES_M = (0.15, 0.1, 0.07, 0.05)
TILT_SIGMAS = (0.1, 0.1, 0.1, 1.0, 1.0, 1.0)  # rad and m: so large that only the points count


def search_target_pose(dry: LaserSample, model: TargetModel, settings: Segment, azimuth_known: bool) -> LocatedTarget:
    """Return the pose of the target in dry laser points, and how well its best rival fits.

    Rivals are other heights, and the mirrored target. If the target repeats, a shift by one period changes only its
    ends. On the patent's target a shift by half a period with left and right exchanged does the same. With a rival half
    a period off, the area that agrees is expected to be smaller by the wall's width times half a period. If it is
    smaller by less than ``ambiguity_share`` of that, the laser did not see the ends well enough: the pose is ambiguous.

    Parameters
    ----------
    dry
        Laser points above the water, pool frame.
    model
        The target by design.
    settings
        Settings of stage segment.
    azimuth_known
        True: the azimuth is configured; false: it is estimated from the track.
    """
    sigmas = _pose_sigmas(model, settings, azimuth_known)
    placement = TargetPose(dry.voxel_means_m, sigmas)
    surface = TargetSurface(ClosestSurface(model), planes_of_faces(model))
    coarse = _best_start(placement, surface, model.half_period_m, azimuth_known)
    label = dry_labeller(model, settings)
    points = TargetPose(dry.points_m, sigmas)
    pose = refine(points, coarse.parameters, label, surface.planes)
    agreement_m2 = _agreement(placement, pose.parameters, model, surface)
    rival, rival_agreement_m2 = _best_rival(placement, pose.parameters, model)
    expected_m2 = model.width_m * model.half_period_m
    tilted = TiltedTarget(points.points(pose.parameters), np.array(TILT_SIGMAS))
    return LocatedTarget(
        frame=TargetFrame(rotation_z(pose.parameters[0]), pose.parameters[1:]),
        azimuth_correction_rad=pose.parameters[0],
        pose=pose,
        tilt=refine(tilted, np.zeros(6), label, surface.planes, rounds=2),
        agreement_m2=agreement_m2,
        rival_agreement_m2=rival_agreement_m2,
        rival=rival,
        ambiguous=bool(agreement_m2 - rival_agreement_m2 < settings.ambiguity_share * expected_m2),
        gate_m=gate_of(pose, settings),
        within=coarse.within,
        pose_sigmas=sigmas,
    )


def _pose_sigmas(model: TargetModel, settings: Segment, azimuth_known: bool) -> Array:
    """Return the a-priori sigmas (4,) of the errors of azimuth (rad) and origin (m): the search limits."""
    azimuth = np.radians(settings.search_azimuth_deg if azimuth_known else max(10.0, settings.search_azimuth_deg))
    reach_xy = settings.search_horizontal_m
    reach_z = reach_xy if model.repeats_m is None else settings.search_vertical_e * model.half_period_m
    return np.array([azimuth, reach_xy, reach_xy, reach_z])


def _best_start(
    placement: TargetPose, surface: TargetSurface, half_period_m: float, azimuth_known: bool
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

    limits = 1.3 * placement.prior_sigmas + np.array([0.02, 0.05, 0.05, 0.02])
    return search(placement, starts, surface, SearchCriteria(same, quality, limits, starts_per_group=2))


def _agreement(placement: TargetPose, parameters: Array, model: TargetModel, surface: TargetSurface) -> float:
    """Return the area of laser points explained by the model, plus that of its dry upright faces with points, in m².

    The second area is necessary: a model that is longer than the real stack explains every point, too.
    """
    from scipy.spatial import cKDTree  # the import takes half a second

    points = placement.points(parameters)
    explained = surface_score(placement, parameters, surface.closest, SCORE_REACH_M) * len(points)
    grid = model.upright_grid(VOXEL_M, model.water_level_m + VOXEL_M)
    distance, _ = cKDTree(points).query(grid)
    covered = np.maximum(0.0, 1.0 - (distance / (2 * VOXEL_M)) ** 2).sum()
    return float((explained + covered) * VOXEL_M**2)


def _best_rival(placement: TargetPose, best: Array, model: TargetModel) -> tuple[str, float]:
    """Return the best rival's name and agreement (m²); "none" and 0 for a symmetric target that does not repeat."""
    shifts: list[tuple[TargetModel, str, float]] = []
    period_m = model.repeats_m
    if period_m is not None:
        shifts += [(model, "one period higher", period_m), (model, "one period lower", -period_m)]
    if not model.symmetric:
        mirrored = model.mirrored()
        shifts.append((mirrored, "left and right exchanged", 0.0))
        if period_m is not None:
            shifts.append((mirrored, "left and right exchanged, half a period higher", period_m / 2))
            shifts.append((mirrored, "left and right exchanged, half a period lower", -period_m / 2))
    rivals = [("none", 0.0)]
    # Without a prior the rival converges to its best fit.
    free = TargetPose(placement.points_pool_m, np.full(4, 1e3))
    for rival, name, shift_m in shifts:
        surface = TargetSurface(ClosestSurface(rival), planes_of_faces(rival))
        start = best + np.array([0.0, 0.0, 0.0, shift_m])
        parameters = converge(free, start, surface, RIVAL_REACHES_M)
        rivals.append((name, _agreement(free, parameters, rival, surface)))
    return max(rivals, key=lambda named: named[1])
