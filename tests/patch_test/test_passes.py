"""The passes of a patch test: told apart along the direction of the boat's way, whichever that is."""

import numpy as np
import pytest

from pipeline.georeference.pool_context import PoolContext
from pipeline.gps_time import NS
from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.patch_test.passes import with_passes

RATE_HZ, SPEED_M_S, LINE_S = 10, 1.0, 40


def track(azimuth_deg: float, waiting_s: float) -> PoolContext:
    """A boat that lies at a quay with its bow to the north, then sails four lines there and back, in one log."""
    at_quay = np.zeros((round(waiting_s * RATE_HZ), 2))
    steps = np.concatenate([np.full(LINE_S * RATE_HZ, sense) for sense in (1.0, -1.0, 1.0, -1.0)]) * SPEED_M_S / RATE_HZ
    ahead = np.array([np.sin(np.radians(azimuth_deg)), np.cos(np.radians(azimuth_deg))])
    places = np.concatenate([at_quay, np.cumsum(steps)[:, None] * ahead])
    places += np.random.default_rng(3).normal(scale=0.01, size=places.shape)
    t_ns = np.arange(len(places)) * (NS // RATE_HZ)
    positions, R = np.column_stack([places, np.zeros(len(places))]), np.tile(np.eye(3), (len(places), 1, 1))
    trajectory = Trajectory.build(t_ns, positions, R)
    everywhere = np.full(3, np.inf)
    return PoolContext(PoolFrame.at(0.6, 2.1, 0.0, 0.0), trajectory, t_ns[:1], t_ns[-1:], -everywhere, everywhere)


@pytest.mark.parametrize("azimuth_deg", [0.0, 90.0, 163.0, 310.0])
@pytest.mark.parametrize("waiting_s", [0.0, 1800.0])
def test_each_line_there_and_back_is_a_pass(azimuth_deg: float, waiting_s: float) -> None:
    context = track(azimuth_deg, waiting_s)
    found = with_passes(context, context.trajectory.t_ns[:: RATE_HZ // 2])
    seconds = (found.ends_ns - found.starts_ns) / NS
    assert len(seconds) == 4
    np.testing.assert_allclose(seconds[1:], LINE_S, atol=1.5)
    assert seconds[0] == pytest.approx(waiting_s + LINE_S, abs=1.5)  # the quay belongs to the first: nothing parts it
