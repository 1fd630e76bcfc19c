"""Means against a tolerance: their sigmas, their level over many bins, and what lies on either side."""

import numpy as np
import pytest
from scipy import stats

from pipeline.maths.adjustment.mean_tests import joint_limit, normal_deviates
from pipeline.maths.adjustment.pose_errors import DriftEstimate, Knots, PoseNoise, drift_between_passes
from pipeline.maths.adjustment.residual_means import (
    BinnedResiduals,
    bin_means,
    differences_from_rest,
    merged_residual_sums,
    residual_sums,
    step_differences,
)

TOLERATED = 0.003


def sums_of(bins, slots, v_m, sigma_m=0.01, surface=0):
    number = len(v_m)
    first, weight, size = np.full(number, surface), np.full(number, sigma_m**-2), np.zeros(number)
    return residual_sums(BinnedResiduals(first, np.asarray(bins), np.asarray(slots), weight, np.asarray(v_m), size))


def session(rng, bins=40, slots=15, points=4, common_m=0.005, sigma_m=0.01):
    """Points by bin and time slot, with noise of their own and noise common to a slot's points."""
    bin_, slot, _ = np.indices((bins, slots, points)).reshape(3, -1)
    slot += 1000 * bin_
    shared = rng.normal(0, common_m, (bins * slots,))[np.repeat(np.arange(bins * slots), points)]
    return bin_, slot, shared + rng.normal(0, sigma_m, len(bin_))


def alarms(rng, sessions, offset_m, tolerated, level, **figures):
    found = 0
    for _ in range(sessions):
        bins, slots, v = session(rng, **figures)
        sign = np.where(bins % 2, 1.0, -1.0)
        cells = bin_means(sums_of(bins, slots, v + sign * offset_m))
        figures_of = (np.array([getattr(one, name) for one in cells]) for name in ("mean_m", "sigma_mean_m", "dof"))
        u = normal_deviates(*figures_of, tolerated)
        found += bool(np.max(np.abs(u)) > joint_limit(len(cells), level))
    return found


@pytest.mark.parametrize(
    ("offset_m", "tolerated", "slots"), [(0.0, 0.0, 15), (TOLERATED, TOLERATED, 15), (0.0, 0.0, 5)]
)
def test_the_level_over_all_bins_is_as_promised(offset_m, tolerated, slots):
    """300 sessions of 40 bins, 5 or 15 slots each: false alarms at 10 % within what chance allows; at the tolerance's
    edge half of them. With five slots, taken together with the others', fewer."""
    level, sessions = 0.1, 300
    found = alarms(np.random.default_rng(7), sessions, offset_m, tolerated, level, slots=slots)
    assert found <= stats.binom.ppf(0.999, sessions, level)
    assert found >= stats.binom.ppf(0.001, sessions, level * (0.2 if slots == 5 else 0.4 if tolerated else 0.8))


def test_moments_that_share_noise_count_as_one_each():
    """Taken point by point, noise common to time slots would raise the alarm in nearly every session."""
    rng = np.random.default_rng(8)
    assert alarms(rng, 60, 0.0, 0.0, 0.01, points=50, common_m=0.01) <= stats.binom.ppf(0.999, 60, 0.01)
    bins, slots, v = session(rng, points=50, common_m=0.01)
    pointwise = v[bins == 0].std() / np.sqrt(np.sum(bins == 0))
    assert bin_means(sums_of(bins, slots, v))[0].sigma_mean_m > 3 * pointwise


@pytest.mark.parametrize(("beyond_m", "rejected"), [(-0.0005, False), (0.004, True)])
def test_both_sides_of_the_tolerance(beyond_m, rejected):
    found = alarms(np.random.default_rng(9), 20, TOLERATED + beyond_m, TOLERATED, 0.001, slots=60, common_m=0.002)
    assert found == (20 if rejected else 0)


