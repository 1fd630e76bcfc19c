"""The sonar's provisional mount: with which the soundings fall onto the target's wet faces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.config.stage_settings import SonarBeams
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.target.labelling import label_points
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.registration import (
    MountCorrection,
    refine,
    score,
    search,
)
from pipeline.mount import Mounted
from pipeline.target.pose_search import BEHIND_M, SHARP_M, WIDE_M, gate_of, planes_of
from pipeline.target.sonar_beams import beams_in_target
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]


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
    mbes: SonarBeams,
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
    normals, distances = planes_of(model)
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
        gate_of(refined, settings),
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
