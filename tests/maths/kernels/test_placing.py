"""Points and poses by compiled loops against numpy's rotations, for times in any order, outside the records, none."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.pose_errors import DriftEstimate, Knots
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.geometry.trajectory import Trajectory
from tests.support.placing_oracle import placed_by_numpy

SHAPE = {"seed": st.integers(0, 2**32), "records": st.integers(2, 40), "points": st.integers(0, 60)}
TURNS = st.sampled_from([0.0, 1e-9, 1e-4, 0.05, 0.5, 3.0])  # rad between two records: series, and closed form


def moving(rng: np.random.Generator, records: int, turn: float) -> Trajectory:
    t_ns = np.cumsum(rng.integers(1, 10_000_000, records))
    R = exp_so3(rng.normal(size=(1, 3)))
    for _ in range(records - 1):
        axis = rng.normal(size=3)
        R = np.concatenate([R, R[-1:] @ exp_so3(turn * axis / np.linalg.norm(axis))])
    return Trajectory.build(t_ns, np.cumsum(rng.normal(size=(records, 3)), axis=0), R)


@given(**SHAPE, turn=TURNS, ordered=st.booleans(), sparse=st.booleans())
@settings(max_examples=50, deadline=None)
def test_points_are_where_numpy_places_them(
    seed: int, records: int, points: int, turn: float, ordered: bool, sparse: bool
) -> None:
    rng = np.random.default_rng(seed)
    trajectory = moving(rng, records, turn)
    first, last = trajectory.t_ns[[0, -1]]
    beyond = 0 if turn > 1 else 1000  # s outside 0 to 1; far outside, half a turn between records has no meaning
    t_ns = rng.integers(first - beyond, last + beyond + 1, points)
    t_ns[rng.random(points) < 0.2] = trajectory.t_ns[rng.integers(records)]  # at a record
    if ordered:
        t_ns.sort()
    own = rng.normal(scale=10, size=(points, 3))
    own[rng.random(points) < 0.1] = np.nan
    mount, lever = exp_so3(rng.normal(size=3)), rng.normal(size=3)
    own_m = np.asfortranarray(own) if sparse else own[::-1][::-1]
    found = trajectory.points_from_sensor(t_ns, own_m, mount, lever)
    np.testing.assert_allclose(found, placed_by_numpy(trajectory, t_ns, own @ mount.T + lever), rtol=0, atol=1e-12)


@given(**SHAPE, turn=TURNS, knots=st.integers(1, 30))
@settings(max_examples=50, deadline=None)
def test_poses_are_those_of_numpy(seed: int, records: int, points: int, turn: float, knots: int) -> None:
    rng = np.random.default_rng(seed)
    body = BodyMotion.of(moving(rng, records, turn), np.zeros(3))
    at = np.sort(rng.choice(records, min(knots, records), replace=False))
    inner = np.ones(len(at) - 1, dtype=bool)
    drift = DriftEstimate(Knots(at, body.seconds[at], inner), 0.01 * rng.normal(size=(len(at), 6)))
    record, share = np.sort(rng.integers(0, records - 1, points)), rng.random(points)
    trajectory = body.trajectory
    step = trajectory.positions_m[record + 1] - trajectory.positions_m[record]
    positions = trajectory.positions_m[record] + share[:, None] * step
    R = trajectory.R_frame_from_body[record] @ exp_so3(trajectory.steps_rad[record] * share[:, None])
    error = drift.at(body.times(record, share))
    for given_drift, p, T in ((None, positions, R), (drift, positions + error[:, :3], exp_so3(error[:, 3:]) @ R)):
        poses = body.poses(record, share, given_drift)
        np.testing.assert_allclose(poses.positions_m, p, rtol=0, atol=1e-12)
        np.testing.assert_allclose(poses.R_target_from_body, T, rtol=0, atol=1e-12)
