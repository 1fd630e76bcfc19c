"""The mount from parts of a session: a head that turns under way shows, and a good session does not."""

import json
from typing import Any

import numpy as np

from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.simulation.session import SimulatedSession
from tests.support.simulated import calibrated

TURN_DEG = 0.04


def test_a_good_session_agrees_in_all_its_parts(noisy_found: dict[str, Any]) -> None:
    result = json.loads(noisy_found["report/calibration.json"])
    assert {row["part"] for row in result["parts"]} == {
        *(f"without pass {number}" for number in range(4)), "first half", "second half", "near passes", "far passes",
    }  # fmt: skip
    assert all(row["test"]["passed"] for row in result["parts"])
    assert {row["test"]["limit"] for row in result["parts"]} == {joint_limit(8, 0.001)}
    # no bracket has moved: each change is of the size of its sigma
    changes = np.array([[row["change"][key] / row["sigma"][key] for key in row["change"]] for row in result["parts"]])
    assert 0.3 < np.sqrt(np.mean(changes**2)) < 1.6


def test_a_head_that_turns_between_two_passes_shows(noisy: SimulatedSession, noisy_found: dict[str, Any]) -> None:
    """A larger angle of every beam is a larger roll: the halves of the session differ by it, with this sign."""
    starts = noisy_found["ingest/passes"]["start_ns"].to_numpy()
    mbes = dict(noisy.mbes)
    late = mbes["t_ns"] >= starts[2] - 1_000_000_000
    mbes["angle_rad"] = mbes["angle_rad"] + np.where(late, np.radians(TURN_DEG), 0.0)
    found = calibrated(noisy, raw={"mbes": mbes})
    result, good = (json.loads(one["report/calibration.json"]) for one in (found, noisy_found))
    assert "parts_disagree" in result["reason_codes"]

    def roll(of: dict[str, Any], part: str) -> float:
        (row,) = [row for row in of["parts"] if row["part"] == part]
        return float(row["change"]["roll_deg"])

    apart = roll(result, "second half") - roll(result, "first half")
    usual = roll(good, "second half") - roll(good, "first half")
    # a beam at θ from -z points to θ - roll from the body's -z: with θ larger by a turn, roll is larger by it too
    assert abs(apart - usual - TURN_DEG) < 0.01
