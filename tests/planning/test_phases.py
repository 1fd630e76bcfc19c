"""Phases of the boat's unrest, of which each is a session that may come; where along the target the passes go by."""

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.planning import assessment, observability
from pipeline.planning.assessment import Accuracy
from pipeline.planning.prediction import PredictedPasses, planned_track, predict
from pipeline.planning.setting import setting_of
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


@pytest.fixture(scope="module")
def given(configs: tuple[PoolConfig, SessionConfig]) -> Accuracy:
    return assessment.assess_plan(plan_of(NEAR, FAR), *configs).given


def test_the_covariance_is_the_mean_over_the_phases_of_the_unrest(given: Accuracy) -> None:
    """Each phase is a session that may come. The average normal matrix is none of them."""
    free, known = np.ix_(given.solution.estimated, given.solution.estimated), given.solution.prior

    def of_noise(normal: np.ndarray) -> np.ndarray:
        C = np.linalg.inv(normal[free] + known)
        return np.asarray((C - C @ known @ C)[:6, :6])

    phases = [of_noise(normal) for normal in given.predicted.normals]
    np.testing.assert_allclose(given.random, np.mean(phases, axis=0), rtol=1e-3, atol=1e-11)  # but for the vague prior
    of_average = of_noise(given.predicted.normal)
    assert np.abs(np.diag(of_average) / np.diag(given.random) - 1).max() > 0.005


Planned = Callable[[Callable[[np.ndarray], np.ndarray]], Accuracy]


@pytest.fixture
def with_last_phase(
    given: Accuracy, configs: tuple[PoolConfig, SessionConfig], monkeypatch: pytest.MonkeyPatch
) -> Planned:
    """The same plan, if the normal matrix of the last phase were another one."""

    def planned(changed: Callable[[np.ndarray], np.ndarray]) -> Accuracy:
        of_phases = (*given.predicted.normals[:-1], changed(given.predicted.normals[-1]))
        monkeypatch.setattr(assessment, "predict", lambda *_, **__: replace(given.predicted, normals=of_phases))
        return assessment.assess_plan(plan_of(NEAR, FAR), *configs).given

    return planned


def test_a_plane_that_one_phase_does_not_show_is_vague_there(
    given: Accuracy, configs: tuple[PoolConfig, SessionConfig], with_last_phase: Planned
) -> None:
    """The other phases' mount, and that of the other planes in this one, are known all the same."""
    state = setting_of(plan_of(NEAR, FAR), *configs).state

    def without_tops(normal: np.ndarray) -> np.ndarray:
        seen = np.ones(len(normal))
        seen[state.surface_slice][-1] = 0.0
        return normal * np.outer(seen, seen)

    without = with_last_phase(without_tops)
    assert without.solution.deficiency == 0
    np.testing.assert_allclose(np.diag(without.random), np.diag(given.random), rtol=0.2)


def test_a_phase_that_leaves_the_mount_open_leaves_the_plan_without_a_result(with_last_phase: Planned) -> None:
    """A quarter of the sessions would tell nothing."""
    without = with_last_phase(np.zeros_like)
    assert without.solution.deficiency >= 6
    assert np.all(np.isnan(without.total))


def test_no_passes_are_advised_after_which_a_plane_is_still_open(
    given: Accuracy, configs: tuple[PoolConfig, SessionConfig], monkeypatch: pytest.MonkeyPatch
) -> None:
    """They would leave the plan without a result, however well the other planes told the mount."""
    tops = setting_of(plan_of(NEAR, FAR), *configs).state.surface_slice.stop - 1

    def advised(*hidden: int) -> str:
        def seen(predicted: PredictedPasses, share: float) -> PredictedPasses:
            shown = np.ones(len(predicted.normals[0]))
            shown[list(hidden)] = 0.0
            return replace(predicted, normals=tuple(share * one * np.outer(shown, shown) for one in predicted.normals))

        poor = seen(given.predicted, 1e-4)  # sigmas a hundred times as large
        monkeypatch.setattr(assessment, "predict", lambda *_, **__: poor)
        monkeypatch.setattr(observability, "predict", lambda *passes, **named: seen(predict(*passes, **named), 1.0))
        plan = assessment.assess_plan(plan_of(NEAR, FAR), *configs)
        assert plan.given.solution.deficiency == len(hidden)
        return plan.remedy

    assert advised().startswith("two more passes at")
    assert not advised(tops)


def test_passes_go_by_the_targets_middle_wherever_its_origin_stands() -> None:
    """The origin of a found target lies on its largest wall, which may be the last one."""
    session = made(copy.deepcopy(DOCK), {"track": {"distances_m": [4.0]}}, seed=2)
    settings, short = parse(SessionConfig, session.session, "session"), {"distance_m": 7.0, "half_length_m": 3.0}
    predicted = []
    for moved_m in (0.0, 7.0):
        content = copy.deepcopy(session.pool)
        for face in content["target"]["faces"].values():
            face["corners"] = [[x, y + moved_m, z] for x, y, z in face["corners"]]
        pool = parse(PoolConfig, content, "pool")
        setting = setting_of(plan_of(NEAR, short), pool, settings)
        predicted.append(predict(setting, setting.plan.passes, phases=1))
    assert predicted[1].seconds == pytest.approx(predicted[0].seconds)
    for first, second in zip(*(one.points for one in predicted), strict=True):
        np.testing.assert_allclose(second["mbes"], first["mbes"], rtol=0.01)


def test_a_pass_may_tell_its_middle(configs: tuple[PoolConfig, SessionConfig]) -> None:
    """Along the target's y on either course; 0 is the origin."""
    passes = [NEAR | {"middle_m": at, "course": course} for at in (3.0, 0.0) for course in ("along", "back")]
    setting = setting_of(plan_of(*passes), *configs)
    tracks = [planned_track(setting, one, 0)[:, 1] for one in setting.plan.passes]
    np.testing.assert_allclose([track.mean() for track in tracks], [3.0, 3.0, 0.0, 0.0], atol=0.01)
    np.testing.assert_allclose(tracks[1][::-1], tracks[0], atol=0.01)
    assert [one.where for one in setting.plan.passes[:2]] == ["4.0 m at y = 3 m", "4.0 m back at y = 3 m"]
