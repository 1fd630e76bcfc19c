"""Sums in a file: those of all batches together, as in memory, whatever the batches and the blocks."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.adjustment.stored_sums import StoredSums
from pipeline.maths.adjustment.interval_sums import IntervalSums, LinearisedPoints, blocks, interval_sums, merged
from pipeline.maths.adjustment.weighting import edge_shares, rescaled, scatter

FEATURES, SURFACES = 5, 3
Keys = list[tuple[int, int]]
BATCHES = st.lists(
    st.lists(st.tuples(st.integers(0, 4), st.integers(0, SURFACES - 1)), max_size=12), min_size=1, max_size=5
)


def batch(keys: Keys, seed: int) -> IntervalSums:
    """Points with these records and surfaces, some of weight zero."""
    rng, n = np.random.default_rng(seed), len(keys)
    record, surface = np.array(sorted(keys), dtype=np.int64).reshape(-1, 2).T
    return interval_sums(
        LinearisedPoints(
            record=record,
            surface=surface,
            share=rng.uniform(size=n),
            features=np.vstack([np.ones((1, n)), rng.normal(size=(FEATURES - 1, n))]),
            weight=np.where(rng.uniform(size=n) < 0.1, 0.0, rng.uniform(0.5, 2.0, n)),
            v_m=rng.normal(size=n),
        )
    )


def stored(pieces: Sequence[IntervalSums]) -> StoredSums:
    return StoredSums.of(iter(pieces), FEATURES)


def same(found: IntervalSums, expected: IntervalSums) -> None:
    for name in IntervalSums.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
        assert getattr(found, name).flags.c_contiguous


@given(BATCHES)
def test_they_are_the_sums_of_all_batches_together(batches: list[Keys]) -> None:
    pieces = [batch(keys, seed) for seed, keys in enumerate(batches)]
    expected, found = merged(pieces), stored(pieces)
    same(found.selected(slice(None)), expected)
    np.testing.assert_array_equal(found.record, expected.record)
    np.testing.assert_array_equal(found.surface, expected.surface)
    assert (len(found), found.features) == (len(expected), FEATURES)
    some = np.flatnonzero(expected.surface == 1)[::-1]
    same(found.selected(some), expected.selected(some))


def test_without_a_batch_there_is_no_interval() -> None:
    empty = stored([])
    assert len(empty) == 0
    assert empty.selected(slice(None)).normal.shape == (0, FEATURES, FEATURES)
    assert not list(blocks(empty))
    assert scatter(empty, np.zeros(0, dtype=bool), 1.0).factor == 1.0


@pytest.fixture
def many() -> list[IntervalSums]:
    """Intervals of 60 records on two surfaces; those at the ends of batches are spread over two or three of them."""
    keys = [(k // 20, k // 10 % 2) for k in range(1200)]
    return [batch(keys[start : start + 5], start) for start in range(0, 1200, 5)]


def test_each_change_is_that_of_all_and_they_follow_one_another(
    many: list[IntervalSums], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("pipeline.maths.adjustment.interval_sums", "pipeline.adjustment.stored_sums"):
        monkeypatch.setattr(f"{module}.BLOCK", 7)
    whole, divisors = merged(many), np.array([2.0, 0.5, 1.0])
    shift = np.random.default_rng(0).normal(size=(len(whole), FEATURES))
    assert len(whole) % 7
    found = stored(many)
    divided = found.changed(lambda block, _: rescaled(block, divisors))
    moved = divided.shifted(shift)
    expected = rescaled(whole, divisors).shifted(shift)
    backwards = np.arange(len(whole))[::-1]
    same(moved.selected(backwards), expected.selected(backwards))
    same(moved.stored(lambda block: rescaled(block, divisors)).selected(slice(None)), rescaled(expected, divisors))
    same(found.selected(slice(None)), whole)  # as before


def test_of_shifts_one_after_another_one_is_kept(many: list[IntervalSums]) -> None:
    whole, divisors = merged(many), np.array([2.0, 0.5, 1.0])
    first, second, third = np.random.default_rng(0).normal(size=(3, len(whole), FEATURES))
    found = stored(many).shifted(first).changed(lambda block, _: rescaled(block, divisors))
    found = found.shifted(second).shifted(third)
    expected = rescaled(whole.shifted(first), divisors).shifted(second).shifted(third)
    for name in IntervalSums.__dataclass_fields__:
        np.testing.assert_allclose(getattr(found.selected(slice(None)), name), getattr(expected, name), rtol=1e-9)
    assert len(found.changes) == 3


def test_the_scatter_and_the_edge_shares_do_not_depend_on_the_blocks(
    many: list[IntervalSums], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, found = merged(many), stored(many)
    rows = whole.surface == 1
    expected, shares = scatter(whole, rows, 0.9), edge_shares(whole, SURFACES)
    monkeypatch.setattr("pipeline.maths.adjustment.interval_sums.BLOCK", 7)
    again = scatter(found, rows, 0.9)
    assert (again.squares, again.dof) == pytest.approx((expected.squares, expected.dof), rel=1e-12)
    np.testing.assert_allclose(edge_shares(found, SURFACES), shares, rtol=1e-12)
