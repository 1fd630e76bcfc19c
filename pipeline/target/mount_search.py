"""Search for the sonar's provisional mount, which brings the soundings onto the target's wet faces."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.pool import Segment
from pipeline.config.stage_settings import SonarBeams
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.target.labelling import label_points
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.placements import MountCorrection
from pipeline.maths.target.registration import Labeller, SearchCriteria, TargetSurface, refine, search, surface_score
from pipeline.mount import Mounted
from pipeline.target.label_limits import sonar_limits
from pipeline.target.matching import REFINEMENT_GATE_M, SCORE_REACH_M, gate_of, planes_of_faces
from pipeline.target.samples import SoundingSample
from pipeline.target.search_results import ProvisionalMount
from pipeline.target.sonar_beams import beams_in_target
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
LEAST_M, USUAL_DEG = 0.02, 3.0  # errors that soundings share: what moves them by less over such a search stays open
BEHIND_M = 0.15  # noise does not bring a sounding farther behind a face


def search_mount(
    sample: SoundingSample, model: TargetModel, coarse: Mounted, mbes: SonarBeams, settings: Segment
) -> ProvisionalMount:
    """Return the correction of the coarse mount that brings the soundings onto the wet faces.

    The coarse mount may be wrong by up to the search limits. First the soundings on the front (the patent's wall) give
    roll and x: roll turns the front about the track, x shifts it, and no other parameter moves it. A vote decides: the
    roll and x that bring most soundings into one plane. Only soundings near the front's middle vote, because they are
    on the front whatever the other parameters are. Without a front the search includes roll. Then follows a search over
    yaw, y and z. Blocks repeat in height, so another z may fit as well. The search covers all z within the limits of
    the lever arm, and the best rival is reported.

    Parameters
    ----------
    sample
        Soundings with their poses in the target frame.
    model
        The target by design.
    coarse
        Coarse mount of the sonar.
    mbes
        The sonar's settings, for its beams.
    settings
        Settings of stage segment.
    """
    angle, arm = np.radians(settings.search_mount_deg), settings.search_mount_m
    placement = MountCorrection(
        positions_m=sample.positions_m,
        R_target_from_body=sample.R_target_from_body,
        points_body_m=sample.points_mbes_m @ coarse.R_body_from_sensor.T,
        lever_arm_m=coarse.lever_arm_body_m,
        prior_sigmas=np.array([angle, angle, angle, arm, arm, arm]),
    )
    closest = ClosestSurface(model)
    surface = TargetSurface(closest, planes_of_faces(model))
    criteria = _criteria(placement, model, closest, settings)
    result = search(placement, _starts(placement, model, settings), surface, criteria)
    label = _wet_labeller(sample, model, coarse, mbes, settings)
    least_m = LEAST_M * min(1.0, settings.search_mount_deg / USUAL_DEG)  # a narrow search moves points by less
    refined = refine(placement, result.parameters, label, surface.planes, least_m=least_m)
    return ProvisionalMount(
        rotation_vector_rad=refined.parameters[:3],
        lever_arm_correction_m=refined.parameters[3:],
        scale_m=refined.scale_m,
        gate_m=gate_of(refined, settings),
        score=result.score,
        rival_score=result.rival_score,
        ambiguous=bool(result.rival_score > result.score * (1 - settings.ambiguity_margin)),
        within=result.or_within(refined.parameters, criteria.limits, edges_known=not model.found),
    )


def _starts(placement: MountCorrection, model: TargetModel, settings: Segment) -> list[list[Array]]:
    """Return the corrections (6,) from which the search starts, in groups with the same z."""
    angle, arm = np.radians(settings.search_mount_deg), settings.search_mount_m
    vote = _front_vote(placement, model, settings)
    bases = [np.array([0.0, roll, 0.0, 0.0, 0.0, 0.0]) for roll in np.linspace(-angle, angle, 5)]
    if vote is not None:
        bases = [np.r_[0.0, vote[0], 0.0, vote[1]]]
    return [
        [
            base + np.array([0.0, 0.0, yaw, 0.0, y, z])
            for base in bases
            for yaw in np.linspace(-angle, angle, 5)
            for y in np.linspace(-arm, arm, 3)
        ]
        for z in np.linspace(-arm, arm, 7)
    ]


def _criteria(
    placement: MountCorrection, model: TargetModel, closest: ClosestSurface, settings: Segment
) -> SearchCriteria:
    def same(p: Array, q: Array) -> bool:
        return bool(np.max(np.abs(p[3:] - q[3:])) < model.half_period_m / 2)

    def quality(p: Array) -> float:
        """Return the score less the share of soundings behind a face.

        No true sounding can lie there. A wrong mount that moves soundings of the floor, or of the next block, onto a
        face may explain as many soundings, but it puts some behind a face.
        """
        behind = closest.hides(placement.origins(p), placement.points(p), BEHIND_M)
        return surface_score(placement, p, closest, SCORE_REACH_M) - float(np.mean(behind))

    return SearchCriteria(same, quality, farthest_correction(settings))


def farthest_correction(settings: Segment) -> Array:
    """Return the largest correction (6,) of each component of the coarse mount that is accepted, rad and m."""
    return np.asarray(np.repeat(settings.farthest_mount, 3) * np.repeat([np.pi / 180, 1.0], 3))


def _wet_labeller(
    sample: SoundingSample, model: TargetModel, coarse: Mounted, mbes: SonarBeams, settings: Segment
) -> Labeller:
    """Return a function that labels soundings below the water; the correction also turns their beams."""
    limits = sonar_limits(settings, model.water_level_m, REFINEMENT_GATE_M)

    def label(parameters: Array, points: Array) -> NDArray[np.int16]:
        R_body_from_mbes = exp_so3(parameters[:3]) @ coarse.R_body_from_sensor
        beams = beams_in_target(sample.R_target_from_body, R_body_from_mbes, sample.points_mbes_m, mbes)
        return label_points(model, points, beams, limits).face

    return label


def _front_vote(
    placement: MountCorrection, model: TargetModel, settings: Segment
) -> tuple[float, Array] | None:
    """Return the correction of roll (rad) and the shift (3,) of the lever arm (m, body axes) with the most votes.

    They bring most soundings of the front's middle into the front's plane. The result is None if the target has no
    front, or if fewer than 20 soundings lie near its middle. A turn ρ about body y moves a sounding by ρ T (e_y × m),
    with T = R_target_from_body and m the sounding in body axes. Only the component along the front's normal counts.
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