def test_within_the_tolerance_nothing_is_left_over():
    u = normal_deviates(np.array([0.0029, -0.0031, -0.004]), np.full(3, 1e-6), np.full(3, 50.0), TOLERATED)
    assert u[0] == 0.0
    assert u[2] < u[1] < 0


@pytest.mark.parametrize("dof", [8.0, 20.0, 300.0])
@pytest.mark.parametrize("chance", [0.05, 1e-4, 1e-6])
def test_few_moments_are_held_to_students_quantile(dof, chance):
    """The normal deviate of Student's quantile, and never more."""
    t = stats.t.isf(chance / 2, dof)
    u = float(normal_deviates(np.array(t), np.array(1.0), np.array(dof), 0.0))
    exact = stats.norm.isf(chance / 2)
    assert u == pytest.approx(exact, rel=0.01)
    assert u <= exact * (1 + 1e-6)


def test_the_limit_over_many_bins_leaves_the_level_to_all_of_them_together():
    for number, level in ((1, 0.001), (7, 0.05), (500, 0.001), (500, 0.2)):
        each = 2 * stats.norm.sf(joint_limit(number, level))
        assert 1 - (1 - each) ** number == pytest.approx(level, rel=1e-6)


def test_a_mean_of_unequal_moments():
    """Against its definition, by hand: three time slots of 1, 2 and 4 points."""
    v = np.array([0.010, 0.02, 0.04, 0.00, 0.02, 0.00, 0.02])
    slots = np.array([0, 1, 1, 2, 2, 2, 2])
    (cell,) = bin_means(sums_of(np.zeros(7, dtype=int), slots, v, sigma_m=0.001))
    counts, means = np.array([1, 2, 4]), np.array([0.010, 0.03, 0.01])
    equal = 49 / 21
    mean = counts @ means / 7
    scatter = np.sum((counts * (means - mean)) ** 2)
    own = scatter / 49 * equal / (equal - 1)
    usual = 0.001**2 / 7 + (scatter - 7 * 0.001**2) / 21 / equal
    sigma = np.sqrt((8 * usual + (equal - 1) * own) / (8 + equal - 1))
    assert (cell.count, cell.slots, cell.dof) == (7, 3, pytest.approx(8 + equal - 1))
    assert (cell.mean_m, cell.sigma_mean_m) == (pytest.approx(mean), pytest.approx(sigma))


def test_moments_that_agree_by_chance_are_no_surer_than_their_points():
    (cell,) = bin_means(sums_of(np.zeros(16, dtype=int), np.arange(16), np.full(16, 0.004), sigma_m=0.01))
    assert cell.sigma_mean_m == pytest.approx(0.01 / 4)


def test_a_face_seen_for_half_a_second_is_held_against_what_the_others_scatter():
    """33 mm off with six time slots that scatter by several millimetres: Student's t of five would pass it."""
    rng = np.random.default_rng(2)
    bins, slots, v = session(rng, bins=10, slots=80, points=15, common_m=0.001, sigma_m=0.005)
    few = (bins < 9) | (slots < 9006)
    v[bins == 9] += -0.033 + 0.006 * np.resize([1, -1, 0.5], 80)[slots[bins == 9] - 9000]
    cells = bin_means(sums_of(bins[few], slots[few], v[few], sigma_m=0.005))
    figures = (np.array([getattr(one, name) for one in cells]) for name in ("mean_m", "sigma_mean_m", "dof"))
    u = normal_deviates(*figures, TOLERATED)
    assert cells[9].slots == 6
    assert -u[9] > joint_limit(500, 0.001)
    assert np.all(u[:9] == 0)


def test_a_batch_of_few_points_in_a_long_time_is_counted_alike():
    rng = np.random.default_rng(3)
    bins, slots, v = rng.integers(0, 5, 50), rng.integers(0, 10**6, 50), rng.normal(size=50)
    sparse = sums_of(bins, slots, v)
    pieces = merged_residual_sums([sums_of(bins[:20], slots[:20], v[:20]), sums_of(bins[20:], slots[20:], v[20:])])
    np.testing.assert_array_equal(sparse.key, pieces.key)
    np.testing.assert_allclose(sparse.sums, pieces.sums)
    order = np.lexsort((slots, bins))
    np.testing.assert_array_equal(sparse.key, np.column_stack([np.zeros(50), bins[order], slots[order]]))


