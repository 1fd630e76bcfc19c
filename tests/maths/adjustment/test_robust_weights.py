"""What robust weights leave of the variance, and variance factors of families with few observations."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from pipeline.maths.adjustment.robust_weights import igg3_weights, robust_effects
from pipeline.maths.adjustment.weighting import PRIOR_DOF, shrunk_factors


@pytest.mark.parametrize(("k0", "k1"), [(1.5, 3.0), (3.0, 6.0), (2.0, 8.0)])
def test_the_variance_that_the_weights_leave_is_the_integral(k0: float, k1: float) -> None:
    def squares(z: float) -> float:
        return float(igg3_weights(np.array([z]), k0, k1)[0] * z * z * norm.pdf(z))

    integral = 2 * (quad(squares, 0, k0)[0] + quad(squares, k0, k1)[0])
    assert robust_effects(k0, k1).kept == pytest.approx(integral / (1 - 2 * norm.sf(k1)), rel=1e-7)


@pytest.mark.parametrize(("k0", "k1"), [(1.5, 3.0), (3.0, 6.0), (2.0, 1000.0)])
def test_of_a_common_error_and_of_their_noise_means_show_what_is_stated(k0: float, k1: float) -> None:
    shift, z = 0.05, np.random.default_rng(5).normal(size=(100_000, 20))
    of = robust_effects(k0, k1)
    both = np.concatenate([z, -z]) + shift  # without the noise of the mean
    w = igg3_weights(both, k0, k1)
    assert np.sum(w * both) / w.sum() / shift == pytest.approx(of.shift, abs=0.002)  # 1 would fail
    w = igg3_weights(z, k0, k1)
    means, plain = np.sum(w * z, axis=1) / w.sum(axis=1), z.mean(axis=1)
    variance = 1 / z.shape[1] + np.mean(means**2 - plain**2)  # the plain mean's is known: its chance is taken off
    assert variance / np.mean(1 / w.sum(axis=1)) == pytest.approx(of.variance, abs=0.004)


LEVEL = np.array([False, False, False, True, True])


def test_a_family_of_many_observations_has_its_own_factor() -> None:
    factors, dof = np.array([9.0, 1.0, 8.0, 0.5, 2.0]), np.full(5, 1e7)
    np.testing.assert_allclose(shrunk_factors(factors, dof, LEVEL), factors, rtol=1e-5)


def test_a_family_that_no_interval_sees_has_that_of_its_kind() -> None:
    factors, dof = np.array([4.0, 4.0, 100.0, 9.0, 100.0]), np.array([1e7, 1e7, 0.0, 1e7, 0.0])
    found = shrunk_factors(factors, dof, LEVEL)
    assert found[2] == pytest.approx(4.0, rel=1e-5)
    assert found[4] == pytest.approx(9.0, rel=1e-5)


def test_a_kind_that_no_interval_sees_has_the_sensors_factor_and_without_any_the_sessions_sigmas_stay() -> None:
    factors, dof = np.array([2.0, 4.0, 6.0, 50.0, 50.0]), np.array([1e7, 1e7, 1e7, 0.0, 0.0])
    np.testing.assert_allclose(shrunk_factors(factors, dof, LEVEL)[3:], 4.0, rtol=1e-5)
    np.testing.assert_allclose(shrunk_factors(factors, 0 * dof, LEVEL), 1.0)


def test_between_these_the_others_count_as_a_few_observations() -> None:
    factors, dof = np.array([4.0, 1.0]), np.array([3 * PRIOR_DOF, 1e9])
    found = shrunk_factors(factors, dof, np.array([False, False]))
    assert found[0] == pytest.approx((1.0 + 3 * 4.0) / 4, rel=1e-4)
    assert found[1] == pytest.approx(1.0, rel=1e-4)
    alone = shrunk_factors(np.array([4.0]), np.array([1e9]), np.array([True]))
    assert alone[0] == pytest.approx(4.0)
