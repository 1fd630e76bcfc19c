"""The patent's offsets [0126-0128], and the alternation: angles and offsets in turn until both stay the same.

Numbers in brackets are paragraphs of patent CN 105425246 B. Corrections are laser minus MBES, displacements in the
*target* frame. The lever arm is in *body* axes. So the corrections are turned by the mean R_body_from_target of the
soundings; without this, a pool that is not aligned with north would give wrong lever arms.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import Plane, PlaneMoments, fit_plane
from pipeline.maths.geometry.rotations import exp_so3, log_so3
from pipeline.maths.patent.angles import PassPlanes, angle_step, mean_attitude
from pipeline.maths.patent.lifted_moments import plane_moments

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DryFace:
    """A horizontal face that the laser sees: mean height of its points, and the height by design."""

    name: str
    mean_z_m: float
    design_z_m: float
    count: int


@dataclass(frozen=True)
class WetFace:
    """A horizontal face that the sonar sees: lifted moments (40, 40) of its soundings, and the height by design."""

    name: str
    lifted: Array
    design_z_m: float


@dataclass(frozen=True)
class PassOffsets:
    """One pass: lifted moments by family, and the laser's planes P2 (the wall) and P1."""

    planes: PassPlanes
    laser_wall: Plane
    laser_p1: Plane


@dataclass(frozen=True)
class OffsetObservations:
    """Observations of the offsets: the passes, and the horizontal faces that each sensor sees."""

    passes: Sequence[PassOffsets]
    dry: Sequence[DryFace]
    wet: Sequence[WetFace]


@dataclass(frozen=True)
class PatentOffsets:
    """Displacement (3,) m of the MBES's points onto the laser's, in target frame and body axes; face pairs for Z."""

    target_m: Array
    body_m: Array
    pairs: list[dict[str, float | str]]


def patent_offsets(
    observations: OffsetObservations, rotation: Array, lever_arm_m: Array, apply_x_first: bool
) -> PatentOffsets:
    """Compute X, Y, Z with the mount Exp(δ) = ``rotation`` and this lever arm.

    X [0126]: mean X of the laser's wall points minus that of the MBES's, pass by pass, weighted by n_L n_M / (n_L +
    n_M). Z [0127]: (z_dry - z_wet) measured minus (z_dry - z_wet) by design, over every pair of horizontal faces.
    Y [0128]: P1 planes projected onto the floor (their traces at their own mean height), cut with a line parallel to Y
    through the centroid of the laser's points, laser minus MBES. A shift of the MBES's points by ΔX moves their cut by
    ΔX n_x / n_y. With ``apply_x_first`` this is subtracted, and Y is the offset that remains after X has been applied.

    Parameters
    ----------
    observations
        Passes and horizontal faces.
    rotation
        Correction of the coarse mount, Exp(δ) (3, 3).
    lever_arm_m
        Lever arm (3,), body axes.
    apply_x_first
        Whether Y is the offset that remains after X has been applied.

    Raises
    ------
    DegenerateGeometryError
        No pass has points of both sensors on P1 and P2, or a sensor sees no horizontal face.
    """
    passes = observations.passes
    if not passes:
        raise DegenerateGeometryError("no pass has laser points and soundings on both P1 and P2")
    x_rows, y_rows = [], []
    for of_pass in passes:
        wall = plane_moments(of_pass.planes.lifted["P2"], rotation, lever_arm_m)
        weight = _pair_weight(of_pass.laser_wall.count, wall.count)
        x_rows.append((of_pass.laser_wall.centroid_m[0] - wall.total[0] / wall.count, weight))
    dx = _mean(x_rows)
    for of_pass in passes:
        laser_p1 = of_pass.laser_p1
        slanted = fit_plane(plane_moments(of_pass.planes.lifted["P1"], rotation, lever_arm_m), laser_p1.normal)
        cut_x = laser_p1.centroid_m[0]
        dy = _cut(laser_p1, cut_x) - _cut(slanted, cut_x)
        if apply_x_first:
            dy -= dx * slanted.normal[0] / slanted.normal[1]
        y_rows.append((dy, _pair_weight(laser_p1.count, slanted.count)))
    pairs, dz = _height_pairs(observations, rotation, lever_arm_m)
    target = np.array([dx, _mean(y_rows), dz])
    lifted = {f"{one.planes.number}-{family}": m for one in passes for family, m in one.planes.lifted.items()}
    return PatentOffsets(target, mean_attitude(lifted) @ target, pairs)