# --- differences -------------------------------------------------------------------------------------------------
def test_a_step_is_found_where_it_is():
    rng = np.random.default_rng(4)
    angle, slot = (one.ravel() for one in np.meshgrid(np.arange(-5, 30), np.arange(80)))
    v = 0.010 * (angle >= 12) - 0.004 + rng.normal(0, 0.004, len(angle))
    cells = step_differences(sums_of(angle, slot, v, sigma_m=0.004), 4)
    assert [cell.key for cell in cells] == [(0, border) for border in range(-4, 30)]
    largest = max(cells, key=lambda cell: abs(cell.mean_m) / cell.sigma_mean_m)
    assert largest.key == (0, 12)
    assert largest.mean_m == pytest.approx(0.010, abs=3 * largest.sigma_mean_m)
    assert largest.sigma_mean_m == pytest.approx(0.004 * np.sqrt(2 / 320), rel=0.2)
    assert all(abs(cell.mean_m) < 0.002 for cell in cells if not 8 < cell.key[1] < 16)


def test_noise_that_a_moment_shares_does_not_hide_a_step():
    """A wander of the boat moves both sides of a step alike; it cancels, and the sigma knows."""
    rng = np.random.default_rng(5)
    angle, slot = (one.ravel() for one in np.meshgrid(np.arange(0, 16), np.arange(60)))
    v = rng.normal(0, 0.02, 60)[slot] + rng.normal(0, 0.002, len(slot))
    cells = step_differences(sums_of(angle, slot, v, sigma_m=0.002), 4)
    assert max(cell.sigma_mean_m for cell in cells if 4 <= cell.key[1] <= 12) < 0.0005
    assert min(cell.sigma_mean_m for cell in bin_means(sums_of(angle, slot, v, sigma_m=0.002))) > 0.002


def test_surfaces_do_not_step_into_each_other():
    first, bins = np.repeat([0, 1], 4), np.concatenate([[1, 1, 2, 2], [3, 3, 4, 4]])
    one = residual_sums(BinnedResiduals(first, bins, np.tile([0, 1], 4), np.ones(8), np.arange(8.0), np.zeros(8)))
    assert [cell.key for cell in step_differences(one, 4)] == [(0, 2), (1, 4)]


def test_a_pass_that_differs_is_told_from_the_others():
    """Five millimetres, of which the adjustment took a third: the difference is still five."""
    rng = np.random.default_rng(6)
    number, slot = np.repeat(np.arange(4), 200), np.arange(800)
    v = np.where(number == 2, 0.0035, -0.0015) + rng.normal(0, 0.002, 800)
    cells = differences_from_rest(sums_of(number, slot, v, sigma_m=0.002))
    assert [cell.key[1] for cell in cells] == [0, 1, 2, 3]
    assert cells[2].mean_m == pytest.approx(0.005, abs=4 * cells[2].sigma_mean_m)
    assert max(cells, key=lambda cell: abs(cell.mean_m)).key == (0, 2)
    others = 0.002 * np.sqrt(1 / 200 + 1 / 600)
    assert cells[2].sigma_mean_m == pytest.approx(others, rel=0.15)
    assert differences_from_rest(sums_of(np.zeros(200, dtype=int), np.arange(200), v[:200])) == []


def drifted(rng, noise, seconds):
    """A Gauss-Markov process from its covariance, not from its recursion."""
    covariance = np.exp(-np.abs(np.subtract.outer(seconds, seconds)) / noise.time_constant_s)
    root = np.linalg.cholesky(covariance + 1e-12 * np.eye(len(seconds)))
    return root @ rng.normal(size=(len(seconds), 6)) * noise.drift


