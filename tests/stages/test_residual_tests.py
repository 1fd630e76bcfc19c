"""One thing wrong in a session: rejected, and by its name. (Campaign: tools/residual_tests.py.)"""

import copy
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.simulation.session import SimulatedSession
from tests.support.simulated import calibrated, made
from tools.campaigns import DRIFT
from tools.residual_tests import FAULTS, World

THE_FACE, THE_STEP, THE_PASS, THE_TOP = (
    "a slanted face 20 mm off",
    "ranges step by 10 mm at an angle",
    "one pass: sonar 8 mm farther",
    "a top 20 mm too high",
)


def first_reason(session: SimulatedSession, fault: str, number: int, again=None) -> tuple[str, str]:
    """What must be named, and the verdict's first reason."""
    world = World(number, dict(session.mbes), copy.deepcopy(session.pool), session.truth, again)
    expected = FAULTS[fault](world)
    pool = {"as_built": world.pool.get("as_built", {})}
    found = calibrated(session, pool=pool, raw={"mbes": world.mbes})
    return expected, json.loads(found["report/calibration.json"])["reasons"][0]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (THE_FACE, "likely cause of residuals ("),  # by a parameter of its own
        (THE_PASS, "the passes do not agree: in pass 1 the sonar lies +"),
        pytest.param(THE_STEP, "residuals go with angle: at a receive angle of 20°", marks=pytest.mark.thorough),
        pytest.param(THE_TOP, "likely cause of residuals (", marks=pytest.mark.thorough),
    ],
)
def test_a_fault_is_named(noisy, noisy_found, fault, words):
    assert json.loads(noisy_found["report/calibration.json"])["verdict"] == "accepted"
    expected, said = first_reason(noisy, fault, 1)
    assert expected in said
    assert said.startswith(words)


@pytest.mark.parametrize(
    ("mbes", "laser", "words"),
    [
        ({"image_share": 0.5}, {}, "0.3 m below the water the sonar's distance from face P2 steps by -"),
        pytest.param(
            {},
            {"splash_share": 0.6},
            "0.2 m above the water the laser's distance from face P2 steps by -",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_what_disturbs_a_sensor_near_the_water_is_named(mbes, laser, words):
    """An image lengthens the path, a drop shortens it. The wall is at x = 0, the boat at x < 0."""
    session = made({"mbes": mbes, "laser": laser})
    result = json.loads(calibrated(session)["report/calibration.json"])
    assert result["reasons"][0].startswith(f"residuals go with height: {words}")


@pytest.mark.thorough
def test_sectors_of_different_tilt_that_the_file_does_not_tell(noisy):
    """The middle of the fan is that of the same session with the sonar turned about its own x."""

    def again(turn_rad):
        R = np.array(noisy.truth["mbes"]["R_body_from_mbes"]) @ Rotation.from_rotvec(turn_rad).as_matrix()
        yaw, pitch, roll = Rotation.from_matrix(R).as_euler("ZXY", degrees=True)
        arm = {name: noisy.truth["mbes"]["mount"][name] for name in ("x_m", "y_m", "z_m")}
        return dict(made({"mbes": {"mount": arm | {"roll_deg": roll, "pitch_deg": pitch, "yaw_deg": yaw}}}).mbes)

    _, said = first_reason(noisy, "sectors: 0.254° within 30°", 1, again)
    assert "at a receive angle of 30° the sonar's distance from P" in said
    assert "likely transmit sectors of different tilt" in said


@pytest.mark.thorough
def test_a_pass_that_differs_is_found_where_drift_could_explain_it():
    _, said = first_reason(made({"ins": DRIFT}), THE_PASS, 1)
    assert said.startswith("the passes do not agree: for both sensors to fit in pass 1, the INS must be wrong there")


def test_what_was_judged_is_told(noisy_found):
    """The result lists each variable, with one limit for all; the steps and angles are those of the sonar's fan."""
    geometry = json.loads(noisy_found["report/calibration.json"])["geometry"]
    patterns = noisy_found["adjust/patterns"]
    assert {row["by"] for row in geometry["patterns"]} == {
        "angle", "distance", "face", "height", "pass", "ping_2", "ping_3", "ping_4", "step", "time",
    }  # fmt: skip
    assert {row["limit"] for row in geometry["patterns"]} == {geometry["test"]["limit"]}
    assert sum(row["dof"] for row in geometry["patterns"]) == len(patterns)
    assert all(row["passed"] for row in [*geometry["patterns"], geometry["test"]])
    steps = patterns[patterns["by"] == "step"]
    assert set(steps["sensor"]) == {"mbes"}
    wall = patterns.query("by == 'angle' and sensor == 'mbes' and family == 'P2'")
    for row in steps[steps["family"] == "P2"].itertuples():
        sides = [wall[wall["low"].between(start, start + 3)] for start in (row.low, row.low - 4)]
        if row.low % 2 == 0 and all(len(side) == 2 for side in sides):
            after, before = (np.average(side["mean_m"], weights=side["count"]) for side in sides)
            assert row.mean_m == pytest.approx(after - before, abs=4e-4)
