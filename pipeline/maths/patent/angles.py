"""The patent's angles [0101-0123]: how the MBES's planes deviate from the laser's, and the iteration over them.

Numbers in brackets are paragraphs of patent CN 105425246 B; P1 to P4 are explained in CONVENTIONS.md, "The target".

Signs. With outward normals n1, n2, n3 (toward the vessel) and n4 = n1 x n2 (pointing down), to first order in a small
right-handed turn (α about x, β about y, γ about z) of the MBES's points in the target frame:

* the wall's normal (-1, 0, 0) gets the z component +β: roll deviation = change of its elevation;
* P3's normal turns about z by γ: yaw deviation = change of its azimuth, counter-clockwise +;
* n4 = (0, 0, -1) gets the y component +α: pitch deviation = its turn about x.

These are signed components, not the full angles between normals. (The full angles contain the other two axes; with them
the iteration stops converging at 0.01°.) No published sign rule is used, because [0025] and [0113] contradict each
other. The patent's cosines are recorded beside the deviations. The correction is minus the deviation. It is turned into
the body frame by the mean attitude and composed with (not added to) the rotation so far.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import Plane, angle_between, fit_plane
from pipeline.maths.geometry.rotations import exp_so3, log_so3
from pipeline.maths.patent.lifted_moments import attitude_sum, plane_moments

Array = NDArray[np.float64]
AXES = ("pitch", "roll", "yaw")  # about x, y, z


def fourth_normal(first: Array, second: Array) -> Array:
    """Return P4 = P1 x P2, a unit vector (3,); it points down for the outward normals of the target."""
    cross = np.cross(first, second)
    return np.asarray(cross / np.linalg.norm(cross))


def angle_deviations(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> Array:
    """Return the deviations (pitch, roll, yaw) (3,) rad of the MBES's normals P1-P4 from the laser's.

    The patent's three steps [0101-0123], each the MBES's angle minus the laser's, with the signs of the module's
    docstring. :func:`patent_cosines` returns the cosines by which the patent measures them [0112-0117].

    * roll step: elevation of the normal of P2, the wall;
    * yaw step: azimuth of the normal of P3, counter-clockwise;
    * pitch step: turn of the normal P4 = P1 x P2 about x.

    Parameters
    ----------
    mbes, laser
        Unit normals (3,) of P2, P3 and P4 in the target frame, by name.
    """
    pitch = _angle(mbes["P4"][1], -mbes["P4"][2]) - _angle(laser["P4"][1], -laser["P4"][2])
    roll = np.arcsin(mbes["P2"][2]) - np.arcsin(laser["P2"][2])
    yaw = _angle(mbes["P3"][1], mbes["P3"][0]) - _angle(laser["P3"][1], laser["P3"][0])
    return np.array([_wrap(pitch), roll, _wrap(yaw)])


def _angle(sine: float, cosine: float) -> float:
    return float(np.arctan2(sine, cosine))


def _wrap(angle_rad: float) -> float:
    return float((angle_rad + np.pi) % (2 * np.pi) - np.pi)


def patent_cosines(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> dict[str, float]:
    """Return the cosines of [0112-0117], for each step and sensor.

    They are the cosines between the normals of the wall and (0, 0, 1) (roll), of P3 and the laser's P2 (yaw), of P4 and
    the laser's P1 (pitch).
    """
    against = {"roll": ("P2", np.array([0.0, 0.0, 1.0])), "yaw": ("P3", laser["P2"]), "pitch": ("P4", laser["P1"])}
    return {
        f"cosine_{axis}_{sensor}": float(normals[plane] @ direction)
        for axis, (plane, direction) in against.items()
        for sensor, normals in (("laser", laser), ("mbes", mbes))
    }


def angles_between(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> dict[str, float]:
    """Return the full angle (rad) between the sensors' normals of each plane."""
    return {name: angle_between(mbes[name], laser[name]) for name in ("P1", "P2", "P3", "P4")}


@dataclass(frozen=True)
class PassPlanes:
    """Planes of one pass: lifted moments of the soundings by family (P1, P2, P3), and the laser's normals P1-P4."""

    number: int
    lifted: Mapping[str, Array]
    laser_normals: Mapping[str, Array]


def pass_normals(pass_planes: PassPlanes, rotation: Array, lever_arm_m: Array) -> tuple[dict[str, Array], float]:
    """Return the MBES's normals P1-P4 of a pass, and the pass's weight: inverse variance of normals for unit noise.

    Parameters
    ----------
    pass_planes
        The pass.
    rotation
        Correction of the coarse mount, Exp(δ) (3, 3).
    lever_arm_m
        Lever arm (3,), body axes.
    """
    planes = {
        family: fit_plane(plane_moments(lifted, rotation, lever_arm_m), pass_planes.laser_normals[family])
        for family, lifted in pass_planes.lifted.items()
    }
    normals = {family: plane.normal for family, plane in planes.items()}
    return normals | {"P4": fourth_normal(normals["P1"], normals["P2"])}, 1.0 / sum(map(_spread, planes.values()))


