"""Pose errors eliminated epoch by epoch against one dense least squares with every unknown written out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment.eliminate_drift import eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import (
    LinearisedIntervals,
    ReducedIntervals,
    TimeAxis,
    eliminate_white_noise,
)
from pipeline.maths.adjustment.interval_sums import IntervalSums, LinearisedPoints, interval_sums, merged
from pipeline.maths.adjustment.pose_errors import (
    LARGEST_SPACING_S,
    LEAST_SPACING_S,
    DriftEstimate,
    Knots,
    PoseNoise,
    knot_spacing,
    place_knots,
)
from pipeline.maths.geometry.trajectory import Trajectory

RATE_HZ = 10.0
UNKNOWNS, SIX, FEATURES, POINTS = 7, 6, 4, 9


@dataclass(frozen=True)
class Source:
    """Random epochs of one sensor on one surface, on some of the unknowns."""

    sums: IntervalSums
    design: np.ndarray
    columns: np.ndarray
    pose: np.ndarray

    @property
    def record(self) -> np.ndarray:
        return self.sums.record

    def linearised(self, rows: slice) -> LinearisedIntervals:
        some = np.arange(len(self.record))[rows]
        return LinearisedIntervals(self.sums.selected(some), self.design[some], self.columns, self.pose)


def sources(rng: np.random.Generator, records: np.ndarray) -> tuple[list[Source], list[Any]]:
    found, rows = [], []
    for columns in (np.array([0, 2, 3, 6]), np.array([1, 2, 4, 5, 6])):
        record = np.unique(rng.choice(records, 25))
        design, pose = rng.normal(size=(len(record), FEATURES, len(columns))), rng.normal(size=(3, SIX))
        pieces = []
        for k, one in enumerate(record):
            q, s = np.vstack([np.ones(POINTS), rng.normal(size=(FEATURES - 1, POINTS))]), rng.uniform(0, 1, POINTS)
            v, w = rng.normal(size=POINTS), rng.uniform(0.5, 2, POINTS)
            points = LinearisedPoints(np.full(POINTS, one), np.zeros(POINTS, dtype=int), s, q, w, v)
            pieces.append(interval_sums(points))
            whole = np.zeros((FEATURES, UNKNOWNS))
            whole[:, columns] = design[k]
            rows.append((one, whole, np.vstack([pose, np.zeros((FEATURES - 3, SIX))]), q, s, v, w))
        found.append(Source(merged(pieces), design, columns, pose))
    return found, rows


def whole_of(found: list[Source], times: TimeAxis, white: np.ndarray) -> ReducedIntervals:
    """All spans in one group."""
    return eliminate_white_noise(found, UNKNOWNS, times, white, np.zeros(len(times.knots.inner), dtype=int)).of([0])


def dense(rows: list[Any], knots: Knots, seconds: np.ndarray, noise: PoseNoise, current: np.ndarray) -> Any:
    """Rows, values and size of the whole problem: x, every knot, white noise of every record by interval, in sigmas."""
    count = len(knots.record)
    whites: dict[Any, int] = {}
    placed = []
    for one, C, K, q, s, v, w in rows:
        j = int(knots.interval_of(np.array([one]))[0])
        for offset in (0, 1):
            whites.setdefault((j, one + offset), len(whites))
        placed.append((one, j, C, K, q, s, v, w))
    white0 = UNKNOWNS + SIX * count
    size = white0 + SIX * len(whites)
    design, value = [], []
    for one, j, C, K, q, s, v, w in placed:
        middle = np.average(s, weights=w)  # the drift of an epoch is that of its middle
        t = seconds[one] + middle * (seconds[one + 1] - seconds[one])
        a = (t - knots.seconds[j]) / (knots.seconds[j + 1] - knots.seconds[j])
        row = np.zeros((len(v), size))
        row[:, :UNKNOWNS] = q.T @ C
        for knot, part in ((j, 1 - a), (j + 1, a)):
            row[:, UNKNOWNS + SIX * knot : UNKNOWNS + SIX * knot + SIX] = q.T @ K * noise.drift * part
        for offset, parts in ((0, 1 - s), (1, s)):
            at = white0 + SIX * whites[(j, one + offset)]
            row[:, at : at + SIX] += parts[:, None] * (q.T @ K) * noise.white
        design.append(row * np.sqrt(w)[:, None])
        value.append(v * np.sqrt(w))
    z = np.divide(current, noise.drift, out=np.zeros_like(current), where=noise.drift > 0)
    for j in range(count):  # prior of the drift, its values being z
        for k in range(SIX):
            row, v = np.zeros((1, size)), z[0, k]
            row[0, UNKNOWNS + SIX * j + k] = 1.0
            if j:
                phi = np.exp(-(knots.seconds[j] - knots.seconds[j - 1]) / noise.time_constant_s)
                row[0, UNKNOWNS + SIX * (j - 1) + k] = -phi
                row, v = row / np.sqrt(1 - phi**2), (z[j, k] - phi * z[j - 1, k]) / np.sqrt(1 - phi**2)
            design.append(row)
            value.append(np.atleast_1d(v))
    design.append(np.eye(size)[white0:])
    value.append(np.zeros(size - white0))
    return np.concatenate(design), np.concatenate(value), white0


def test_sums_that_no_observations_can_have_give_no_result() -> None:
    """A negative square of a knot, or no number: the factorisation must not go on with it unseen."""
    knots = Knots(np.arange(3), np.arange(3.0), np.ones(2, dtype=bool))
    noise, drift = PoseNoise(np.zeros(SIX), np.full(SIX, 0.3), 4.0), DriftEstimate(knots, np.zeros((3, SIX)))
    for wrong in (-1e6, np.nan):
        spans = np.zeros((2, 2 * SIX, UNKNOWNS + 2 * SIX + 1))
        spans[1, 3, UNKNOWNS + 3] = wrong
        with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
            eliminate_drift(ReducedIntervals(spans, np.eye(UNKNOWNS + 1), 0.0), noise, drift)


@pytest.mark.parametrize("white", [0.0, 0.7])
def test_elimination_is_the_dense_solution(white: float) -> None:
    rng = np.random.default_rng(3)
    seconds = np.r_[np.arange(31), 90 + np.arange(31)] / RATE_HZ
    records = np.r_[np.arange(30), 31 + np.arange(30)]
    found, rows = sources(rng, records)
    knots = place_knots(np.unique(np.concatenate([one.record for one in found])), seconds, 1.0, 2.0)
    noise = PoseNoise(white * np.array([1, 1, 1, 0.5, 0.5, 0]), np.array([0.3, 0.3, 0.2, 0.1, 0.1, 0]), 4.0)
    current = rng.normal(size=(len(knots.record), SIX)) * noise.drift
    reduced = whole_of(found, TimeAxis(seconds, knots), noise.white)
    ours = eliminate_drift(reduced, noise, DriftEstimate(knots, current))
    step = -np.linalg.solve(ours.normal, ours.right)

    A, v, white0 = dense(rows, knots, seconds, noise, current)
    theirs = -np.linalg.lstsq(A, v, rcond=None)[0]
    covariance = np.linalg.inv(A.T @ A)
    np.testing.assert_allclose(step, theirs[:UNKNOWNS], rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(np.linalg.inv(ours.normal), covariance[:UNKNOWNS, :UNKNOWNS], rtol=1e-8, atol=1e-12)
    of_knots = theirs[UNKNOWNS:white0].reshape(-1, SIX) * noise.drift
    np.testing.assert_allclose(ours.knots(step), of_knots, rtol=1e-8, atol=1e-10)
    # what is left of the squares: at x = 0, and at the solution
    others = A[:, UNKNOWNS:]
    left = v - others @ np.linalg.lstsq(others, v, rcond=None)[0]
    assert ours.squares == pytest.approx(left @ left)
    residual = v + A @ theirs
    assert ours.squares + ours.right @ step == pytest.approx(residual @ residual)
    assert ours.right @ step == pytest.approx(-step @ ours.normal @ step)
    # log det of what went, against log det of the others' normal matrix, relative to their prior
    prior = sum(np.log(1 - np.exp(-2 * d / noise.time_constant_s)) for d in np.diff(knots.seconds))
    expected = np.linalg.slogdet(others.T @ others)[1] + SIX * prior
    assert ours.log_determinant == pytest.approx(expected)


def test_many_intervals_side_by_side_are_the_same_as_few(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    seconds = np.arange(200) / RATE_HZ
    found, _ = sources(rng, np.arange(199))
    knots = place_knots(np.unique(np.concatenate([one.record for one in found])), seconds, 0.5, 2.0)
    white = np.full(SIX, 0.4)
    whole = whole_of(found, TimeAxis(seconds, knots), white)
    monkeypatch.setattr("pipeline.maths.adjustment.eliminate_white_noise.SIDE_BY_SIDE", 15)  # records: two spans
    parts = whole_of(found, TimeAxis(seconds, knots), white)
    np.testing.assert_allclose(parts.spans, whole.spans, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(parts.others, whole.others, rtol=1e-12, atol=1e-12)
    assert parts.log_determinant == pytest.approx(whole.log_determinant)


def test_a_group_of_spans_is_the_same_as_its_intervals_alone() -> None:
    rng = np.random.default_rng(5)
    seconds = np.r_[np.arange(31), 90 + np.arange(31)] / RATE_HZ
    found, _ = sources(rng, np.r_[np.arange(30), 31 + np.arange(30)])
    records = np.unique(np.concatenate([one.record for one in found]))
    knots, white = place_knots(records, seconds, 1.0, 2.0), np.full(SIX, 0.4)
    times = TimeAxis(seconds, knots)
    second = (knots.record[:-1] >= 31).astype(np.int64)
    groups = eliminate_white_noise(found, UNKNOWNS, times, white, second)
    for number, inside in enumerate((lambda record: record < 31, lambda record: record >= 31)):
        some = [
            Source(one.sums.selected(rows), one.design[rows], one.columns, one.pose)
            for one in found
            for rows in [np.flatnonzero(inside(one.record))]
        ]
        alone, group = whole_of(some, times, white), groups.of([number])
        np.testing.assert_allclose(group.spans, alone.spans, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(group.others, alone.others, rtol=1e-12, atol=1e-12)
        assert group.log_determinant == pytest.approx(alone.log_determinant)
    both, whole = groups.of([0, 1]), whole_of(found, times, white)
    np.testing.assert_allclose(both.spans, whole.spans, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(both.others, whole.others, rtol=1e-12, atol=1e-12)
    assert both.log_determinant == pytest.approx(whole.log_determinant)


def test_knots_keep_to_the_passes() -> None:
    seconds = np.r_[np.arange(0, 10, 0.1), np.arange(60, 65.25, 0.1)]
    used = np.r_[np.arange(5, 80), np.arange(100, 140)]
    knots = place_knots(used, seconds, 1.0, 5.0)
    np.testing.assert_array_equal(np.flatnonzero(~knots.inner), [8])
    assert knots.record[0] == 5
    assert knots.record[8] == 80  # the step from record 79 on ends there
    assert knots.record[9] == 100
    assert np.diff(knots.seconds)[knots.inner].max() <= 1.0 + 0.1
    interval = knots.interval_of(used)
    assert knots.inner[interval].all()
    assert (knots.record[interval] <= used).all()
    assert (knots.record[interval + 1] > used).all()
    drift = DriftEstimate(knots, np.ones((len(knots.record), SIX)))
    assert np.allclose(drift.updated(drift.values).at(np.array([0.0, 30.0, 99.0])), 2.0)


def test_factors_of_the_noise() -> None:
    noise = PoseNoise(np.full(SIX, 2.0), np.arange(SIX) + 1.0, 200.0)
    np.testing.assert_array_equal(noise.scaled(4.0).white, 4.0)
    changed = noise.drifting(2.0, 3.0, 0.1)
    np.testing.assert_array_equal(changed.drift, [2, 4, 6, 12, 15, 18])
    assert changed.time_constant_s == pytest.approx(20.0)


def test_knots_leave_a_hundredth_of_the_drift_at_twice_the_rolls_frequency() -> None:
    """Against the spectrum of a random walk and of its linear interpolation, from a long simulated one."""
    rng, fine, roll_hz = np.random.default_rng(8), 0.005, 0.25
    each = round(knot_spacing(roll_hz) / fine)
    spacing = each * fine
    count = 40_000 // each * each
    power = np.zeros(2)
    for _ in range(60):
        walk = np.r_[0.0, np.cumsum(rng.normal(size=count))]
        t = np.arange(count + 1) * fine
        between = np.interp(t, t[::each], walk[::each])
        wave = np.exp(-2j * np.pi * 2 * roll_hz * t) * np.sin(np.pi * t / t[-1]) ** 2
        power += np.abs([np.sum(wave * walk), np.sum(wave * (walk - between))]) ** 2
    assert spacing == pytest.approx(knot_spacing(roll_hz), rel=0.05)
    assert power[1] / power[0] == pytest.approx(0.01 * (spacing / knot_spacing(roll_hz)) ** 2, rel=0.4)


def test_knots_are_never_farther_apart_nor_closer_than_their_bounds() -> None:
    assert knot_spacing(0.0) == knot_spacing(0.01) == LARGEST_SPACING_S
    assert knot_spacing(100.0) == LEAST_SPACING_S
    assert knot_spacing(0.2) == pytest.approx(2 * knot_spacing(0.4))


def test_a_corrected_trajectory_has_lost_the_drift() -> None:
    """True poses with an error (δ, ω) of the recorded ones: X -> X + δ + ω × r with r from the body, target frame."""
    rng = np.random.default_rng(3)
    t_ns = np.arange(0, 1000, 5, dtype=np.int64) * 1_000_000 + 10**18
    true_m, turns = rng.normal(size=(200, 3)), Rotation.from_rotvec(0.1 * rng.normal(size=(200, 3)))
    error = np.array([0.01, -0.02, 0.03, 2e-4, -3e-4, 5e-4])
    knots = Knots(np.array([0, 199]), np.array([0.0, 0.995]), np.array([True]))
    growing = np.outer(np.linspace(0, 1, 200), error)  # linear in time, as between the two knots
    recorded = (Rotation.from_rotvec(-growing[:, 3:]) * turns).as_matrix()
    drift = DriftEstimate(knots, np.array([np.zeros(6), error]))
    found = drift.corrected(Trajectory.build(t_ns, true_m - growing[:, :3], recorded))
    np.testing.assert_allclose(found.positions_m, true_m, atol=1e-12)
    np.testing.assert_allclose(found.R_frame_from_body, turns.as_matrix(), atol=1e-12)
