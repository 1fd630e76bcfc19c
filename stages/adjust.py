"""The rigorous solution: both sensors observe shared surfaces from one moving body; unknowns and their covariance."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline import artefacts, config
from pipeline.adjusting import Adjusted, adjust, noise_of
from pipeline.considered import considered_of
from pipeline.looking import Cells, look
from pipeline.maths.consistency import consistency_limit
from pipeline.maths.rotations import log_so3
from pipeline.maths.solution import Freed, freed, weakest_direction
from pipeline.maths.unknowns import NAMES, SIX
from pipeline.mounts import mount_of, target_of
from pipeline.observability import Seen, geometry_of
from pipeline.plan_settings import LaserFigures, MbesFigures, Pass, Plan
from pipeline.planning import Setting
from pipeline.residuals import bins_table, map_table
from pipeline.scene import scene_of
from pipeline.streams import Stream

Array = NDArray[np.float64]
COMMON_TO = {"laser": "ins_white", "mbes": "ping"}  # what the points of an epoch have in common
SHOWN = 100_000  # points of a sensor in the table residuals, at most


@dataclass(frozen=True)
class Config:
    target: config.Target
    segment: config.Segment
    adjust: config.Adjust
    ingest: config.Ingest
    as_built: config.AsBuilt
    ins: config.Ins
    laser: config.Laser
    mbes: config.Mbes


@dataclass(frozen=True)
class Inputs:
    files: Annotated[pd.DataFrame, artefacts.FILES]
    passes: Annotated[pd.DataFrame, artefacts.PASSES]
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
    geometry: Annotated[pd.DataFrame, artefacts.GEOMETRY]
    surfaces: Annotated[pd.DataFrame, artefacts.SURFACES]
    drift: Annotated[pd.DataFrame, artefacts.DRIFT]
    freed: Annotated[pd.DataFrame, artefacts.FREED]
    groups: Annotated[pd.DataFrame, artefacts.GROUPS]
    cells: Annotated[pd.DataFrame, artefacts.CELLS]
    summary: Annotated[pd.DataFrame, artefacts.ADJUST_SUMMARY]
    patterns: Annotated[pd.DataFrame, artefacts.PATTERNS]
    residuals: Annotated[pd.DataFrame, artefacts.RESIDUALS]
    residual_bins: Annotated[pd.DataFrame, artefacts.RESIDUAL_BINS]
    residual_map: Annotated[pd.DataFrame, artefacts.RESIDUAL_MAP]


def run(inputs: Inputs, config: Config) -> Outputs:
    settings = config.adjust
    given = (inputs.faces, inputs.poses, inputs.target_pose, inputs.planes)
    scene = scene_of(*given, config.ins, config.laser, config.mbes, config.as_built.faces)
    streams = {"laser": inputs.laser_labelled, "mbes": inputs.soundings_labelled}
    found = adjust(streams, scene, noise_of(config.ins), settings, config.ingest.max_gap_s)
    seen = look(streams, scene, found, settings.moment_s, settings.test_tolerance_m, SHOWN)
    sigmas = considered_of(found.state.names, config.laser, config.mbes, config.as_built)
    return Outputs(
        **_tables(found, seen.cells, sigmas, config),
        geometry=_geometry_table(found, seen.cells, inputs, config),
        drift=_drift_table(found, inputs.poses),
        cells=_cells_table(found, seen.cells),
        surfaces=_surfaces_table(found, seen.cells),
        patterns=seen.patterns,
        residuals=seen.residuals,
        residual_bins=bins_table(seen.residuals, inputs.faces),
        residual_map=map_table(seen.residuals, inputs.faces),
    )


def _tables(found: Adjusted, cells: Cells, considered: Array, config: Config) -> dict[str, pd.DataFrame]:
    coarse, state, solution = mount_of(config.mbes.mount), found.state, found.solution
    six = np.concatenate(
        [
            log_so3(state.R_body_from_mbes @ coarse.R_body_from_sensor.T),
            state.lever_arm_m - coarse.lever_arm_body_m,
        ]
    )
    shared = [value for surface in state.surfaces for value in (0.0, 0.0, surface.shift_m)]
    values = state.values_of_other()
    values[:SIX], values[state.shared] = six, shared
    random, total = solution.covariance, solution.total(considered)
    values = values[solution.free]
    if solution.deficiency:
        values[:SIX], random, total = np.nan, np.full_like(random, np.nan), np.full_like(total, np.nan)
    estimate = pd.DataFrame(
        {
            "unknown": [state.names[k] for k in solution.free],
            "value": values,
            "sigma": np.sqrt(np.diag(random)),
            "sigma_total": np.sqrt(np.diag(total)),
        }
    )
    return {
        "estimate": estimate,
        "covariance": _covariance_table(random[:SIX, :SIX], total[:SIX, :SIX]),
        "freed": _freed_table(found, considered),
        "groups": _groups_table(found),
        "summary": _summary_table(found, cells, config.adjust),
    }


def _summary_table(found: Adjusted, cells: Cells, settings: config.Adjust) -> pd.DataFrame:
    solution = found.solution
    statistic = float(sum(cell.normalised**2 for cell in cells.values()))
    limit = consistency_limit(len(cells), settings.test_level)
    reason = f"the data leave {solution.deficiency} direction(s) of the unknowns open" if solution.deficiency else ""
    counts = found.reading.counts.values()
    summary = {
        "converged": found.converged,
        "iterations": found.iterations,
        "observations": sum(one.count for one in counts),
        "redundancy": found.redundancy,
        "sigma0": float(np.sqrt(found.equations.squares / max(found.redundancy, 1.0))),
        "between": found.between.factor,
        "between_dof": found.between.free,
        "condition": solution.condition,
        "rank_deficiency": solution.deficiency,
        "weakest": "" if solution.deficiency else weakest_direction(solution.covariance[:SIX, :SIX]),
        "test_statistic": statistic,
        "test_dof": len(cells),
        "test_limit": limit,
        "test_passed": statistic <= limit,
        "reason": reason,
    }
    return pd.DataFrame([summary])


def _covariance_table(random: Array, total: Array) -> pd.DataFrame:
    sigma = np.sqrt(np.diag(random))
    return pd.DataFrame(
        {
            "row": np.repeat(NAMES, SIX),
            "column": np.tile(NAMES, SIX),
            "covariance": random.ravel(),
            "correlation": (random / np.outer(sigma, sigma)).ravel(),
            "covariance_total": total.ravel(),
        }
    )


def _geometry_table(found: Adjusted, cells: Cells, inputs: Inputs, config: Config) -> pd.DataFrame:
    """What the passes lack, and what would cure it."""
    passes = inputs.passes.set_index("pass").loc[sorted({number for sensor, _, number in cells if sensor == "mbes"})]
    rates = inputs.files.groupby("sensor")["rate_hz"].median()
    figures = Plan(passes=(Pass(distance_m=1.0),))
    plan = figures.model_copy(
        update={
            "ins_rate_hz": max(10.0, _or(rates["ins"], figures.ins_rate_hz)),
            "laser": LaserFigures(point_rate_hz=_or(rates["laser"], figures.laser.point_rate_hz)),
            "mbes": MbesFigures(ping_rate_hz=_or(rates["mbes"], figures.mbes.ping_rate_hz)),
        }
    )
    setting = Setting(
        target_of(config.target), found.state, plan, config.segment, config.ins, config.laser, config.mbes
    )
    families = [surface.family for surface in found.state.surfaces]
    soundings = dict.fromkeys(families, 0)
    for (sensor, surface, _), cell in cells.items():
        soundings[families[surface]] += cell.count if sensor == "mbes" else 0
    distances = [float(one) for one in passes["distance_m"] if np.isfinite(one)]
    usual = figures.passes[0]
    speed = _or(passes["speed_m_s"].abs().median(), usual.speed_m_s)
    swing = _or(passes["heading_swing_deg"].median() * np.sqrt(2), usual.heading_swing_deg)  # of a wave: its amplitude
    seen = Seen(distances, soundings, speed, swing)
    geometry = geometry_of(setting, seen, found.equations.normal, found.solution)
    rows = [("gap", words) for words in geometry.gaps] + ([("remedy", geometry.remedy)] if geometry.remedy else [])
    return pd.DataFrame(rows, columns=["kind", "words"])


def _or(measured: float, otherwise: float) -> float:
    """What the session had, where it tells; as a plan's figures may have it."""
    return float(np.clip(measured, 0.05, 1e7)) if np.isfinite(measured) else otherwise