def _spread(plane: Plane) -> float:
    return float(np.sum(1.0 / plane.eigenvalues_m2[1:]) / plane.count)


def mean_attitude(lifted: Mapping[str, Array]) -> Array:
    """Return the mean R_body_from_target (3, 3) over the soundings in the lifted moments of all families."""
    total = sum((attitude_sum(moments) for moments in lifted.values()), np.zeros((3, 3)))
    count = sum(moments[-1, -1] for moments in lifted.values())
    return np.asarray(total.T / count)


@dataclass(frozen=True)
class AngleStep:
    """Comparison of all passes: the rotation vector (3,) (body axes) that undoes the deviations; rows to record."""

    correction_rad: Array
    combined: dict[str, float]
    by_pass: list[dict[str, float]]


def angle_step(passes: Sequence[PassPlanes], rotation: Array, lever_arm_m: Array) -> AngleStep:
    """Compare the planes pass by pass with this mount, and combine the deviations by weight.

    Each pass is compared alone. In one straight pass a yaw error turns the planes in a known direction, by the error
    times a factor, the *gain*: 0 < gain <= 1. For all passes together the direction is not certain.

    Parameters
    ----------
    passes
        Passes in which both sensors have P1, P2 and P3.
    rotation
        Correction of the coarse mount, Exp(δ) (3, 3).
    lever_arm_m
        Lever arm (3,), body axes.

    Raises
    ------
    DegenerateGeometryError
        There is no pass.
    """
    if not passes:
        raise DegenerateGeometryError("no pass has laser points and soundings on all of P1, P2 and P3")
    rows, weights, turns = [], [], []
    for pass_planes in passes:
        normals, weight = pass_normals(pass_planes, rotation, lever_arm_m)
        deviation = angle_deviations(normals, pass_planes.laser_normals)
        row = {f"deviation_{axis}_deg": float(np.degrees(deviation[k])) for k, axis in enumerate(AXES)}
        row |= patent_cosines(normals, pass_planes.laser_normals)
        between = angles_between(normals, pass_planes.laser_normals)
        row |= {f"angle_{name}_deg": float(np.degrees(angle)) for name, angle in between.items()}
        rows.append(row)
        weights.append(weight)
        turns.append(-mean_attitude(pass_planes.lifted) @ deviation)
    shares = np.array(weights) / np.sum(weights)
    combined = {name: float(shares @ [row[name] for row in rows]) for name in rows[0]}
    by_pass = [
        {"pass": pass_planes.number} | row | {"weight": float(share)}
        for pass_planes, row, share in zip(passes, rows, shares, strict=True)
    ]
    return AngleStep(shares @ np.array(turns), combined, by_pass)


@dataclass(frozen=True)
class AngleTolerances:
    """Limits that end the iteration: number of iterations, last step, last change of the angles between the normals."""

    max_iterations: int
    step_rad: float
    angle_rad: float


@dataclass(frozen=True)
class AngleResult:
    """Rotation vector (3,) rad of the correction, body axes, and the rows of all iterations, combined and by pass."""

    rotation_vector_rad: Array
    converged: bool
    iterations: int
    rows: list[dict[str, float]]
    pass_rows: list[dict[str, float]]


def iterate_angles(passes: Sequence[PassPlanes], lever_arm_m: Array, tolerances: AngleTolerances) -> AngleResult:
    """Correct the mount, place the soundings, compare the planes [0036], until the step and the angles stay the same.

    A yaw error turns the 45° faces of a straight pass by half of the error only (gain 1/2, see :func:`angle_step`). So
    one step removes about half of the error. No gain is assumed; enough iterations are allowed instead. With noise the
    angles between the normals end at the noise, not at zero.

    Parameters
    ----------
    passes
        Passes in which both sensors have P1, P2 and P3.
    lever_arm_m
        Lever arm (3,), body axes; it is not changed.
    tolerances
        Limits that end the iteration.
    """
    rotation = np.eye(3)
    rows: list[dict[str, float]] = []
    pass_rows: list[dict[str, float]] = []
    previous = np.full(4, np.inf)
    converged = False
    for iteration in range(tolerances.max_iterations + 1):
        step = angle_step(passes, rotation, lever_arm_m)
        angles = np.radians([step.combined[f"angle_P{k}_deg"] for k in (1, 2, 3, 4)])
        step_rad = float(np.linalg.norm(step.correction_rad))
        vector = np.degrees(log_so3(rotation))
        rows.append(
            {"iteration": iteration}
            | step.combined
            | {"step_deg": float(np.degrees(step_rad))}
            | {f"rotation_{axis}_deg": float(vector[k]) for k, axis in enumerate("xyz")}
        )
        pass_rows += [{"iteration": iteration} | row for row in step.by_pass]
        converged = step_rad <= tolerances.step_rad
        converged &= bool(np.max(np.abs(angles - previous)) <= tolerances.angle_rad)
        if converged or iteration == tolerances.max_iterations:
            break
        previous = angles
        rotation = exp_so3(step.correction_rad) @ rotation
    return AngleResult(log_so3(rotation), converged, len(rows) - 1, rows, pass_rows)
