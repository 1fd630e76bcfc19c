"""A cast thinned to its profile: against decoders of the test's own."""

import numpy as np
import pytest

from pipeline.maths.sonar.cast_profile import MOST, ascending, one_way, thinned_profile


# --- thinning --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("rows", [50, 5000])
def test_every_row_lies_within_the_tolerance(rows: int) -> None:
    depth, _ = ascending(np.random.default_rng(7).uniform(0, 12, rows), np.zeros(rows))
    speed = np.round(1480 + 3 * np.tanh(depth - 5), 2)
    profile = thinned_profile(depth, speed)
    assert len(profile.depth_m) <= MOST
    assert profile.averaged_m == 0.0
    off = np.interp(depth, profile.depth_m, profile.speed_m_s) - speed
    assert np.abs(off).max() <= 0.02
    assert profile.scatter_m_s == pytest.approx(np.sqrt(np.mean(off**2)))


@pytest.mark.parametrize("noise", [0.03, 0.1])
def test_rows_that_scatter_are_averaged(noise: float) -> None:
    """Their means lie within the tolerance, and the profile nearer to the truth than the rows."""
    rng = np.random.default_rng(7)
    depth, _ = ascending(rng.uniform(0, 12, 8000), np.zeros(8000))
    truth = 1480 + 3 * np.tanh(depth - 5)
    profile = thinned_profile(depth, truth + rng.normal(scale=noise, size=len(depth)))
    assert 2 < len(profile.depth_m) <= MOST
    assert profile.averaged_m > 0
    off = np.interp(depth, profile.depth_m, profile.speed_m_s) - truth
    assert np.sqrt(np.mean(off**2)) < noise / 3
    assert profile.scatter_m_s == pytest.approx(noise, rel=0.1)


def test_straight_lines_need_their_ends_alone() -> None:
    depth = np.linspace(0, 10, 1001)
    profile = thinned_profile(depth, 1480 + 0.3 * depth)
    assert profile.depth_m.tolist() == [0.0, 10.0]
    bent = thinned_profile(depth, 1480 + np.where(depth == 5.0, 0.0201, 0.0))
    assert 5.0 in bent.depth_m.tolist()
    level = thinned_profile(depth, 1480 + np.where(depth == 5.0, 0.0199, 0.0))
    assert level.depth_m.tolist() == [0.0, 10.0]


def test_one_way() -> None:
    down, up = np.arange(0.0, 5.0), np.arange(5.0, 0.0, -1.0)
    assert one_way(np.concatenate([down, up])).tolist() == [0, 1, 2, 3, 4, 5]
    assert one_way(up).tolist() == [0, 1, 2, 3, 4]
    assert one_way(np.concatenate([down, [4.0, 3.5]])).tolist() == list(range(7))  # no way up, but a pause
