"""The patent's angles [0101-0123]: how the MBES's planes deviate from the laser's, and the iteration over them.

Signs. With outward normals n1, n2, n3 (toward the vessel) and n4 = n1 x n2 (pointing down), to first order in a small
right-handed turn (α about x, β about y, γ about z) of the cloud in the target frame:

* the wall's normal (-1, 0, 0) gets the z component +β: roll deviation = change of its elevation;
* P3's normal turns about z by γ: yaw deviation = change of its azimuth, counter-clockwise +;
* n4 = (0, 0, -1) gets the y component +α: pitch deviation = its turn about x.

These are signed components, not the full angles between normals (which contain the other two axes and stop converging
at 0.01°), and they follow no published sign rule: [0025] and [0113] contradict each other. The patent's cosines are
recorded beside them. The correction is minus the deviation, turned into the body frame by the mean attitude, and
composed (not added) onto the rotation so far.
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
    """Return (pitch, roll, yaw) (3,) rad of the MBES's normals P1-P4 relative to the laser's, signed as above."""
    pitch = _angle(mbes["P4"][1], -mbes["P4"][2]) - _angle(laser["P4"][1], -laser["P4"][2])
    roll = np.arcsin(mbes["P2"][2]) - np.arcsin(laser["P2"][2])
    yaw = _angle(mbes["P3"][1], mbes["P3"][0]) - _angle(laser["P3"][1], laser["P3"][0])
    return np.array([_wrap(pitch), roll, _wrap(yaw)])


def _angle(sine: float, cosine: float) -> float:
    return float(np.arctan2(sine, cosine))


def _wrap(angle_rad: float) -> float:
    return float((angle_rad + np.pi) % (2 * np.pi) - np.pi)


def patent_cosines(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> dict[str, float]:
    """Return the cosines of [0112-0117].

    The wall against (0, 0, 1); P3 against the laser's P2; P4 against the laser's P1.
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
    """Return the MBES's normals P1-P4 of a pass, and its weight: inverse variance of the normals for unit noise.

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
    """Return the mean R_body_from_target (3, 3) over the soundings whose moments by family are ``lifted``."""
    total = sum((attitude_sum(moments) for moments in lifted.values()), np.zeros((3, 3)))
    count = sum(moments[-1, -1] for moments in lifted.values())
    return np.asarray(total.T / count)


@dataclass(frozen=True)
class AngleStep:
    """One comparison of all passes: the rotation (body) that would undo the deviations, and the rows to record."""

    correction_rad: Array
    combined: dict[str, float]
    by_pass: list[dict[str, float]]


def angle_step(passes: Sequence[PassPlanes], rotation: Array, lever_arm_m: Array) -> AngleStep:
    """Compare the planes pass by pass with this mount, and combine the deviations by weight.

    Pass by pass, because one straight pass turns with a yaw error by a known sign (0 < gain <= 1), passes pooled need
    not.

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
    """When the iteration ends: most iterations, largest last step, largest last change of the normals' angles."""

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
    """Correct, place again, compare again [0036], until the step and the angles between the normals stand still.

    A yaw error turns a straight pass's 45° faces by half only, so the iteration closes about half of it per step: no
    gain is assumed, enough iterations are allowed. With noise the angles end at the noise, not at zero.

    Parameters
    ----------
    passes
        Passes in which both sensors have P1, P2 and P3.
    lever_arm_m
        Lever arm (3,), body axes; it stays.
    tolerances
        When the iteration ends.
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
