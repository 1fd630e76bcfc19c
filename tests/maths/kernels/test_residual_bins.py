"""Residuals in bins, against numpy's sums by number: few bins and many, none and one residual, slots far apart."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.maths.adjustment.residual_means import BinnedResiduals, merged_residual_sums, residual_sums


def by_numpy(given_residuals: BinnedResiduals) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    keys = np.column_stack([given_residuals.first, given_residuals.second, given_residuals.slot])
    key, code = np.unique(keys, axis=0, return_inverse=True)
    weight, v_m = given_residuals.weight, given_residuals.v_m
    parts = (weight, weight * v_m, np.ones(len(v_m)), v_m**2)
    sums = np.column_stack([np.bincount(code.ravel(), part, len(key)) for part in parts])
    largest = np.zeros(len(key))
    np.maximum.at(largest, code.ravel(), given_residuals.normalised)
    return key, sums, largest


@given(
    seed=st.integers(0, 2**32),
    points=st.integers(0, 300),
    spans=st.tuples(*[st.sampled_from([1, 3, 1000])] * 2, st.sampled_from([1, 50, 10**9])),
    batches=st.integers(1, 4),
)
@settings(max_examples=50, deadline=None)
def test_sums_are_those_of_numpy(seed: int, points: int, spans: tuple[int, ...], batches: int) -> None:
    rng = np.random.default_rng(seed)
    numbers = [rng.integers(-span, span, points) for span in spans]
    values = [rng.random(points), rng.normal(size=points), rng.random(points)]
    pieces = []
    for batch in range(batches):
        rows = slice(batch, None, batches)
        pieces.append(residual_sums(BinnedResiduals(*(column[rows] for column in (*numbers, *values)))))
    found = merged_residual_sums(pieces)
    key, sums, largest = by_numpy(BinnedResiduals(*numbers, *values))
    np.testing.assert_array_equal(found.key, key.reshape(-1, 3))
    np.testing.assert_allclose(found.sums, sums, rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(found.largest, largest)