def test_drift_of_a_pass_against_the_others_has_the_sigma_allowed():
    noise = PoseNoise(np.zeros(6), np.array([0.015, 0.015, 0.02, 1e-4, 2e-4, 5e-4]), 60.0)
    seconds = np.concatenate([start + np.arange(0, 20, 2.0) for start in (0.0, 80.0, 160.0, 240.0)])
    number = np.append(np.repeat(np.arange(4), 10)[:-1], -1)  # the last knot lies behind the last pass
    knots = Knots(np.arange(40), seconds, np.ones(39, dtype=bool))
    rng, one_course = np.random.default_rng(10), np.full(40, 2.8)
    u = []
    for _ in range(400):
        found = drift_between_passes(DriftEstimate(knots, drifted(rng, noise, seconds)), noise, number, one_course)
        assert found.passes.tolist() == [0, 1, 2, 3]
        u.append(found.difference / found.sigma)
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(u), axis=0)), 1.0, atol=0.14)
    step = np.zeros((40, 6))
    step[number == 1, 5] = 0.003
    values = drift_between_passes(DriftEstimate(knots, step), noise, number, one_course).difference
    np.testing.assert_allclose(values[:, 5], [-0.003 * 10 / 29, 0.003, -0.003 * 10 / 29, -0.003 * 10 / 30])


@pytest.mark.parametrize("turn", [np.pi, np.pi / 2], ids=["opposite", "across"])
@pytest.mark.parametrize("boat_fixed", [False, True])
def test_roll_that_keeps_to_the_boat_turns_with_it_on_another_course(boat_fixed, turn):
    """The sigma is that of the kind whose passes differ more: here that of errors that keep to the boat."""
    noise = PoseNoise(np.zeros(6), np.array([0.015, 0.015, 0.02, 2e-4, 2e-4, 5e-4]), 200.0)
    seconds = np.concatenate([start + np.arange(0, 20, 2.0) for start in (0.0, 80.0, 160.0, 240.0)])
    number, knots = np.repeat(np.arange(4), 10), Knots(np.arange(40), seconds, np.ones(39, dtype=bool))
    bow = 0.4 + turn * (number % 2)
    rng = np.random.default_rng(11)
    u, alike = [], []
    for _ in range(400):
        values = drifted(rng, noise, seconds)
        if boat_fixed:
            turned = (values[:, 3] + 1j * values[:, 4]) * np.exp(1j * bow)
            values[:, 3:5] = np.column_stack([turned.real, turned.imag])
        found = drift_between_passes(DriftEstimate(knots, values), noise, number, bow)
        u.append(found.difference / found.sigma)
        alike.append(found.sigma[:, 3] / noise.drift[3] / (found.sigma[:, 0] / noise.drift[0]))
    rms = np.sqrt(np.mean(np.square(u), axis=0))
    np.testing.assert_allclose(np.delete(rms, [3, 4], axis=1), 1.0, atol=0.14)
    if boat_fixed:
        np.testing.assert_allclose(rms[:, 3:5], 1.0, atol=0.14)
    else:
        np.testing.assert_allclose(rms[:, 3:5] * np.mean(alike, axis=0)[:, None], 1.0, atol=0.14)
        assert np.all(rms[:, 3:5] < (0.75 if turn == np.pi else 0.9))


def test_drift_of_a_single_pass_is_held_against_zero():
    noise = PoseNoise(np.zeros(6), np.full(6, 0.01), 200.0)
    knots = Knots(np.arange(3), np.array([0.0, 1.0, 2.0]), np.ones(2, dtype=bool))
    steady = DriftEstimate(knots, np.full((3, 6), 0.02))
    found = drift_between_passes(steady, noise, np.zeros(3, dtype=int), np.zeros(3))
    np.testing.assert_allclose(found.difference, 0.02)
    np.testing.assert_allclose(found.sigma, 0.01, rtol=0.01)
