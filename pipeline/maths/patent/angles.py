"""The patent's angles [0101-0123]: how the MBES's planes deviate from the laser's, and the iteration over them.

Signs. With outward normals n1, n2, n3 (toward the vessel) and n4 = n1 x n2 (pointing down), to first order in a small
right-handed turn (α about x, β about y, γ about z) of the cloud in the target frame:

* the wall's normal (-1, 0, 0) gets the z component +β: roll deviation = change of its elevation;
* P3's normal turns about z by γ: yaw deviation = change of its azimuth, counter-clockwise +;
* n4 = (0, 0, -1) gets the y component +α: pitch deviation = its turn about x.

These are signed components, not the full angles between normals (which contain the other two axes and stop converging
at 0.01°), and no published sign rule is looked up: [0025] and [0113] contradict each other. The patent's cosines are
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
    """P4 = P1 x P2, unit; points down for the target's outward normals."""
    cross = np.cross(first, second)
    return np.asarray(cross / np.linalg.norm(cross))


def deviations(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> Array:
    """(pitch, roll, yaw) of the MBES's normals P1-P4 relative to the laser's, rad, signed as above; (3,)."""
    pitch = _angle(mbes["P4"][1], -mbes["P4"][2]) - _angle(laser["P4"][1], -laser["P4"][2])
    roll = np.arcsin(mbes["P2"][2]) - np.arcsin(laser["P2"][2])
    yaw = _angle(mbes["P3"][1], mbes["P3"][0]) - _angle(laser["P3"][1], laser["P3"][0])
    return np.array([_wrap(pitch), roll, _wrap(yaw)])


def _angle(sine: float, cosine: float) -> float:
    return float(np.arctan2(sine, cosine))


def _wrap(angle_rad: float) -> float:
    return float((angle_rad + np.pi) % (2 * np.pi) - np.pi)


def patent_cosines(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> dict[str, float]:
    """[0112-0117]: wall against (0, 0, 1); P3 against the laser's P2; P4 against the laser's P1."""
    against = {"roll": ("P2", np.array([0.0, 0.0, 1.0])), "yaw": ("P3", laser["P2"]), "pitch": ("P4", laser["P1"])}
    return {
        f"cosine_{axis}_{sensor}": float(normals[plane] @ direction)
        for axis, (plane, direction) in against.items()
        for sensor, normals in (("laser", laser), ("mbes", mbes))
    }


def angles_between(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> dict[str, float]:
    """Full angle between the sensors' normals of each plane, rad."""
    return {name: angle_between(mbes[name], laser[name]) for name in ("P1", "P2", "P3", "P4")}


@dataclass(frozen=True)
class PassPlanes:
    """One pass: lifted moments of the soundings by family (P1, P2, P3), the laser's normals P1-P4."""

    number: int
    lifted: Mapping[str, Array]
    laser_normals: Mapping[str, Array]


def pass_normals(one: PassPlanes, rotation: Array, lever_arm_m: Array) -> tuple[dict[str, Array], float]:
    """MBES normals P1-P4 with this mount, and the pass's weight: inverse variance of the normals for unit noise."""
    planes = {
        family: fit_plane(plane_moments(lifted, rotation, lever_arm_m), one.laser_normals[family])
        for family, lifted in one.lifted.items()
    }
    normals = {family: plane.normal for family, plane in planes.items()}
    return normals | {"P4": fourth_normal(normals["P1"], normals["P2"])}, 1.0 / sum(map(_spread, planes.values()))


def _spread(plane: Plane) -> float:
    return float(np.sum(1.0 / plane.eigenvalues_m2[1:]) / plane.count)


def mean_attitude(lifted: Mapping[str, Array]) -> Array:
    """Mean R_body_from_target over the soundings of a pass; (3, 3)."""
    total = sum((attitude_sum(moments) for moments in lifted.values()), np.zeros((3, 3)))
    count = sum(moments[-1, -1] for moments in lifted.values())
    return np.asarray(total.T / count)


@dataclass(frozen=True)
class Look:
    """What one look at all passes gives: the rotation (body) that would undo the deviations, and the rows to record."""

    correction_rad: Array
    combined: dict[str, float]
    by_pass: list[dict[str, float]]


def look(passes: Sequence[PassPlanes], rotation: Array, lever_arm_m: Array) -> Look:
    """Deviations pass by pass with this mount (Exp(δ) = ``rotation``, lever arm), combined by weight.

    Pass by pass, because one straight pass turns with a yaw error by a known sign (0 < gain <= 1), passes pooled need
    not.
    """
    if not passes:
        raise DegenerateGeometryError("no pass has laser points and soundings on all of P1, P2 and P3")
    rows, weights, turns = [], [], []
    for one in passes:
        normals, weight = pass_normals(one, rotation, lever_arm_m)
        deviation = deviations(normals, one.laser_normals)
        row = {f"deviation_{axis}_deg": float(np.degrees(deviation[k])) for k, axis in enumerate(AXES)}
        row |= patent_cosines(normals, one.laser_normals)
        between = angles_between(normals, one.laser_normals)
        row |= {f"angle_{name}_deg": float(np.degrees(angle)) for name, angle in between.items()}
        rows.append(row)
        weights.append(weight)
        turns.append(-mean_attitude(one.lifted) @ deviation)
    shares = np.array(weights) / np.sum(weights)
    combined = {name: float(shares @ [row[name] for row in rows]) for name in rows[0]}
    by_pass = [
        {"pass": one.number} | row | {"weight": float(share)}
        for one, row, share in zip(passes, rows, shares, strict=True)
    ]
    return Look(shares @ np.array(turns), combined, by_pass)


@dataclass(frozen=True)
class AngleResult:
    rotation_vector_rad: Array
    converged: bool
    iterations: int
    rows: list[dict[str, float]]
    pass_rows: list[dict[str, float]]


def iterate_angles(
    passes: Sequence[PassPlanes],
    lever_arm_m: Array,
    max_iterations: int,
    step_tolerance_rad: float,
    angle_tolerance_rad: float,
) -> AngleResult:
    """[0036]: correct, place again, compare again, until the step and the angles between the normals stand still.

    A yaw error turns a straight pass's 45° faces by half only, so the iteration closes about half of it per step: no
    gain is assumed, enough iterations are allowed. With noise the angles end at the noise, not at zero.
    """
    rotation = np.eye(3)
    rows: list[dict[str, float]] = []
    pass_rows: list[dict[str, float]] = []
    previous = np.full(4, np.inf)
    converged = False
    for iteration in range(max_iterations + 1):
        seen = look(passes, rotation, lever_arm_m)
        angles = np.radians([seen.combined[f"angle_P{k}_deg"] for k in (1, 2, 3, 4)])
        step = float(np.linalg.norm(seen.correction_rad))
        vector = np.degrees(log_so3(rotation))
        rows.append(
            {"iteration": iteration}
            | seen.combined
            | {"step_deg": float(np.degrees(step))}
            | {f"rotation_{axis}_deg": float(vector[k]) for k, axis in enumerate("xyz")}
        )
        pass_rows += [{"iteration": iteration} | row for row in seen.by_pass]
        converged = step <= step_tolerance_rad and bool(np.max(np.abs(angles - previous)) <= angle_tolerance_rad)
        if converged or iteration == max_iterations:
            break
        previous = angles
        rotation = exp_so3(seen.correction_rad) @ rotation
    return AngleResult(log_so3(rotation), converged, len(rows) - 1, rows, pass_rows)
