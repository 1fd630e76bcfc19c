"""The rigorous solution: both sensors observe shared surfaces; six unknowns and the surfaces, with their covariance."""

import functools
import operator
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline import artefacts, config
from pipeline.fitted import ALL_PASSES, laser_planes
from pipeline.maths.adjustment import (
    COMMON,
    GROUPS,
    NAMES,
    LaserMoments,
    Rows,
    State,
    Sums,
    Surface,
    accumulate,
    laser_moments,
    laser_rows,
    sounding_rows,
)
from pipeline.maths.consistency import (
    Scores,
    cells_of,
    clustered_covariance,
    consistency_limit,
    merge_scores,
    scores_of,
)
from pipeline.maths.robust import scale_of
from pipeline.maths.rotations import log_so3
from pipeline.maths.solution import Solution, redundancies, solve, variance_factors, weakest_direction
from pipeline.maths.trajectory import Trajectory
from pipeline.mounts import mount_of
from pipeline.poses import trajectory_in_target
from pipeline.streams import Batch, Stream, xyz
from pipeline.times import NS

Array = NDArray[np.float64]
STEP_RAD, STEP_M = 1e-10, 1e-9  # a smaller step is none, whatever the sigma
STEP_SIGMAS = 1e-3  # nor is one smaller than this share of its sigma
ROUGH_STEP = 1e-3  # weights become robust when the step is smaller (rad, m)
RESCALINGS = 2  # how often the groups' robust scales are then taken anew


@dataclass(frozen=True)
class Config:
    adjust: config.Adjust
    laser: config.Laser
    mbes: config.Mbes


@dataclass(frozen=True)
class Inputs:
    faces: Annotated[pd.DataFrame, artefacts.FACES]
    poses: Annotated[pd.DataFrame, artefacts.POSES]
    target_pose: Annotated[pd.DataFrame, artefacts.TARGET_POSE]
    planes: Annotated[pd.DataFrame, artefacts.PLANES]
    laser_labelled: Annotated[Stream, artefacts.LASER_LABELLED]
    soundings_labelled: Annotated[Stream, artefacts.SOUNDINGS_LABELLED]


@dataclass(frozen=True)
class Outputs:
    estimate: Annotated[pd.DataFrame, artefacts.ESTIMATE]
    covariance: Annotated[pd.DataFrame, artefacts.COVARIANCE]
    surfaces: Annotated[pd.DataFrame, artefacts.SURFACES]
    groups: Annotated[pd.DataFrame, artefacts.GROUPS]
    cells: Annotated[pd.DataFrame, artefacts.CELLS]
    summary: Annotated[pd.DataFrame, artefacts.ADJUST_SUMMARY]


@dataclass(frozen=True)
class Scene:
    """What turns a batch into observations: poses, the surface and design height of each face, sigmas."""

    trajectory: Trajectory
    surface_of_face: NDArray[np.int64]
    height_of_face: Array
    config: Config

    def _heights(self, face: NDArray[np.int16], state: State) -> Array:
        """What brings the points on all horizontal faces into one plane, (n, 3) m."""
        (normal,) = (surface.normal for surface in state.surfaces if surface.family == "H")
        return self.height_of_face[face][:, None] * normal

    def laser(self, batch: Batch, state: State) -> tuple[Rows, Array]:
        face, laser = batch["face"], self.config.laser
        points = xyz(batch, "target_m")
        points -= self._heights(face, state)
        ranges = np.sqrt(batch["x_laser_m"] ** 2 + batch["y_laser_m"] ** 2 + batch["z_laser_m"] ** 2)
        sigmas = (laser.range_sigma_m, np.radians(laser.angle_sigma_deg))
        return laser_rows(state, self.surface_of_face[face], points, ranges, batch["cos_incidence"], *sigmas), points

    def soundings(self, batch: Batch, state: State) -> Rows:
        face, mbes = batch["face"], self.config.mbes
        positions, R_target_from_body = self.trajectory.poses_at(batch["t_ns"])
        positions -= self._heights(face, state)
        points = xyz(batch, "mbes_m")
        sigmas = (mbes.range_sigma_m, np.radians(mbes.angle_sigma_deg))
        return sounding_rows(state, self.surface_of_face[face], points, positions, R_target_from_body, *sigmas)


def _laser_moments(batch: Batch, scene: Scene, state: State) -> LaserMoments:
    rows, points = scene.laser(batch, state)
    return laser_moments(state, rows, points)


