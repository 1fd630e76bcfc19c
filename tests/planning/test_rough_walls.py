"""Roughness of wet faces that is stated beforehand: its law against an integral, and a plan against a session."""

import copy
import json
from typing import Any

import numpy as np
import pytest

from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.maths.adjustment.roughness import expected_roughness
from pipeline.planning.assessment import assess_plan
from pipeline.planning.plan_document import plan_document
from tests.support.docks import DOCK
from tests.support.simulated import THIN, calibrated, made

SETTINGS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")
DISTANCES = (4.0, 6.0, 5.0, 7.0)
UNSURVEYED: dict[str, Any] = {"offset_sigma_m": 0.02, "angle_sigma_deg": 0.1, "bow_sigma_m": 0.005}


def test_it_is_the_variance_of_the_mean_over_a_rough_face() -> None:
    """By the double integral of the correlation over a face of 6 m by 4 m, on a grid; its edges count for little."""
    width, height, rms, length, weight, step = 6.0, 4.0, 0.01, 0.3, 4e6, 0.1
    y, z = (np.arange(step / 2, extent, step) for extent in (width, height))
    alike = [np.exp(-((each[:, None] - each) ** 2) / 2 / length**2).mean() for each in (y, z)]
    of_mean = rms**2 * alike[0] * alike[1]
    added = expected_roughness(np.array([weight, weight]), np.array([width * height, 0.0]), rms, length)
    assert added[0] == pytest.approx(weight * of_mean, rel=0.15)
    assert added[0] > weight * of_mean  # all of ∫ C counts, though some of it lies beyond the edges
    assert added[1] == 0.0


@pytest.fixture(scope="module")
def overgrown() -> tuple[Any, dict[str, Any]]:
    """A session at a dock whose growth varies by 8 mm over 0.3 m, and the adjustment's block."""
    rough = {"fouling_m": 0.03, "fouling_sigma_m": 0.008, "unevenness_length_m": 0.3, "back_wall": False}
    session = made(copy.deepcopy(DOCK), {"track": {"distances_m": list(DISTANCES)}, "surroundings": rough}, seed=6)
    found = calibrated(session, pool={"as_built": UNSURVEYED | {"growth_sigma_m": 0.03}})
    return session, json.loads(found["report/calibration.json"])["methods"]["adjustment"]


def planned(
    session: Any, kind: str = "sigma_mount", distances: tuple[float, ...] = DISTANCES, **rough: float
) -> dict[str, float]:
    pool = session.pool | {"as_built": UNSURVEYED | {"growth_sigma_m": 0.03} | rough}
    content = {
        "laser": {"point_rate_hz": THIN["laser"]["point_rate_hz"]},
        "mbes": {"ping_rate_hz": THIN["mbes"]["ping_rate_hz"]},
        "passes": [{"distance_m": distance} for distance in distances],
    }
    configs = parse(PoolConfig, pool, "pool"), parse(SessionConfig, session.session, "session")
    return plan_document(assess_plan(parse(Plan, content, "plan"), *configs))["given"][kind]


def test_a_plan_that_knows_of_it_predicts_the_sigmas(overgrown: tuple[Any, dict[str, Any]]) -> None:
    session, result = overgrown
    rough, smooth = planned(session, roughness_m=0.008, roughness_length_m=0.3), planned(session)
    ratios, before = (
        np.array([result["sigma_mount"][name] / predicted[name] for name in SETTINGS]) for predicted in (rough, smooth)
    )
    assert np.exp(np.mean(np.log(ratios))) == pytest.approx(1.0, abs=0.3)
    assert np.exp(np.mean(np.log(before))) > 2


def test_rough_dry_faces_count_as_rough_wet_ones_do() -> None:
    """The laser sees a wall of stones as rough as the sonar does: each makes the total sigmas larger, both more."""
    distances = DISTANCES[:2]
    session = made(copy.deepcopy(DOCK), {"track": {"distances_m": list(distances)}}, seed=6)
    rough = {"roughness_m": 0.004, "dry_roughness_m": 0.004}
    smooth, wet, dry, both = (
        np.array(list(planned(session, "sigma_mount_total", distances, **one).values()))
        for one in ({}, {"roughness_m": 0.004}, {"dry_roughness_m": 0.004}, rough)
    )
    assert np.all(wet > smooth)
    assert np.all(dry > smooth)
    assert np.all(both > np.maximum(wet, dry))
