"""The adjustment's rows against differences, its weights, covariance and tests against repeats."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment import (
    COMMON,
    LaserMoments,
    State,
    Surface,
    accumulate,
    laser_moments,
    laser_rows,
    sounding_rows,
)
from pipeline.maths.consistency import cells_of, clustered_covariance, consistency_limit, merge_scores, scores_of
from pipeline.maths.robust import histogram, igg3_weights, scale_of
from pipeline.maths.solution import redundancies, solve, variance_factors, weakest_direction

R_TRUE = Rotation.from_euler("ZXY", np.radians([-2.0, 1.2, -48.8])).as_matrix()
LEVER_TRUE = np.array([0.3, 0.2, -2.0])
ROOT = np.sqrt(0.5)
SURFACES = (
    Surface("P1", np.array([-ROOT, -ROOT, 0]), np.array([0.5, -2.0, 0]), 0.0),
    Surface("P2", np.array([-1.0, 0, 0]), np.zeros(3), 0.0),
    Surface("P3", np.array([-ROOT, ROOT, 0]), np.array([0.5, 2.0, 0]), 0.0),
    Surface("H", np.array([0, 0, 1.0]), np.array([0.5, 0, 0]), 0.0),
)


ANGLE_SIGMA = np.radians(0.06)


def scene(seed, n=4000, sigma_r=0.008, sigma_a=ANGLE_SIGMA, common_m=0.0, factor=1.0):
    """Soundings on four surfaces from two distances, by inverting the true mount; noise along and across the beam."""
    rng = np.random.default_rng(seed)
    surface = rng.choice(4, n, p=[0.15, 0.6, 0.15, 0.1])
    u, v = rng.uniform(-1, 1, n), rng.uniform(-3.5, -0.5, n)
    points = np.empty((n, 3))
    for k, s in enumerate(SURFACES):
        inside = surface == k
        along = np.array([0, 1.0, 0]) if k in (1, 3) else np.cross(s.normal, [0, 0, 1])
        points[inside] = s.centre_m + np.outer(u[inside] * 0.6, along)
        if k == 3:
            points[inside, 0] += rng.uniform(-0.4, 0.4, inside.sum())
        else:
            points[inside, 2] = v[inside]
    heights = np.where(surface == 3, -rng.integers(2, 7, n) * 0.5, 0.0)
    points[:, 2] += heights
    moment = rng.integers(0, 800, n)
    distance = np.where(moment < 400, 4.0, 8.0)
    heading = np.radians(1.5) * np.sin(0.1 * moment)
    T = Rotation.from_euler("ZY", np.column_stack([heading, np.radians(1.0) * np.cos(0.3 * moment)])).as_matrix()
    p = np.column_stack([-distance, points[:, 1] + 0.3, np.full(n, 1.3)])
    mbes = (np.einsum("nji,nj->ni", T, points - p) - LEVER_TRUE) @ R_TRUE
    unit = mbes / np.linalg.norm(mbes, axis=1, keepdims=True)
    across = np.column_stack([-mbes[:, 2], np.zeros(n), mbes[:, 0]])
    noisy = mbes + np.sqrt(factor) * (
        unit * rng.normal(scale=sigma_r, size=(n, 1)) + across * rng.normal(scale=sigma_a, size=(n, 1))
    )
    positions = p + rng.normal(scale=common_m, size=(800, 3))[moment] if common_m else p.copy()
    positions[:, 2] -= heights
    return surface, noisy, positions, T, moment, points - np.outer(heights, [0, 0, 1])


def laser_scene(seed, n=20000):
    rng = np.random.default_rng(seed)
    surface, *_, points = scene(seed + 50_000, n)
    normals = np.array([s.normal for s in SURFACES])[surface]
    points = points + normals * rng.normal(scale=0.005, size=(n, 1))
    return surface, points


def laser_part(seed, state) -> LaserMoments:
    surface, points = laser_scene(seed)
    rows = laser_rows(state, surface, points, np.full(len(points), 6.0), np.ones(len(points)), 0.005, 0.0)
    return laser_moments(state, rows, points)


def adjusted(seed, **options):
    surface, mbes, positions, T, moment, _ = scene(seed, **options)
    coarse = Rotation.from_rotvec([0.01, -0.012, 0.009]).as_matrix()
    state = State(coarse @ R_TRUE, LEVER_TRUE + np.array([0.05, -0.06, 0.04]), SURFACES)
    laser = laser_part(seed, state)
    for _ in range(8):
        rows = sounding_rows(state, surface, mbes, positions, T, 0.008, np.radians(0.06))
        sums = laser.sums(state) + accumulate(state, rows)
        solution = solve(sums)
        state = replace(state.moved(solution.step), factors=variance_factors(sums, solution.inverse, state.factors))
    rows = sounding_rows(state, surface, mbes, positions, T, 0.008, np.radians(0.06))
    error = np.concatenate(
        [Rotation.from_matrix(R_TRUE @ state.R_body_from_mbes.T).as_rotvec(), LEVER_TRUE - state.lever_arm_m]
    )
    return state, sums, solution, rows, error, moment


@pytest.mark.parametrize("column", range(18))
def test_the_design_is_the_derivative(column):
    surface, mbes, positions, T, *_ = scene(1, n=60)
    state = State(R_TRUE, LEVER_TRUE, SURFACES)
    sigmas = (0.008, 0.001)
    rows = sounding_rows(state, surface, mbes, positions, T, *sigmas)
    step = np.zeros(state.size)
    step[column] = 1e-6
    ahead = sounding_rows(state.moved(step), surface, mbes, positions, T, *sigmas).residual_m
    behind = sounding_rows(state.moved(-step), surface, mbes, positions, T, *sigmas).residual_m
    if column < COMMON:
        expected = rows.common[:, column]
    else:
        k, which = divmod(column - COMMON, 3)
        expected = np.where(surface == k, rows.local[:, which], 0.0)
    np.testing.assert_allclose((ahead - behind) / 2e-6, expected, atol=1e-6)


def test_the_truth_comes_back_without_noise():
    *_, error, _ = adjusted(2, sigma_r=1e-9, sigma_a=1e-9)
    # The laser's own noise moves the surfaces, which move the sonar: only that is left.
    assert np.abs(error[:3]).max() < 2e-4
    assert np.abs(error[3:]).max() < 1e-3


def test_errors_are_as_large_as_the_covariance_says():
    """Mean normalised squared error over repeats within its 99 % band (seeds 100-159), for both covariances."""
    formal, clustered = [], []
    for seed in range(100, 160):
        state, _, solution, rows, error, moment = adjusted(seed)
        c = solution.inverse[:6, :6]
        formal.append(error @ np.linalg.solve(c, error))
        scores = scores_of(state, rows, "mbes", np.zeros(len(moment), dtype=int), moment)
        sandwich = clustered_covariance(solution.inverse, scores)
        # Soundings alone are in these scores: compare the mount's block, which they govern.
        clustered.append(np.sqrt(np.diag(sandwich)[:3] / np.diag(solution.inverse)[:3]))
    low, high = 6 * (1 - 2.58 * np.sqrt(2 / 360)), 6 * (1 + 2.58 * np.sqrt(2 / 360))
    assert low < np.mean(formal) < high
    assert 0.8 < np.mean(clustered) < 1.1


def test_variance_factors_are_those_put_in():
    _, sums, solution, *_ = adjusted(7, n=8000, factor=4.0)
    found = variance_factors(sums, solution.inverse, {"laser": 1.0, "mbes_vertical": 1.0, "mbes_horizontal": 1.0})
    assert 0.95 < found["laser"] < 1.05
    assert 3.8 < found["mbes_vertical"] < 4.2
    assert 3.4 < found["mbes_horizontal"] < 4.6
    free = redundancies(sums, solution.inverse)
    assert sum(free.values()) == pytest.approx(8000 + 20000 - 18, rel=1e-6)


def test_noise_common_to_a_moment_widens_the_clustered_covariance_only():
    state, _, solution, rows, _, moment = adjusted(9, n=8000, common_m=0.01)
    scores = scores_of(state, rows, "mbes", np.zeros(len(moment), dtype=int), moment)
    ratio = np.sqrt(np.diag(clustered_covariance(solution.inverse, scores))[:3] / np.diag(solution.inverse)[:3])
    assert ratio.max() > 1.5


def test_too_few_moments_give_no_clustered_covariance():
    state, _, solution, rows, _, moment = adjusted(3)
    scores = scores_of(state, rows, "mbes", np.zeros(len(moment), dtype=int), moment % 20)
    assert clustered_covariance(solution.inverse, scores) is None


def test_laser_moments_give_the_same_equations_as_rows():
    surface, points = laser_scene(4, n=500)
    state = State(R_TRUE, LEVER_TRUE, tuple(s.moved(0.01, -0.02, 0.003) for s in SURFACES))
    rows = laser_rows(state, surface, points, np.full(500, 6.0), np.full(500, 0.8), 0.005, 0.001)
    direct, by_moments = accumulate(state, rows), laser_moments(state, rows, points).sums(state)
    ours, theirs = by_moments.groups["laser"], direct.groups["laser"]
    np.testing.assert_allclose(ours.normal, theirs.normal, rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(ours.right, theirs.right, rtol=1e-9, atol=1e-3)
    assert ours.squares == pytest.approx(theirs.squares)


def test_chunks_add_and_order_does_not_matter():
    surface, mbes, positions, T, moment, _ = scene(5, n=1000)
    state = State(R_TRUE, LEVER_TRUE, SURFACES, robust=(1.0, 3.0))

    def part(index):
        return sounding_rows(state, surface[index], mbes[index], positions[index], T[index], 0.008, 0.001)

    order = np.random.default_rng(0).permutation(1000)
    whole = accumulate(state, part(np.arange(1000)))
    halves = accumulate(state, part(order[:300])) + accumulate(state, part(order[300:]))
    for name, group in whole.groups.items():
        np.testing.assert_allclose(halves.groups[name].normal, group.normal, rtol=1e-9, atol=1e-6)
        assert (halves.groups[name].cut, halves.groups[name].reduced) == (group.cut, group.reduced)
    passes = np.zeros(1000, dtype=int)
    one = merge_scores([scores_of(state, part(np.arange(1000)), "mbes", passes, moment)])
    two = merge_scores([scores_of(state, part(i), "mbes", passes[i], moment[i]) for i in (order[:300], order[300:])])
    assert list(one.scores) == list(two.scores)
    np.testing.assert_allclose(list(one.scores.values()), list(two.scores.values()), rtol=1e-9, atol=1e-6)


def test_the_wall_alone_leaves_directions_open():
    surface, mbes, positions, T, *_ = scene(6, n=2000)
    only = surface == 1
    still = np.tile(T[0], (only.sum(), 1, 1))
    state = State(R_TRUE, LEVER_TRUE, SURFACES)
    rows = sounding_rows(state, surface[only], mbes[only], positions[only], still, 0.008, 0.001)
    solution = solve(laser_part(6, state).sums(state) + accumulate(state, rows))
    assert solution.deficiency >= 2  # y and z of the lever arm, at least
    assert np.all(np.isfinite(solution.step))


def test_a_wrong_pass_is_named_by_its_cell():
    surface, mbes, positions, T, moment, _ = scene(8)
    number = (moment >= 400).astype(int)
    positions[number == 1, 0] += 0.02
    state = State(R_TRUE, LEVER_TRUE, SURFACES)
    rows = sounding_rows(state, surface, mbes, positions, T, 0.008, np.radians(0.06))
    cells = cells_of(merge_scores([scores_of(state, rows, "mbes", number, moment)]), 0.003)
    assert abs(cells[("mbes", 1, 1)].mean_m + 0.02) < 0.002  # n = -x: moved by +2 cm is -2 cm along the normal
    assert abs(cells[("mbes", 1, 1)].normalised) > 5 > 1 > abs(cells[("mbes", 1, 0)].normalised)
    assert sum(c.normalised**2 for c in cells.values()) > consistency_limit(len(cells), 0.001)


def test_robust_weights_and_scales():
    v = np.array([0.0, 2.9, 3.1, 4.5, 5.9, 6.1, -4.5])
    w = igg3_weights(v, 3.0, 6.0)
    assert w[:2].tolist() == [1.0, 1.0]
    assert w[5] == 0.0
    assert w[3] == pytest.approx(3 / 4.5 * 0.25)
    assert w[6] == w[3]
    assert (np.diff(w[:6]) <= 0).all()
    normal = np.random.default_rng(0).normal(size=50_000)
    contaminated = np.concatenate([normal * 1.7, np.full(5000, 40.0)])
    assert scale_of(histogram(normal)) == pytest.approx(1.0, abs=0.02)
    assert 1.7 < scale_of(histogram(contaminated)) < 2.05
    assert scale_of(histogram(np.empty(0))) == 1.0


def test_the_weakest_direction_is_said_in_words():
    c = np.eye(6)
    assert "no two" in weakest_direction(c)
    c[2, 4] = c[4, 2] = 0.99
    words = weakest_direction(c)
    assert "yaw" in words
    assert "lever arm y" in words
    assert "+0.990" in words