def _sounding_sums(batch: Batch, scene: Scene, state: State) -> Sums:
    return accumulate(state, scene.soundings(batch, state))


def _scores(batch: Batch, scene: Scene, state: State, sensor: str) -> Scores:
    rows = scene.laser(batch, state)[0] if sensor == "laser" else scene.soundings(batch, state)
    moment = batch["t_ns"] // round(scene.config.adjust.moment_s * NS)
    return scores_of(state, rows, sensor, batch["pass"].astype(np.int64), moment)


def run(inputs: Inputs, config: Config) -> Outputs:
    scene, state = _start(inputs, config)
    settings = config.adjust
    laser = _sum(inputs.laser_labelled.fold(_laser_moments, scene, state))
    converged, iterations, rescaled = False, 0, 0
    while True:
        sums = laser.sums(state) + _sum(inputs.soundings_labelled.fold(_sounding_sums, scene, state))
        solution = solve(sums)
        if converged or solution.deficiency or iterations == settings.max_iterations:
            break
        factors = variance_factors(sums, solution.inverse, state.factors)
        settled = all(abs(factors[name] / state.factors[name] - 1) < 1e-3 for name in GROUPS)
        converged = rescaled == RESCALINGS and settled and _negligible(solution)
        state = replace(state.moved(solution.step), factors=factors if rescaled else state.factors)
        iterations += 1
        if rescaled < RESCALINGS and np.max(np.abs(solution.step[:COMMON])) < ROUGH_STEP:
            rescaled += 1  # then the scales stay: weights that follow them for ever need not come to rest
            scales = {name: scale_of(group.histogram) for name, group in sums.groups.items()}
            state = replace(state, robust=(settings.robust_k0, settings.robust_k1), scales={**state.scales, **scales})
            laser = _sum(inputs.laser_labelled.fold(_laser_moments, scene, state))
    scores = merge_scores(
        chain(
            inputs.laser_labelled.fold(_scores, scene, state, "laser"),
            inputs.soundings_labelled.fold(_scores, scene, state, "mbes"),
        )
    )
    return _outputs(state, sums, solution, scores, converged, iterations, config)


def _negligible(solution: Solution) -> bool:
    """Whether the six's step is far below their sigmas, or below anything that matters."""
    sigma = np.sqrt(np.diag(solution.inverse))[:COMMON]
    floor = np.repeat([STEP_RAD, STEP_M], 3)
    return bool(np.all(np.abs(solution.step[:COMMON]) <= np.maximum(STEP_SIGMAS * sigma, floor)))


def _sum(pieces: Iterator[Any]) -> Any:
    return functools.reduce(operator.add, pieces)


def _start(inputs: Inputs, config: Config) -> tuple[Scene, State]:
    """Coarse mount, and the laser's planes as surfaces; the horizontal faces level at their design heights."""
    faces, mount = inputs.faces, mount_of(config.mbes.mount)
    laser = laser_planes(inputs.planes)
    surfaces = []
    for family in ("P1", "P2", "P3"):
        rows = faces[faces["family"] == family]
        plane = laser.get((ALL_PASSES, family))
        if plane is not None:
            surfaces.append(Surface(family, plane.normal, plane.centroid_m, 0.0))
        elif len(rows):
            first = rows.iloc[0]
            normal = np.array([first[f"normal_{axis}_target_1"] for axis in "xyz"], dtype=np.float64)
            surfaces.append(Surface(family, normal, normal * float(first["distance_m"]), 0.0))
    horizontal = faces[faces["family"] == "H"]
    corners = np.concatenate([np.reshape(corner, (-1, 3)) for corner in horizontal["vertices_target_m"]])
    centre = np.array([corners[:, 0].mean(), 0.0, 0.0])
    surfaces.append(Surface("H", np.array([0.0, 0.0, 1.0]), centre, 0.0))
    number = {surface.family: k for k, surface in enumerate(surfaces)}
    heights = np.where(faces["family"] == "H", faces["distance_m"] * faces["normal_z_target_1"], 0.0)
    scene = Scene(
        trajectory_in_target(inputs.poses, inputs.target_pose),
        np.array([number[family] for family in faces["family"]]),
        heights,
        config,
    )
    return scene, State(mount.R_body_from_sensor, mount.lever_arm_body_m, tuple(surfaces))


