"""The target's pose in the laser's points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.target.labelling import Beams, label_points
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.registration import (
    Refined,
    TargetPose,
    TiltedTarget,
    refine,
    score,
    search,
    settle,
)
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
SHARP_M = 0.06  # reach of the final score
BEHIND_M = 0.15  # farther behind a face than this is no noise
WIDE_M = 0.08  # gate while the pose or the mount is still being refined
GATE_SCALES = 5  # the final gate, in robust scales of what was labelled
VOXEL_M = 0.1  # laser points are averaged over cubes of this size
NARROW = (0.15, 0.1, 0.07, 0.05)


@dataclass(frozen=True)
class FoundTarget:
    """R_target_from_pool (3, 3), origin of the target in the pool frame, and how sure that is; ``pose_sigmas``: how far
    off its azimuth and origin were taken to be."""

    R_target_from_pool: Array
    origin_pool_m: Array
    azimuth_correction_rad: float
    pose: Refined
    tilt: Refined
    agreement_m2: float
    rival_agreement_m2: float
    rival: str
    ambiguous: bool
    gate_m: float
    within: bool
    pose_sigmas: Array


def planes_of(model: TargetModel) -> tuple[Array, Array]:
    return np.array([face.normal for face in model.faces]), np.array([face.distance_m for face in model.faces])


@dataclass(frozen=True)
class LaserSample:
    """Dry laser points in the pool frame: means over voxels (n, 3) m, and some of the points themselves (k, 3) m.

    Voxels are evenly dense, which a search wants, but biased where a face runs along their sides: each mean then lies
    on its own side of the face. The pose itself comes from the points.
    """

    voxel_means_m: Array
    points_m: Array


def find_target(
    dry: LaserSample, model: TargetModel, settings: Segment, azimuth_known: bool
) -> FoundTarget:
    """Pose of the target from dry laser points; rivals are other poses, and the mirrored target.

    Where the target repeats, shifting it by one period changes nothing but its ends; and so, on the patent's, does half
    a period with the sides exchanged. A rival half a period off loses the wall's width times half a period; if it loses
    less than ``ambiguity_share`` of that, the ends were not seen well enough, and the registration is ambiguous.
    """
    azimuth = np.radians(settings.search_azimuth_deg if azimuth_known else max(10.0, settings.search_azimuth_deg))
    reach_xy = settings.search_horizontal_m
    reach_z = reach_xy if model.repeats_m is None else settings.search_vertical_e * model.half_period_m
    sigmas = np.array([azimuth, reach_xy, reach_xy, reach_z])
    placement = TargetPose(dry.voxel_means_m, sigmas)
    normals, distances = planes_of(model)
    closest = ClosestSurface(model)
    turns = np.linspace(-azimuth, azimuth, 5 if azimuth_known else 13)
    steps = (-0.8, 0.0, 0.8)
    starts = [
        [np.array([turn, reach_xy * x, reach_xy * y, reach_z * z]) for turn in turns for x in steps for y in steps]
        for z in steps
    ]
    quarter = model.half_period_m / 2

    def same(p: Array, q: Array) -> bool:
        return bool(np.max(np.abs(p[1:] - q[1:])) < quarter)

    def judge(p: Array) -> float:
        return score(placement, p, closest, SHARP_M)

    limits = 1.3 * sigmas + np.array([0.02, 0.05, 0.05, 0.02])
    found = search(placement, starts, closest, normals, same, limits, judge, each=2)

    def label(_: Array, points: Array) -> NDArray[np.int16]:
        above = points[:, 2] > model.water_level_m + settings.water_margin_m
        head_on = Beams.head_on(len(points))
        labels = label_points(model, points, head_on, WIDE_M, settings.margin_m, 0.0, seen="dry")
        return np.where(above, labels.face, -1).astype(np.int16)

    single = TargetPose(dry.points_m, sigmas)
    pose = refine(single, found.parameters, label, normals, distances)
    best = _agreement(placement, pose.parameters, model, closest)
    tilted = TiltedTarget(single.points(pose.parameters), np.array([0.1, 0.1, 0.1, 1.0, 1.0, 1.0]))
    tilt = refine(tilted, np.zeros(6), label, normals, distances, rounds=2)
    name, rival = _rivals(placement, pose.parameters, model)
    R_target_from_pool = rotation_z(pose.parameters[0])
    expected = model.width_m * model.half_period_m
    ambiguous = bool(best - rival < settings.ambiguity_share * expected)
    return FoundTarget(
        R_target_from_pool,
        pose.parameters[1:],
        pose.parameters[0],
        pose,
        tilt,
        best,
        rival,
        name,
        ambiguous,
        gate_of(pose, settings),
        found.within,
        sigmas,
    )


def gate_of(refined: Refined, settings: Segment) -> float:
    """Distance from a face up to which points are labelled: wide enough that the noise is not cut into."""
    return max(settings.gate_m, GATE_SCALES * refined.scale_m) if np.isfinite(refined.scale_m) else settings.gate_m


def _agreement(placement: TargetPose, parameters: Array, model: TargetModel, closest: ClosestSurface) -> float:
    """Area of laser points explained by the model, plus area of its dry upright faces covered by points, in m².

    Both ways, because a model that reaches beyond the end of the stack explains every point as well.
    """
    from scipy.spatial import cKDTree  # half a second: only where needed

    points = placement.points(parameters)
    explained = score(placement, parameters, closest, SHARP_M) * len(points)
    grid = model.upright_grid(VOXEL_M, model.water_level_m + VOXEL_M)
    distance, _ = cKDTree(points).query(grid)
    covered = np.maximum(0.0, 1.0 - (distance / (2 * VOXEL_M)) ** 2).sum()
    return float((explained + covered) * VOXEL_M**2)


def _rivals(placement: TargetPose, best: Array, model: TargetModel) -> tuple[str, float]:
    """The best of the rivals, and how well it agrees; none, where the target neither repeats nor has a left and right.
    """
    shifts: list[tuple[TargetModel, str, float]] = []
    whole = model.repeats_m
    if whole is not None:
        shifts += [(model, "one period higher", whole), (model, "one period lower", -whole)]
    if not model.symmetric:
        other = model.mirrored()
        shifts.append((other, "left and right exchanged", 0.0))
        if whole is not None:
            shifts.append((other, "left and right exchanged, half a period higher", whole / 2))
            shifts.append((other, "left and right exchanged, half a period lower", -whole / 2))
    rivals = [("none", 0.0)]
    # No prior here: the rival may settle where it fits best.
    free = TargetPose(placement.points_pool_m, np.full(4, 1e3))
    for one, name, shift in shifts:
        closest = ClosestSurface(one)
        settled = settle(free, best + np.array([0.0, 0.0, 0.0, shift]), closest, planes_of(one)[0], NARROW)
        rivals.append((name, _agreement(free, settled, one, closest)))
    return max(rivals, key=lambda rival: rival[1])


