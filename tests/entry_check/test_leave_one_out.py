"""The uncertainty by what passes have in common, against fits that really leave one out."""

import numpy as np
import pytest

from pipeline.entry_check.leave_one_out import leave_one_out, time_groups

SECOND = 10**9


@pytest.mark.parametrize(("starts_s", "groups"), [([0, 60, 120, 180], 4), ([0, 60], 4), ([0], 4), ([0, 60, 120], 6)])
def test_groups_are_passes_or_parts_of_them(starts_s: list[int], groups: int) -> None:
    times = np.concatenate([np.arange(start, start + 20) for start in starts_s]) * SECOND
    group = time_groups(times)
    assert np.unique(group).tolist() == list(range(groups))
    assert np.ptp(np.bincount(group)) <= 1
    passes = np.repeat(np.arange(len(starts_s)), 20)
    assert all(len(np.unique(passes[group == one])) == 1 for one in range(groups))
    random = np.random.default_rng(1).permutation(len(times))
    assert (time_groups(times[random]) == group[random]).all()


def test_variances_are_those_of_fits_without_each_group() -> None:
    """A line through points: the second of four groups lies higher."""
    random = np.random.default_rng(3)
    x, group = np.linspace(0, 1, 400), np.arange(400) % 4
    y = 2 * x + 1 + np.where(group == 1, 0.1, 0.0) + random.normal(0, 0.01, 400)
    A = np.stack([x, np.ones(400)], 1)
    whole = np.linalg.lstsq(A, y, rcond=None)[0]
    without = [np.linalg.lstsq(A[group != one], y[group != one], rcond=None)[0] for one in range(4)]
    expected = 3 / 4 * np.square(np.array(without) - whole).sum(axis=0)
    design, weight = A[:, None, :], np.ones(400)
    scores = A * (y - A @ whole)[:, None]
    found = leave_one_out(design, weight, scores, A.T @ A, group)
    assert found == pytest.approx(expected, rel=1e-6)
