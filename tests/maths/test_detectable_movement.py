"""What the joint test could show: its power, by drawing differences and by an independent distribution."""

import numpy as np
import pytest
from scipy.stats import binom, chi2, ncx2

from pipeline.maths.detectable_movement import detectable_movement

UNITS = np.concatenate([np.full(3, 1e-4), np.full(3, 1e-3)])


def covariance(seed):
    """Of a difference: rad and m, strongly correlated."""
    rng = np.random.default_rng(seed)
    mixed = rng.normal(size=(6, 6)) + np.ones(6)
    full = mixed @ mixed.T + 0.2 * np.eye(6)
    return full * np.outer(UNITS, UNITS)


def share_found(C, movement, level, seed=1, draws=4000):
    """Share of differences with this mean and covariance whose statistic is beyond the limit."""
    rng = np.random.default_rng(seed)
    drawn = movement + rng.normal(size=(draws, 6)) @ np.linalg.cholesky(C).T
    T = np.einsum("ni,ij,nj->n", drawn, np.linalg.inv(C), drawn)
    return np.mean(chi2.ppf(1 - level, 6) < T)


def band(power, draws=4000):
    return [bound / draws for bound in binom.ppf([0.001, 0.999], draws, power)]


@pytest.mark.parametrize(("level", "power"), [(0.01, 0.95), (0.01, 0.8), (0.05, 0.95)])
@pytest.mark.parametrize("k", [0, 4])
def test_a_movement_of_this_size_is_found_with_this_power(level, power, k):
    """Alone, and together with what hides it best. Half as large a one is found less often."""
    C = covariance(k)
    found = detectable_movement(C, level, power)
    alone = np.zeros(6)
    alone[k] = found.alone[k]
    hidden = C[:, k] / C[k, k] * found.surely[k]
    assert hidden[k] == pytest.approx(found.surely[k])
    low, high = band(power)
    for movement in (alone, hidden):
        assert low <= share_found(C, movement, level) <= high
        assert share_found(C, movement / 2, level) < low
    assert low <= ncx2.sf(chi2.ppf(1 - level, 6), 6, alone @ np.linalg.inv(C) @ alone) <= high


def test_no_companion_hides_it_better():
    """Of all movements with this component, the least power is the stated one."""
    C, rng = covariance(3), np.random.default_rng(3)
    found, inverse = detectable_movement(C, 0.01), np.linalg.inv(covariance(3))
    for k in range(6):
        least = C[:, k] / C[k, k] * found.surely[k]
        for _ in range(50):
            other = least + rng.normal(size=6) * UNITS
            other[k] = found.surely[k]
            assert other @ inverse @ other >= least @ inverse @ least - 1e-9
    assert np.all(found.alone <= found.surely)
    assert np.any(found.alone < 0.7 * found.surely)


def test_without_correlation_both_are_the_same():
    found = detectable_movement(np.diag(UNITS**2), 0.01)
    np.testing.assert_allclose(found.alone, found.surely, rtol=1e-12)
    expected = ncx2.sf(chi2.ppf(0.99, 6), 6, (found.surely / UNITS) ** 2)
    np.testing.assert_allclose(expected, 0.95, atol=1e-6)


def test_units_do_not_matter():
    C, scale = covariance(5), np.repeat([np.degrees(1.0), 1000.0], 3)
    one, other = detectable_movement(C, 0.01), detectable_movement(C * np.outer(scale, scale), 0.01)
    np.testing.assert_allclose(other.surely, one.surely * scale, rtol=1e-9)
    np.testing.assert_allclose(other.alone, one.alone * scale, rtol=1e-9)