def _outputs(
    state: State, sums: Sums, solution: Solution, scores: Scores, converged: bool, iterations: int, config: Config
) -> Outputs:
    coarse = mount_of(config.mbes.mount)
    six = np.concatenate(
        [
            log_so3(state.R_body_from_mbes @ coarse.R_body_from_sensor.T),
            state.lever_arm_m - coarse.lever_arm_body_m,
        ]
    )
    formal = solution.inverse
    clustered = clustered_covariance(formal, scores)
    covariance = formal if clustered is None else clustered
    if solution.deficiency:
        six, covariance, formal = np.full(6, np.nan), np.full_like(formal, np.nan), np.full_like(formal, np.nan)
    names = list(NAMES) + [f"{s.family}_{name}" for s in state.surfaces for name in ("turn_1", "turn_2", "shift")]
    estimate = pd.DataFrame(
        {
            "unknown": names,
            "value": np.concatenate([six, [v for s in state.surfaces for v in (0.0, 0.0, s.shift_m)]]),
            "sigma": np.sqrt(np.diag(covariance)),
            "sigma_formal": np.sqrt(np.diag(formal)),
        }
    )
    free = redundancies(sums, solution.inverse)
    cells = cells_of(scores, config.adjust.test_tolerance_m)
    statistic = float(sum(cell.normalised**2 for cell in cells.values()))
    limit = consistency_limit(len(cells), config.adjust.test_level)
    observations = sum(group.count for group in sums.groups.values())
    reason = f"the data leave {solution.deficiency} direction(s) of the unknowns open" if solution.deficiency else ""
    summary = {
        "converged": converged,
        "iterations": iterations,
        "observations": observations,
        "redundancy": sum(free.values()),
        "sigma0": float(np.sqrt(sum(group.squares for group in sums.groups.values()) / max(sum(free.values()), 1.0))),
        "condition": solution.condition,
        "rank_deficiency": solution.deficiency,
        "weakest": "" if solution.deficiency else weakest_direction(covariance[:COMMON, :COMMON]),
        "test_statistic": statistic,
        "test_dof": len(cells),
        "test_limit": limit,
        "test_passed": statistic <= limit,
        "reason": reason,
    }
    return Outputs(
        estimate,
        _covariance_table(covariance[:COMMON, :COMMON]),
        _surfaces_table(state, cells),
        _groups_table(sums, free),
        _cells_table(state, cells),
        pd.DataFrame([summary]),
    )


def _covariance_table(covariance: Array) -> pd.DataFrame:
    sigma = np.sqrt(np.diag(covariance))
    return pd.DataFrame(
        {
            "row": np.repeat(NAMES, COMMON),
            "column": np.tile(NAMES, COMMON),
            "covariance": covariance.ravel(),
            "correlation": (covariance / np.outer(sigma, sigma)).ravel(),
        }
    )


def _surfaces_table(state: State, cells: dict[Any, Any]) -> pd.DataFrame:
    rows = []
    for k, surface in enumerate(state.surfaces):
        row: dict[str, Any] = {f"normal_{axis}_target_1": surface.normal[i] for i, axis in enumerate("xyz")}
        row |= {"family": surface.family, "distance_m": float(surface.normal @ surface.centre_m + surface.shift_m)}
        for sensor, name in (("laser", "laser_points"), ("mbes", "soundings")):
            row[name] = sum(cell.count for (s, number, _), cell in cells.items() if s == sensor and number == k)
        rows.append(row)
    return pd.DataFrame(rows)


def _groups_table(sums: Sums, free: dict[str, float]) -> pd.DataFrame:
    rows = [
        {
            "group": name,
            "count": group.count,
            "redundancy": free[name],
            "variance_factor": group.squares / max(free[name], 1.0),
            "rms_normalised": float(np.sqrt(group.squares / max(group.weights, 1.0))),
            "cut": group.cut,
            "reduced": group.reduced,
        }
        for name, group in sums.groups.items()
    ]
    return pd.DataFrame(rows)


def _cells_table(state: State, cells: dict[Any, Any]) -> pd.DataFrame:
    rows = [
        {
            "sensor": sensor,
            "family": state.surfaces[surface].family,
            "pass": number,
            "count": cell.count,
            "mean_m": cell.mean_m,
            "rms_m": cell.rms_m,
            "sigma_mean_m": cell.sigma_mean_m,
            "normalised": cell.normalised,
        }
        for (sensor, surface, number), cell in cells.items()
    ]
    return pd.DataFrame(rows, columns=[column.name for column in artefacts.CELLS.columns])