def _pair_weight(first: int, second: int) -> float:
    """Return the weight of the difference of two means, from their numbers of points."""
    return first * second / (first + second)


def _mean(rows: Sequence[tuple[float, float]]) -> float:
    return float(np.average([value for value, _ in rows], weights=[weight for _, weight in rows]))


def _cut(plane: Plane, x_m: float) -> float:
    """Return the y (m) at which the trace of the plane, at the height of its centroid, meets x = x_m."""
    n, c = plane.normal, plane.centroid_m
    return float(c[1] - (x_m - c[0]) * n[0] / n[1])


def height_pair(above: DryFace, below: WetFace, placed: PlaneMoments) -> dict[str, float | str]:
    """Return the row of a pair of horizontal faces: measured and design height difference, and Z, their difference.

    Parameters
    ----------
    above, below
        The dry face and the wet one.
    placed
        Moments of the wet face's soundings, placed in the target frame.
    """
    measured = above.mean_z_m - float(placed.total[2] / placed.count)
    design = above.design_z_m - below.design_z_m
    return {
        "dry_face": above.name,
        "wet_face": below.name,
        "measured_m": measured,
        "design_m": design,
        "dz_m": measured - design,
    }


def _height_pairs(
    observations: OffsetObservations, rotation: Array, lever_arm_m: Array
) -> tuple[list[dict[str, float | str]], float]:
    dry, wet = observations.dry, observations.wet
    if not dry or not wet:
        sensor = "laser" if not dry else "sonar"
        raise DegenerateGeometryError(f"the {sensor} sees no horizontal face well enough: Z cannot be determined")
    pairs: list[dict[str, float | str]] = []
    rows = []
    for below in wet:
        moments = plane_moments(below.lifted, rotation, lever_arm_m)
        for above in dry:
            pair = height_pair(above, below, moments)
            rows.append((float(pair["dz_m"]), _pair_weight(above.count, moments.count)))
            pairs.append(pair)
    total = sum(weight for _, weight in rows)
    for pair, (_, weight) in zip(pairs, rows, strict=True):
        pair["weight"] = weight / total
    return pairs, _mean(rows)


@dataclass(frozen=True)
class AlternationTolerances:
    """Limits that end the alternation: number of iterations, last step of the angles and of the offsets."""

    max_iterations: int
    step_rad: float
    step_m: float


@dataclass(frozen=True)
class AlternationResult:
    """Corrections (3,) of rotation and lever arm, body axes, and the rows of all iterations."""

    rotation_vector_rad: Array
    lever_arm_correction_m: Array
    converged: bool
    iterations: int
    rows: list[dict[str, float]]


def alternate(
    angle_passes: Sequence[PassPlanes],
    observations: OffsetObservations,
    lever_arm_m: Array,
    tolerances: AlternationTolerances,
) -> AlternationResult:
    """Take one step of the angles, then one of the offsets, until both stay the same or a step exceeds 100 m.

    The sequential method ends with angles that were computed with a wrong lever arm (the method's own error is 0.08° on
    noise-free data). At the end of the alternation neither a deviation nor a displacement is left. Only the true mount
    has neither.

    Parameters
    ----------
    angle_passes
        Passes in which both sensors have P1, P2 and P3.
    observations
        Passes and horizontal faces for the offsets.
    lever_arm_m
        Coarse lever arm (3,), body axes.
    tolerances
        Limits that end the alternation.
    """
    rotation, correction = np.eye(3), np.zeros(3)
    rows: list[dict[str, float]] = []
    converged = False
    for iteration in range(1, tolerances.max_iterations + 1):
        turn = angle_step(angle_passes, rotation, lever_arm_m + correction).correction_rad
        rotation = exp_so3(turn) @ rotation
        shift = patent_offsets(observations, rotation, lever_arm_m + correction, apply_x_first=True).body_m
        correction = correction + shift
        vector = np.degrees(log_so3(rotation))
        step_rad, step_m = float(np.linalg.norm(turn)), float(np.linalg.norm(shift))
        row: dict[str, float] = {"iteration": iteration, "step_deg": float(np.degrees(step_rad)), "step_m": step_m}
        row |= {f"rotation_{axis}_deg": float(vector[k]) for k, axis in enumerate("xyz")}
        rows.append(row | {f"lever_arm_{axis}_m": float(correction[k]) for k, axis in enumerate("xyz")})
        converged = step_rad <= tolerances.step_rad and step_m <= tolerances.step_m
        if converged or step_m > 100:
            break
    return AlternationResult(log_so3(rotation), correction, converged, len(rows), rows)
