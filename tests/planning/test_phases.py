"""Phases of the boat's unrest, of which each is a session that may come; where along the target the passes go by."""

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.planning import assessment
from pipeline.planning.prediction import PredictedPasses, predict
from tests.support.docks import DOCK
from tests.support.simulated import THIN, made

FIGURES: dict[str, Any] = {
    "laser": {"point_rate_hz": THIN["laser"]["point_rate_hz"]},
    "mbes": {"ping_rate_hz": THIN["mbes"]["ping_rate_hz"]},
}


def plan_of(*passes: dict[str, Any]) -> Plan:
    return parse(Plan, FIGURES | {"passes": list(passes)}, "plan")


NEAR, FAR = {"distance_m": 4.0}, {"distance_m": 8.0}


@pytest.fixture(scope="module")
def configs() -> tuple[PoolConfig, SessionConfig]:
    session = made({"track": {"distances_m": [4.0]}}, seed=2)
    return parse(PoolConfig, session.pool, "pool"), parse(SessionConfig, session.session, "session")


def test_the_covariance_is_the_mean_over_the_phases_of_the_unrest(configs: tuple[PoolConfig, SessionConfig]) -> None:
    """Each phase is a session that may come. The average normal matrix is none of them."""
    given = assessment.assess_plan(plan_of(NEAR, FAR), *configs).given
    free, known = np.ix_(given.solution.estimated, given.solution.estimated), given.solution.prior

    def of_noise(normal: np.ndarray) -> np.ndarray:
        C = np.linalg.inv(normal[free] + known)
        return np.asarray((C - C @ known @ C)[:6, :6])

    phases = [of_noise(normal) for normal in given.predicted.with_faces]
    np.testing.assert_allclose(given.random, np.mean(phases, axis=0), rtol=1e-3, atol=1e-11)  # but for the vague prior
    of_average = of_noise(np.mean(given.predicted.with_faces, axis=0))
    assert np.abs(np.diag(of_average) / np.diag(given.random) - 1).max() > 0.005


def test_what_a_phase_leaves_open_is_vague(
    configs: tuple[PoolConfig, SessionConfig], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one of four phases nothing is seen: a quarter of the sessions tell nothing, and no sigma says otherwise."""
    def without_one(*args: Any, **kwargs: Any) -> PredictedPasses:
        made = predict(*args, **kwargs)
        return replace(made, with_faces=(*made.with_faces[:-1], np.zeros_like(made.with_faces[0])))

    usual = assessment.assess_plan(plan_of(NEAR, FAR), *configs)
    monkeypatch.setattr(assessment, "predict", without_one)
    given = assessment.assess_plan(plan_of(NEAR, FAR), *configs).given
    assert usual.given.solution.deficiency == given.solution.deficiency == 0
    np.testing.assert_allclose(np.sqrt(np.diag(given.random)), 0.5, rtol=0.01)  # rad and m
    assert np.sqrt(np.diag(usual.given.random)).max() < 0.01


def test_passes_go_by_the_targets_middle_wherever_its_origin_stands() -> None:
    """The origin of a found target lies on its largest wall, which may be the last one."""
    session = made(copy.deepcopy(DOCK), {"track": {"distances_m": [4.0]}}, seed=2)
    totals = []
    short = {"distance_m": 7.0, "half_length_m": 3.0}
    for moved_m in (0.0, 7.0):
        pool = copy.deepcopy(session.pool)
        for face in pool["target"]["faces"].values():
            face["corners"] = [[x, y + moved_m, z] for x, y, z in face["corners"]]
        read = parse(PoolConfig, pool, "pool"), parse(SessionConfig, session.session, "session")
        totals.append(assessment.assess_plan(plan_of(NEAR, short), *read).given)
    # a pass whose middle is told goes by there
    elsewhere = assessment.assess_plan(plan_of(NEAR | {"middle_m": 3.0}, short), *read).given
    assert totals[1].seconds == pytest.approx(totals[0].seconds)
    np.testing.assert_allclose(totals[1].total, totals[0].total, rtol=1e-3, atol=1e-12)
    assert elsewhere.predicted.points[0]["mbes"].sum() < 0.9 * totals[1].predicted.points[0]["mbes"].sum()
    np.testing.assert_array_equal(elsewhere.predicted.points[1]["mbes"], totals[1].predicted.points[1]["mbes"])
