"""The first session of each campaign under stress, of the pairs of laser calibrations, and what their settings say."""

import numpy as np
import pytest

from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.simulation.documents import session_text
from pipeline.simulation.motion import Movement
from pipeline.simulation.scenario import Scenario
from tools.campaigns import DRIFT, scenario_of
from tools.laser_pairs import pair_row
from tools.session_rows import NAMES, session_row
from tools.stress_campaigns import ALL, STRESS, campaign_of

BY_NAME = {campaign.name: campaign for campaign in STRESS}


@pytest.mark.thorough
@pytest.mark.parametrize("name", BY_NAME)
def test_the_first_session_keeps_its_total_sigmas(name: str) -> None:
    row = session_row((BY_NAME[name], 0))
    assert row["campaign"] == name
    assert row["nse_total"] < row["nse"] < 100
    assert all(abs(row[f"error_{axis}"]) < 4 * row[f"total_{axis}"] for axis in NAMES)


@pytest.mark.thorough
def test_the_first_pair_of_laser_calibrations_agrees_where_both_estimate() -> None:
    row = pair_row(0)
    assert row["accepted_calm"], row["reasons_calm"]
    assert row["accepted_rough"], row["reasons_rough"]
    assert "pitch" not in row["held_calm"] + row["held_rough"]
    assert np.isfinite([row["z_pitch"], row["z_roll"]]).all()
    assert row["p_both"] > 1e-4


@pytest.mark.parametrize(("name", "seconds"), [("drift within 10 s", 10.0), ("drift within 30 s", 30.0)])
def test_the_settings_say_a_slower_drift_than_the_true_one(name: str, seconds: float) -> None:
    scenario = parse(Scenario, scenario_of(BY_NAME[name], 0), name)
    assert scenario.ins.drift.time_constant_s == seconds
    assert scenario.ins.drift_declared is not None
    assert scenario.ins.drift_declared.model_dump() == DRIFT["drift"]


def test_a_perfect_ins_concedes_the_default_drift_and_keeps_its_own_laser() -> None:
    """The simulated poses are the true ones; session.yaml says nothing of it."""
    scenario = parse(Scenario, scenario_of(BY_NAME["perfect INS"], 0), "perfect INS")
    session = parse(SessionConfig, session_text(scenario, Movement(scenario, 1), 1), "session")
    assert session.ins.drift.horizontal_m > 0.005
    assert (scenario.ins.drift.horizontal_m, scenario.ins.white.position_m) == (0, 0)
    assert scenario.laser.point_rate_hz == 30000.0


def test_no_seed_is_in_two_campaigns_and_each_finds_its_own() -> None:
    seeds = [campaign.first_seed + number for campaign in ALL for number in range(campaign.sessions)]
    assert len(set(seeds)) == len(seeds)
    assert len({campaign.name for campaign in ALL}) == len(ALL)
    for seed, name, number in ((8030, "finite beams and INS drift", 30), (9012, "twelve passes, INS drift", 12)):
        campaign, found = campaign_of(seed)
        assert (campaign.name, found) == (name, number)
    for seed in (999, 1200, 14900):  # before the first, after one's last, after the last's
        with pytest.raises(LookupError, match=f"seed {seed}: no campaign"):
            campaign_of(seed)