def _freed_table(found: Adjusted, considered: Array) -> pd.DataFrame:
    """What is held, and what each of the six owes to it."""
    tests = {one.unknown: one for one in freed(found.equations.normal, found.equations.right, found.solution)}
    rows = []
    for place, number in enumerate(found.solution.held.tolist()):
        test = tests.get(number, Freed(number, np.nan, np.nan))
        effect = found.solution.sensitivity[:SIX, place] * considered[number]
        row: dict[str, Any] = {"unknown": found.state.names[number], "considered": considered[number]}
        row |= {"value": test.value, "sigma": test.sigma}
        rows.append(row | {f"effect_{name}": effect[k] for k, name in enumerate(NAMES)})
    return pd.DataFrame(rows)


def _surfaces_table(found: Adjusted, cells: Cells) -> pd.DataFrame:
    rows = []
    for k, surface in enumerate(found.state.surfaces):
        row: dict[str, Any] = {f"normal_{axis}_target_1": surface.normal[i] for i, axis in enumerate("xyz")}
        row |= {"family": surface.family, "distance_m": surface.distance_m}
        for sensor, name in (("laser", "laser_points"), ("mbes", "soundings")):
            row[name] = sum(cell.count for (s, number, _), cell in cells.items() if s == sensor and number == k)
        rows.append(row)
    return pd.DataFrame(rows)


