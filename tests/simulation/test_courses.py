"""The simulator's courses: where the boat is, which way it heads, how long a pass must last."""

from typing import Any

import numpy as np
import pytest

from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.simulation.motion import Movement
from pipeline.simulation.scenario import Scenario

WAVES = ("surge", "sway", "heave", "roll", "pitch", "heading")
STILL = {name: {"amplitude": 0.0, "period_s": 5.0} for name in WAVES}


def scenario(**track: Any) -> Scenario:
    return parse(Scenario, {"name": "test", "motion": STILL, "track": {"distances_m": [4.0, 6.0]} | track}, "test")


@pytest.mark.parametrize("course", ["along", "back", "circle"])
def test_the_boat_heads_the_way_it_goes(course: str) -> None:
    """Azimuths count from +y (the target's azimuth is 0) clockwise, so toward +x."""
    movement = Movement(scenario(courses=[course], circle_radius_m=1.5), 1)
    times = np.arange(movement.starts_ns[1], movement.ends_ns[1], 50_000_000)
    pose = movement.pose(1, times)
    step = np.diff(pose.position_target_m, axis=0) / 0.05
    np.testing.assert_allclose(np.linalg.norm(step, axis=1), 0.4, rtol=1e-3)
    middle = pose.azimuth_rad[:-1] + np.angle(np.exp(1j * np.diff(pose.azimuth_rad))) / 2
    np.testing.assert_allclose(step[:, 0], 0.4 * np.sin(middle), atol=1e-3)
    np.testing.assert_allclose(step[:, 1], 0.4 * np.cos(middle), atol=1e-3)
    if course == "circle":
        centre = np.array([-6.0, 0.0])
        np.testing.assert_allclose(np.linalg.norm(pose.position_target_m[:, :2] - centre, axis=1), 1.5, atol=1e-6)
        assert np.angle(np.exp(1j * np.diff(pose.azimuth_rad))).min() > 0  # to starboard
        assert (times[-1] - times[0]) / 1e9 == pytest.approx(2 * np.pi * 1.5 / 0.4, abs=0.1)


def test_courses_are_taken_in_turn() -> None:
    movement = Movement(scenario(courses=["along", "back"], distances_m=[4.0, 5.0, 6.0]), 1)
    headings = [float(np.degrees(movement.pose(k, np.array([movement.starts_ns[k]])).azimuth_rad[0])) for k in range(3)]
    assert headings == pytest.approx([0.0, 180.0, 0.0], abs=1e-4)
    assert all(end < start for end, start in zip(movement.ends_ns[:-1], movement.starts_ns[1:], strict=True))


@pytest.mark.parametrize(("courses", "refused"), [(["along"], False), (["along", "circle"], True)])
def test_a_fast_boat_may_pass_but_not_circle_in_less_than_a_second(courses: list[str], refused: bool) -> None:
    fast = {"speed_m_s": 15.0, "half_length_m": 15.0, "circle_radius_m": 1.0, "courses": courses}
    if refused:
        with pytest.raises(ConfigError, match=r"track.speed_m_s = 15.0: a pass must last a second or more"):
            scenario(**fast)
    else:
        scenario(**fast)
