"""The frequency of the boat's roll and pitch, by which the knots of the drift are placed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.pose_errors import LARGEST_SPACING_S, PoseNoise, knot_spacing
from pipeline.maths.geometry.trajectory import Trajectory

RATE_HZ, SECONDS = 50, 90.0


def motion(roll_deg: float, noise_deg: float = 0.0, heading_deg: float = 0.0) -> BodyMotion:
    """A boat with a list of 2°, that rolls every 4.5 s and swings every 20 s about a heading of 120°."""
    t = np.arange(0, SECONDS, 1 / RATE_HZ)
    roll = 2.0 + roll_deg * np.sin(2 * np.pi * t / 4.5)
    heading = -120.0 + heading_deg * np.sin(2 * np.pi * t / 20)
    noise = noise_deg * np.random.default_rng(2).normal(size=(len(t), 3))
    R = Rotation.from_euler("ZXY", np.column_stack([heading, 0 * t, roll]) + noise, degrees=True).as_matrix()
    positions = np.column_stack([np.full(len(t), -5.0), 0.3 * t, 0 * t])
    return BodyMotion.of(Trajectory.build((t * 1e9).round().astype(np.int64), positions, R), np.zeros(3))


@pytest.mark.parametrize("heading_deg", [0.0, 5.0])
def test_a_roll_has_its_frequency_whatever_the_heading_does(heading_deg: float) -> None:
    assert motion(1.0, heading_deg=heading_deg).motion_hz == pytest.approx(1 / 4.5, rel=0.05)
    assert motion(1.0, noise_deg=0.002, heading_deg=heading_deg).motion_hz == pytest.approx(1 / 4.5, rel=0.05)


def test_a_boat_that_lies_still_has_none() -> None:
    assert motion(0.0).motion_hz == 0.0


def test_knots_follow_the_roll_and_are_spared_without_drift() -> None:
    body, record = motion(1.0), np.arange(int(SECONDS * RATE_HZ) - 1)
    drifting = PoseNoise(np.zeros(6), np.full(6, 0.01), 200.0)
    quiet = PoseNoise(np.zeros(6), np.zeros(6), 200.0)
    for noise, spacing_s in ((drifting, knot_spacing(1 / 4.5)), (quiet, LARGEST_SPACING_S)):
        drift = body.zero_drift(record, noise, 5.0)
        apart = np.diff(drift.knots.seconds)
        assert apart.max() <= spacing_s + 1.01 / RATE_HZ
        assert apart.mean() == pytest.approx(spacing_s, rel=0.1)
        assert not drift.values.any()
