"""A plan's prediction: against the adjustment of a simulated session of the same plan, and what it says and chooses."""

import copy
import json
import re
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import Drift, SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.planning import assessment
from pipeline.planning.assessment import shares_of_limits
from pipeline.planning.plan_document import plan_document
from pipeline.planning.planned_rays import sonar_rays
from pipeline.planning.prediction import predict
from pipeline.planning.setting import setting_of
from pipeline.simulation.beams import directions_in_mbes, swing_rad
from stages.commands.plan import table
from tests.support.effort import often
from tests.support.places import poolcal
from tests.support.simulated import THIN, calibrated, made

SETTINGS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")
FIGURES: dict[str, Any] = {
    "laser": {"point_rate_hz": THIN["laser"]["point_rate_hz"]},
    "mbes": {"ping_rate_hz": THIN["mbes"]["ping_rate_hz"]},
}
DRIFT = {"horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03}


def plan_of(*distances: float, **more: Any) -> Plan:
    return parse(Plan, FIGURES | {"passes": [{"distance_m": d} for d in distances]} | more, "plan")


@pytest.fixture(scope="module")
def configs() -> tuple[PoolConfig, SessionConfig]:
    session = made({"track": {"distances_m": [4.0]}}, seed=2)
    return parse(PoolConfig, session.pool, "pool"), parse(SessionConfig, session.session, "session")


@pytest.mark.parametrize("drift", often([{"ins": {"drift": DRIFT}}], [{}, {"ins": {"drift": DRIFT}}]))
def test_sigmas_are_those_of_the_adjustment_on_a_session_of_the_same_plan(drift: dict[str, Any]) -> None:
    distances = (4.0, 8.0, 5.0, 7.0)
    track = {"track": {"distances_m": list(distances)}, "mbes": {"coarse_angle_deg": 0.1}}
    session = copy.deepcopy(made(track, {"ins": {"rate_hz": 200.0}}, drift, seed=6))
    exact = {"drift_within": {"sigmas": 1.0, "time_constant": 1.0}}  # no plan knows what the data will say of the drift
    session.session["ins"] |= exact
    result = json.loads(calibrated(session)["report/calibration.json"])["methods"]["adjustment"]
    pool, settings = parse(PoolConfig, session.pool, "pool"), parse(SessionConfig, session.session, "session")
    answer = assessment.assess_plan(plan_of(*distances), pool, settings)
    found = plan_document(answer)["given"]
    for key in ("sigma_mount", "sigma_mount_total"):
        ratio = [found[key][name] / result[key][name] for name in SETTINGS]
        assert max(abs(np.log(ratio))) < np.log(1.15), (key, dict(zip(SETTINGS, ratio, strict=True)))
    assert (answer.gaps, answer.remedy, answer.better) == ([], "", None)


def test_the_beams_of_a_plan_are_those_of_its_sectors(configs: tuple[PoolConfig, SessionConfig]) -> None:
    """Against the simulator's; where a beam and its fan do not meet there is none."""
    edges = ((-29.5, 8.0), (20.5, -0.75), (90.0, -29.5))
    figures = {
        "sectors": [{"to_deg": to, "tilt_deg": tilt} for to, tilt in edges], "beams": 131, "ping_rate_hz": 10.0,
    }  # fmt: skip
    rays, _ = sonar_rays(setting_of(plan_of(4.0, mbes=figures), *configs), 0.15)
    angles_deg = np.arange(-65.0, 66.0)
    tilts = np.radians(np.select([angles_deg <= -30, angles_deg <= 20], [8.0, -0.75], -29.5))
    swing, there = swing_rad(np.sin(np.radians(angles_deg)), tilts)
    assert there.sum() == 131 - 5  # 61° and 29.5° are more than 90°
    np.testing.assert_allclose(rays.directions, directions_in_mbes(swing, tilts)[there], atol=1e-9)


def test_the_lasers_mount_covariance_is_carried_into_the_total(
    configs: tuple[PoolConfig, SessionConfig], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six errors that are one, a turn about the INS with the lever arm's share of it, are no more than they are."""
    monkeypatch.setattr(assessment, "predict", partial(predict, phases=1))  # each phase has a direction of its own
    pool, session = configs
    turn = np.r_[0.0, 0.0, 1e-3, np.cross([0.0, 0.0, 1e-3], [0.21, 0.48, 1.1])]
    totals = {}
    for name, matrix in (("one", np.outer(turn, turn)), ("apart", np.diag(turn**2)), ("none", np.zeros((6, 6)))):
        laser = session.laser.model_copy(update={"mount_covariance": tuple(map(tuple, matrix.tolist()))})
        changed = session.model_copy(update={"laser": laser})
        totals[name] = assessment.assess_plan(plan_of(4.0, 8.0), pool, changed).given.total
    added = totals["one"] - totals["none"]
    assert np.linalg.matrix_rank(added, tol=1e-6 * np.abs(added).max()) == 1
    assert np.linalg.matrix_rank(totals["apart"] - totals["none"], tol=1e-6 * np.abs(added).max()) == 3
    assert added[2, 2] > 1e-8


def test_usable_points_are_those_that_segment_labels(configs: tuple[PoolConfig, SessionConfig]) -> None:
    session = made({"track": {"distances_m": [4.0]}}, seed=2)
    found = calibrated(session, "segment")
    answer = assessment.assess_plan(plan_of(4.0), *configs)
    for sensor, stream in (("laser", "laser_labelled"), ("mbes", "soundings_labelled")):
        faces = np.concatenate([part.columns["face"] for part in found[f"segment/{stream}"].parts])
        labelled = np.bincount(faces, minlength=len(answer.setting.model.faces))
        expected = answer.given.predicted.points[0][sensor]
        assert np.all((expected > 0) >= (labelled > 60))
        many = labelled > 400
        np.testing.assert_allclose(expected[many], labelled[many], rtol=0.25)  # how it heads past a block is chance


def test_without_drift_passes_add_up_and_with_it_two_tell_more(configs: tuple[PoolConfig, SessionConfig]) -> None:
    """The drift goes on from one pass to the next: together they know more of it than each alone."""
    pool, still = configs
    drifting = still.model_copy(update={"ins": still.ins.model_copy(update={"drift": Drift()})})
    for session in (still, drifting):
        setting = setting_of(plan_of(4.0, 8.0), pool, session)
        both = predict(setting, setting.plan.passes, 10.0, phases=1).normal
        first = predict(setting, setting.plan.passes[:1], phases=1).normal
        second = both - first  # the phases of the second pass are its own
        assert np.linalg.eigvalsh(second[:6, :6]).min() > 0
        for normal in (both, first):
            np.testing.assert_allclose(normal, normal.T, rtol=1e-6, atol=1e-6 * np.abs(normal).max())


@pytest.mark.parametrize(
    ("distances", "gap", "remedy"),
    [
        ((5.0,), "one pass alone", "two more passes at"),
        ((6.0, 6.1, 5.9), "all passes lie at 5.9 to 6.1 m", "two more passes at 3 m would bring sigma"),
    ][: often(1, 2)],
)
def test_what_a_plan_lacks_is_said_with_its_cure(
    distances: tuple[float, ...], gap: str, remedy: str, configs: tuple[PoolConfig, SessionConfig]
) -> None:
    answer = assessment.assess_plan(plan_of(*distances), *configs)
    assert gap in answer.gaps[0]
    assert remedy in answer.remedy
    assert not assessment.is_enough(answer, configs[0].verdict)
    said = table(answer, configs[0].verdict)
    assert "above the limit" in said


@pytest.mark.thorough
def test_within_a_budget_the_better_list_is_chosen(configs: tuple[PoolConfig, SessionConfig]) -> None:
    candidates = [{"distance_m": d} for d in (3.0, 5.5, 6.0, 9.0)]
    budget = {"seconds": 200.0, "turn_s": 60.0}
    answer = assessment.assess_plan(plan_of(6.0, 6.0, candidates=candidates, budget=budget), *configs)
    assert answer.better is not None
    assert answer.better.seconds + budget["turn_s"] * (len(answer.better.passes) - 1) <= budget["seconds"]
    assert {one.distance_m for one in answer.better.passes} >= {3.0}
    assert len({one.distance_m for one in answer.better.passes}) > 1
    assert answer.better.random[2, 2] < answer.given.random[2, 2] / 25
    chosen = table(answer, configs[0].verdict).partition("Chosen from the candidates, in the time there is: ")[2]
    kinds = Counter(one.distance_m for one in answer.better.passes)
    listed = dict(re.findall(r"(\d+) x ([\d.]+) m", chosen.splitlines()[0]))
    assert {float(d): int(n) for n, d in listed.items()} == kinds
    shares = [shares_of_limits(answer.setting, one, configs[0].verdict) for one in (answer.given, answer.better)]
    largest = [f"{max(share.values()):.2f} ({max(share, key=lambda k, s=share: s[k])})" for share in shares]
    assert f"{largest[0]} as given, {largest[1]} with these" in chosen
    grown = [name for name in shares[0] if shares[1][name] > 1.05 * shares[0][name]]
    assert re.findall(r"(\w+) \([\d.]+ to", chosen) == grown
    nothing = assessment.assess_plan(plan_of(6.0, candidates=candidates, budget={"seconds": 5.0}), *configs)
    assert nothing.better is None
    words = table(nothing, configs[0].verdict)
    assert "and 0 s of turns, of 5 s." in words
    assert "no candidate helps within the budget" in words


def test_out_of_sight_there_is_no_result(configs: tuple[PoolConfig, SessionConfig]) -> None:
    answer = assessment.assess_plan(plan_of(60.0, mbes={"max_range_m": 15.0}), *configs)
    assert answer.given.solution.deficiency > 0
    assert answer.gaps[:2] == [f"the {sensor} sees nothing of the target from 60.0 m" for sensor in ("laser", "sonar")]
    assert not any("alone has soundings" in gap for gap in answer.gaps)
    assert "left open: no result" in table(answer, configs[0].verdict)
    assert plan_document(answer)["given"]["sigma_mount"] is None


def test_the_command(tmp_path: Path) -> None:
    session = made({"track": {"distances_m": [4.0]}}, seed=2)
    folder = tmp_path / "池 session"
    folder.mkdir()
    (folder / "session.yaml").write_text(yaml.safe_dump(session.session))
    (tmp_path / "pool.yaml").write_text(yaml.safe_dump(session.pool))
    plan = tmp_path / "plan.yaml"
    plan.write_text(yaml.safe_dump(FIGURES | {"passes": [{"distance_m": 4.0}, {"distance_m": 8.0}]}))
    words = ("plan", plan, "--session", folder, "--config", tmp_path / "pool.yaml")
    told = poolcal(*words, "--yaml", tmp_path / "out.yaml", "--rrd", tmp_path / "out.rrd")
    assert (told.status, told.err) == (0, "")
    assert "As given:" in told.out
    written = yaml.safe_load((tmp_path / "out.yaml").read_text())
    assert [one["distance_m"] for one in written["given"]["passes"]] == [4.0, 8.0]
    assert (tmp_path / "out.rrd").stat().st_size > 10_000
    plan.write_text(yaml.safe_dump(FIGURES | {"passes": [{"distance_m": 8.0}]}))
    assert poolcal(*words).status == 1
    for content, word in (
        ("passes: []", "passes"),
        ("passes: [{distance_m: -4}]", "passes.0.distance_m = -4"),
        ("passes: [{distance_m: 4, sped: 1}]", "unknown key"),
    ):
        plan.write_text(content)
        told = poolcal(*words)
        assert (told.status, len(told.err.splitlines())) == (2, 1)
        assert word in told.err
    told = poolcal(*words, "--rrd", tmp_path / "out.png")
    assert (told.status, "ends in .rrd" in told.err) == (2, True)


def test_what_is_not_to_be_planned_or_written_over(tmp_path: Path) -> None:
    """One line each, status 2, and every file as it was."""
    session = made({"track": {"distances_m": [4.0]}}, seed=2)
    folder, plan, pool = tmp_path / "session", tmp_path / "plan.yaml", tmp_path / "pool.yaml"
    folder.mkdir()
    (folder / "session.yaml").write_text(yaml.safe_dump(session.session))
    words = ("plan", plan, "--session", folder, "--config", pool)

    def refused(*more: Any, design: dict[str, Any] | None = None, **content: Any) -> str:
        pool.write_text(yaml.safe_dump(session.pool | (design or {})))
        plan.write_text(yaml.safe_dump(FIGURES | {"passes": [{"distance_m": 4.0}]} | content))
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        told = poolcal(*words, *more)
        assert (told.status, len(told.err.splitlines())) == (2, 1), told
        assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
        return told.err

    for over in (folder / "session.yaml", folder / "new.yaml", plan, pool):
        assert "name" in refused("--yaml", over)
    assert "passes.0.distance_m" in refused(passes=[{"distance_m": 0.4}])
    assert "candidates.0.distance_m" in refused(candidates=[{"distance_m": 0.4}])
    assert "above the water" in refused(ins_height_m=2.2)
    assert "no face of this target" in refused(design={"as_built": {"faces": {"P1-9": 0.001}}})
    for content in ({"unrest": {"roll_deg": 90.0}}, {"budget": {"seconds": 1e9}}, {"mbes": {"ping_rate_hz": 1e7}}):
        assert "should be less than or equal to" in refused(**content)


@pytest.mark.thorough
def test_what_is_freed_is_freed_in_the_prediction_too(configs: tuple[PoolConfig, SessionConfig]) -> None:
    pool, session = configs
    freed = pool.model_copy(update={"adjust": pool.adjust.model_copy(update={"free": ("mbes_latency",)})})
    held, free = (assessment.assess_plan(plan_of(4.0, 8.0), one, session).given.random for one in (pool, freed))
    assert np.sqrt(free[4, 4]) > 1.1 * np.sqrt(held[4, 4])  # y, along the track


def test_no_two_columns_of_a_plan_run_together(configs: tuple[PoolConfig, SessionConfig]) -> None:
    """Families with long names; each head ends where its numbers end."""
    pool, session = configs
    faces = {"kind": "faces", "origin": pool.target.origin.model_dump(), "azimuth_deg": 0.0, "faces": {
        "return-of-the-quay-in-the-south": {"corners": [[0, 1.5, -4], [0, -1.5, -4], [0, -1.5, 2], [0, 1.5, 2]]},
        "return-of-the-quay-in-the-north": {"corners": [[1.0, 4.3, -4], [0, 1.5, -4], [0, 1.5, 2], [1.0, 4.3, 2]]},
    }}
    other = PoolConfig.model_validate_json(json.dumps({"target": faces}))
    said = table(assessment.assess_plan(plan_of(4.0), other, session), other.verdict)
    head, row = said.splitlines()[1:3]
    names = [f"return-of-the-quay-in-the-{side}" for side in ("south", "north")]
    assert head.split()[-4:-2] == names
    for name, number in zip(names, row.split()[-3:-1], strict=True):
        end = head.index(name) + len(name)
        assert row[:end].endswith(number)
        assert head[head.index(name) - 1] == " "
