"""Simulated sessions calibrated in memory."""

import copy
import functools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from stages import ORDER
from stages.in_memory import calibrate_in_memory
from tests.support.effort import often

INS_HZ = often(100.0, 200.0)  # half the records are half the work of an adjustment
THIN: dict[str, Any] = {
    "ins": {"rate_hz": INS_HZ}, "laser": {"point_rate_hz": 4000.0}, "mbes": {"ping_rate_hz": 10.0}
}  # fmt: skip


QUIET: dict[str, Any] = {
    "ins": {
        "rate_hz": 200.0,  # without noise the poses between two records count
        "white": {"position_m": 0.0, "attitude_deg": 0.0},
    },
    "laser": {"outlier_share": 0.0, "water_return_share": 0.0, "range_sigma_m": 0.0, "angle_sigma_deg": 0.0},
    "mbes": {
        "point_beams": True,
        "corner_share": 0.0,
        "outlier_share": 0.0,
        "surface_share": 0.0,
        "range_sigma_m": 0.0,
        "angle_sigma_deg": 0.0,
    },
}


def merged(*parts: Mapping[str, Any]) -> dict[str, Any]:
    """Scenario dictionaries laid over each other, two levels deep."""
    total: dict[str, Any] = {}
    for part in parts:
        for key, value in part.items():
            total[key] = {**total.get(key, {}), **value} if isinstance(value, dict) else value
    return total


def made(*parts: Mapping[str, Any], seed: int = 1) -> SimulatedSession:
    """A thinned session; tests that ask for the same one get the same, and leave it as it is."""
    return _made(json.dumps(merged({"name": "test"}, THIN, *parts)), seed)


@functools.lru_cache(maxsize=4)
def _made(scenario: str, seed: int) -> SimulatedSession:
    return simulate_session(parse(Scenario, json.loads(scenario), "test"), seed)


def made_with_heads(
    *parts: Mapping[str, Any], mounts: Sequence[Mapping[str, float]], seed: int = 1
) -> SimulatedSession:
    """A thinned session of a sonar with a head for each of these mounts; not kept."""
    scenario = merged({"name": "test"}, THIN, *parts)
    scenario["mbes"] = [scenario["mbes"] | {"mount": dict(mount)} for mount in mounts]
    return simulate_session(parse(Scenario, scenario, "test"), seed)


def calibrated(
    session: SimulatedSession,
    until: str = "report",
    pool: Mapping[str, Any] | None = None,
    mount: Mapping[str, float] | None = None,
    raw: Mapping[str, Mapping[str, np.ndarray]] | None = None,
    laser: Mapping[str, float] | None = None,
    changed: Callable[[str, Any], Any] = lambda _, value: value,
    known: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Every artefact; ``pool``, ``mount`` and ``laser`` change the pool's target, the coarse sonar mount, and by how
    much the laser's mount is wrong; the stages of the artefacts in ``known`` are not run again."""
    settings, design = copy.deepcopy(session.session), copy.deepcopy(session.pool)
    if mount:
        settings["mbes"]["mount"].update(mount)
    for key, value in (laser or {}).items():
        settings["laser"]["mount"][key] += value
    for key, value in (pool or {}).items():
        design.setdefault(key, {}).update(value) if isinstance(value, dict) else design.update({key: value})
    columns = {**session.raw, **(raw or {})}
    return calibrate_in_memory(
        parse(SessionConfig, settings, "session"), parse(PoolConfig, design, "pool"), columns, until, changed, known
    )


def without_biases(session: SimulatedSession) -> SimulatedSession:
    """The session, with the target, the water, and all biases of ranges and of the transmitter known exactly."""
    survey = dict.fromkeys(("face_sigma_m", "offset_sigma_m", "angle_sigma_deg", "bow_sigma_m"), 0.0)
    of_ranges = ("range_bias_sigma_m", "incidence_bias_sigma_m", "level_bias_sigma_m")
    of_sonar = (*of_ranges, "projector_sigma_m", "sound_speed_gradient_sigma_1_s")
    heads = session.session["mbes"]
    exact = [head | dict.fromkeys(of_sonar, 0.0) for head in (heads if isinstance(heads, list) else [heads])]
    known = {
        "mbes": exact if isinstance(heads, list) else exact[0],
        "laser": session.session["laser"] | {"incidence_bias_sigma_m": 0.0},
    }
    return replace(
        session,
        session=session.session | known,
        pool=session.pool | {"as_built": survey},
    )


def through(last: str, artefacts: Mapping[str, Any]) -> dict[str, Any]:
    """The artefacts of the stages up to this one: for a calibration that differs from it later alone."""
    stages = ORDER[: ORDER.index(last) + 1]
    return {key: value for key, value in artefacts.items() if key.partition("/")[0] in stages}


def mount_within_its_sigmas(result: dict[str, Any], errors: np.ndarray, sigmas: float) -> bool:
    """Whether the errors (6,) in degrees and mm are below this many total sigmas."""
    sigma = np.sqrt(np.diag(result["mbes"]["covariance_total"])) * np.repeat([180 / np.pi, 1000.0], 3)
    return bool(np.all(np.abs(errors) < sigmas * sigma))
