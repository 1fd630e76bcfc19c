"""Finds the target: its pose in the laser's points, then the mount with which the soundings fall onto it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.config.session import Mbes
from pipeline.maths.geometry.rotations import exp_so3, rotation_z
from pipeline.maths.target.labelling import Beams, label_points
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.registration import (
    LaserMount,
    MountCorrection,
    Refined,
    TargetPose,
    TiltedTarget,
    refine,
    score,
    search,
    settle,
)
from pipeline.mount import Mounted
from pipeline.target.sonar_beams import beams_in_target
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
SHARP_M = 0.06  # reach of the final score
BEHIND_M = 0.15  # farther behind a face than this is no noise
WIDE_M = 0.08  # gate while the pose or the mount is still being refined
GATE_SCALES = 5  # the final gate, in robust scales of what was labelled
VOXEL_M = 0.1  # laser points are averaged over cubes of this size
FARTHEST = 3.0  # sigmas of what is searched, within which a laser's mount is taken
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


def _planes(model: TargetModel) -> tuple[Array, Array]:
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
    normals, distances = _planes(model)
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
        _gate(pose, settings),
        found.within,
        sigmas,
    )


def _gate(refined: Refined, settings: Segment) -> float:
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
        settled = settle(free, best + np.array([0.0, 0.0, 0.0, shift]), closest, _planes(one)[0], NARROW)
        rivals.append((name, _agreement(free, settled, one, closest)))
    return max(rivals, key=lambda rival: rival[1])


def find_laser(
    sample: "LaserPoses",
    target: FoundTarget,
    model: TargetModel,
    coarse: Mounted,
    settings: Segment,
) -> tuple[FoundTarget, "FoundMount"]:
    """Where the target stands and how the laser is turned, from the pose found with the coarse mount.

    Its lever arm stays: a laser mounted 3 cm too far starboard and a target 3 cm nearer look alike.
    """
    angle = np.radians(settings.search_laser_deg)
    sigmas = np.r_[target.pose_sigmas, [angle] * 3]
    body = sample.points_laser_m @ coarse.R_body_from_sensor.T
    start = np.r_[target.pose.parameters, np.zeros(3)]
    placement = LaserMount(sample.positions_m, sample.R_pool_from_body, body, coarse.lever_arm_body_m, sigmas)
    normals, distances = _planes(model)

    def label(_: Array, points: Array) -> NDArray[np.int16]:
        above = points[:, 2] > model.water_level_m + settings.water_margin_m
        labels = label_points(model, points, Beams.head_on(len(points)), WIDE_M, settings.margin_m, 0.0, seen="dry")
        return np.where(above, labels.face, -1).astype(np.int16)

    refined = refine(placement, start, label, normals, distances)
    pose = replace(refined, parameters=refined.parameters[:4], covariance=refined.covariance[:4, :4])
    found = replace(
        target,
        R_target_from_pool=rotation_z(pose.parameters[0]),
        origin_pool_m=pose.parameters[1:],
        azimuth_correction_rad=float(pose.parameters[0]),
        pose=pose,
        tilt=replace(target.tilt, parameters=np.zeros(6)),  # it was the laser's
        gate_m=_gate(refined, settings),
    )
    off = refined.parameters[4:]
    score = refined.count / max(1, len(body))
    within = bool(np.all(np.abs(off) <= FARTHEST * angle))
    return found, FoundMount(off, np.zeros(3), refined.scale_m, found.gate_m, score, 0.0, False, within)


@dataclass(frozen=True)
class LaserPoses:
    """Laser points with their poses in the pool frame: positions (n, 3), R (n, 3, 3); points_laser_m (n, 3)."""

    positions_m: Array
    R_pool_from_body: Array
    points_laser_m: Array


@dataclass(frozen=True)
class SoundingSample:
    """Soundings with their poses in the target frame: positions (n, 3), R (n, 3, 3); points_mbes_m (n, 3)."""

    positions_m: Array
    R_target_from_body: Array
    points_mbes_m: Array


@dataclass(frozen=True)
class FoundMount:
    """The mount for labelling: rotation vector from coarse (body), lever arm correction, and the gate that follows."""

    rotation_vector_rad: Array
    lever_arm_correction_m: Array
    scale_m: float
    gate_m: float
    score: float
    rival_score: float
    ambiguous: bool
    within: bool

    def on(self, coarse: Mounted) -> tuple[Array, Array]:
        """R_body_from_sensor (3, 3) and lever arm (3,) that follow."""
        R_body_from_sensor = exp_so3(self.rotation_vector_rad) @ coarse.R_body_from_sensor
        return R_body_from_sensor, coarse.lever_arm_body_m + self.lever_arm_correction_m


def find_mount(
    sample: SoundingSample,
    model: TargetModel,
    R_body_from_mbes: Array,
    lever_arm_m: Array,
    mbes: Mbes,
    settings: Segment,
) -> FoundMount:
    """Mount correction with which the soundings fall onto the wet faces; coarse values wrong by up to the search
    limits.

    First the front (the patent's wall): roll turns it about the track and x shifts it, nothing else moves it, so both
    follow from a vote over the part of it that is the front wherever the rest still stands; without one roll is
    searched as well. Then a search over yaw, y and z; blocks repeat every period, so z is sought within the lever arm's
    limits and a rival there is reported.
    """
    angle, arm = np.radians(settings.search_mount_deg), settings.search_mount_m
    sigmas = np.array([angle, angle, angle, arm, arm, arm])
    body = sample.points_mbes_m @ R_body_from_mbes.T
    placement = MountCorrection(sample.positions_m, sample.R_target_from_body, body, lever_arm_m, sigmas)
    normals, distances = _planes(model)
    closest = ClosestSurface(model)
    vote = _wall_vote(placement, model, settings)
    bases = [np.array([0.0, roll, 0.0, 0.0, 0.0, 0.0]) for roll in np.linspace(-angle, angle, 5)]
    if vote is not None:
        bases = [np.r_[0.0, vote[0], 0.0, vote[1]]]
    starts = [
        [
            base + np.array([0.0, 0.0, yaw, 0.0, y, z])
            for base in bases
            for yaw in np.linspace(-angle, angle, 5)
            for y in np.linspace(-arm, arm, 3)
        ]
        for z in np.linspace(-arm, arm, 7)
    ]

    def same(p: Array, q: Array) -> bool:
        return bool(np.max(np.abs(p[3:] - q[3:])) < model.half_period_m / 2)

    def judge(p: Array) -> float:
        """A sounding behind a face cannot be: a stack shifted onto the floor or the next block explains as many."""
        behind = closest.hides(placement.origins(p), placement.points(p), BEHIND_M)
        return score(placement, p, closest, SHARP_M) - float(np.mean(behind))

    limits = np.repeat(settings.farthest_mount, 3) * np.repeat([np.pi / 180, 1.0], 3)
    found = search(placement, starts, closest, normals, same, limits, judge)

    def label(parameters: Array, points: Array) -> NDArray[np.int16]:
        R = exp_so3(parameters[:3]) @ R_body_from_mbes
        beams = beams_in_target(sample.R_target_from_body, R, sample.points_mbes_m, mbes)
        wet = (-np.inf, model.water_level_m - settings.water_margin_m)
        grazing = np.radians(settings.min_grazing_deg)
        return label_points(model, points, beams, WIDE_M, settings.margin_m, grazing, heights_m=wet, seen="wet").face

    refined = refine(placement, found.parameters, label, normals, distances)
    ambiguous = bool(found.rival_score > found.score * (1 - settings.ambiguity_margin))
    return FoundMount(
        refined.parameters[:3],
        refined.parameters[3:],
        refined.scale_m,
        _gate(refined, settings),
        found.score,
        found.rival_score,
        ambiguous,
        found.within,
    )


def _wall_vote(
    placement: MountCorrection, model: TargetModel, settings: Segment
) -> tuple[float, Array] | None:
    """Roll correction (rad) and shift (3,) of the lever arm (m, body) that gather most soundings of the front's middle
    in one plane; None where the target has no front, or it was not seen.

    A turn ρ about body y moves a sounding by ρ T (e_y × m); only its part along the front's normal matters there.
    """
    front = model.front()
    if front is None:
        return None
    points = placement.points(np.zeros(6))
    into = -front.normal
    along = np.array([-into[1], into[0], 0.0]) / np.hypot(*into[:2])
    corners = front.vertices_m @ along
    middle, half = (corners.max() + corners.min()) / 2, np.ptp(corners) / 2
    behind = points @ into + front.distance_m
    spare = max(0.25 * half, half - settings.search_mount_m - 0.45)
    low, high = front.vertices_m[:, 2].min(), model.water_level_m - settings.water_margin_m
    high = min(high, front.vertices_m[:, 2].max())
    use = (np.abs(points @ along - middle) < spare) & (points[:, 2] > low) & (points[:, 2] < high)
    use &= np.abs(behind) < 1.0
    if use.sum() < 20:
        return None
    R = placement.R_target_from_body[use]
    lever = np.cross([0.0, 1.0, 0.0], placement.points_body_m[use])
    slope = np.einsum("i,nij,nj->n", into, R, lever)
    bins = np.arange(-0.9, 0.9 + 1e-9, 0.02)
    best = (-1.0, 0.0, 0.0)
    reach = np.radians(1.2 * settings.search_mount_deg)
    for roll in np.linspace(-reach, reach, 73):
        votes = np.histogram(behind[use] + roll * slope, bins)[0].astype(float)
        votes = votes[:-2] + 2 * votes[1:-1] + votes[2:]
        top = int(np.argmax(votes))
        if votes[top] > best[0]:
            best = (float(votes[top]), float(roll), float(-(bins[top + 1] + 0.01)))
    return best[1], best[2] * np.einsum("i,nij->nj", into, R).mean(axis=0)