def _drift_table(found: Adjusted, poses: pd.DataFrame) -> pd.DataFrame:
    knots, values = found.drift.knots, found.drift.values
    columns: dict[str, Any] = {"t_ns": poses["t_ns"].to_numpy()[knots.record]}
    columns |= {f"{axis}_target_m": values[:, k] for k, axis in enumerate("xyz")}
    turns = np.degrees(values[:, 3:])
    return pd.DataFrame(columns | {f"turn_{axis}_target_deg": turns[:, k] for k, axis in enumerate("xyz")})


def _groups_table(found: Adjusted) -> pd.DataFrame:
    rows: list[dict[str, Any]] = [
        {
            "group": name,
            "count": one.count,
            "variance_factor": found.weighting.factors[name],
            "scale": found.weighting.scales[name],
            "cut": one.cut,
            "reduced": one.reduced,
        }
        for name, one in found.reading.counts.items()
    ]
    for sensor, one in found.shared.items():
        row = {"group": COMMON_TO[sensor], "count": len(found.reading.sums[sensor])}
        rows.append(row | {"variance_factor": one.factor, "scale": np.nan, "cut": 0, "reduced": 0})
    return pd.DataFrame(rows)


def _cells_table(found: Adjusted, cells: Cells) -> pd.DataFrame:
    rows = [
        {
            "sensor": sensor,
            "family": found.state.surfaces[surface].family,
            "pass": number,
            "count": cell.count,
            "mean_m": cell.mean_m,
            "rms_m": cell.rms_m,
            "sigma_mean_m": cell.sigma_mean_m,
            "normalised": cell.normalised,
            "largest": cell.largest,
        }
        for (sensor, surface, number), cell in sorted(cells.items())
    ]
    return pd.DataFrame(rows, columns=[column.name for column in artefacts.CELLS.columns])
