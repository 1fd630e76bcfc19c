"""The sigma of noise that is seen through a gate."""

import numpy as np
import pytest

from pipeline.target.gate import sigma_through_gate


@pytest.mark.parametrize("gate_in_sigmas", [1.0, 2.0, 3.0, 5.0])
def test_the_sigma_of_noise_that_a_gate_cuts_off(gate_in_sigmas: float) -> None:
    noise = np.abs(np.random.default_rng(1).normal(0.0, 0.02, size=200_000))
    gate_m = 0.02 * gate_in_sigmas
    assert sigma_through_gate(float(np.median(noise[noise < gate_m])), gate_m) == pytest.approx(0.02, rel=0.1)


@pytest.mark.parametrize(("median_m", "sigma_m"), [(0.0, 5e-5), (0.025, 0.1), (0.03, 0.1)])
def test_medians_that_no_normal_noise_has(median_m: float, sigma_m: float) -> None:
    """Nothing scatters; or the noise is without a centre within the gate, or farther off than that."""
    assert sigma_through_gate(median_m, 0.05) == pytest.approx(sigma_m)
