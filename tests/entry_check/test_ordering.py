"""Pairs by the order of a file: right ones stand in order, those of chance do not."""

from itertools import pairwise

import numpy as np
import pytest

from pipeline.entry_check.ordering import Windows, in_order, longest_rise, whole_pings
from tests.support.entered import ANGLES, BEAMS, LEVER, Boat, rotation


@pytest.mark.parametrize("values", [[3, 1, 4, 1, 5, 9, 2, 6], [5, 4, 3], [1, 2, 2, 3], []])
def test_the_longest_rise_is_that_of_all_subsequences(values: list[int]) -> None:
    found = longest_rise(np.array(values, dtype=np.int64))
    rising = [values[place] for place in found]
    assert all(a < b for a, b in pairwise(rising))
    longest = 0
    for choice in range(1 << len(values)):
        some = [value for place, value in enumerate(values) if choice >> place & 1]
        if all(a < b for a, b in pairwise(some)):
            longest = max(longest, len(some))
    assert len(found) == longest


@pytest.mark.parametrize("direction", [1, -1])
def test_a_fifth_of_right_windows_is_found_among_those_of_chance(direction: int) -> None:
    random = np.random.default_rng(1)
    run = random.integers(0, 10_000, 1000)
    right = random.random(1000) < 0.2
    file = np.where(right, direction * run * 7, random.integers(-70_000, 70_000, 1000)) + 70_000
    windows = Windows(run[:, None] + np.arange(5), file[:, None] + np.arange(5), 1)
    found = in_order(windows)
    assert found is not None
    kept = set(zip(found.run_rows[:, 0].tolist(), found.file_rows[:, 0].tolist(), strict=True))
    wanted = set(zip(run[right].tolist(), file[right].tolist(), strict=True))
    assert len(kept & wanted) > 0.8 * len(wanted)


def test_windows_of_chance_are_none() -> None:
    random = np.random.default_rng(2)
    run, file = random.permutation(2000), random.permutation(2000)
    assert in_order(Windows(run[:, None] + np.arange(5), file[:, None] + np.arange(5), 1)) is None


@pytest.mark.parametrize("reverse", [False, True])
def test_one_window_gives_its_whole_ping_but_for_beams_beyond_a_gap(reverse: bool) -> None:
    boat = Boat()
    points = boat.placed(rotation(ANGLES), LEVER)[::-1] if reverse else boat.placed(rotation(ANGLES), LEVER)
    kept = np.ones(len(points), bool)
    gap = 3 * BEAMS + 15  # in the fourth ping
    place = len(points) - 1 - np.arange(len(points)) if reverse else np.arange(len(points))
    kept[place[gap]] = False
    rows = np.arange(kept.sum())
    where = np.cumsum(kept) - 1  # row of each point
    own = 3 * BEAMS + np.arange(5, 10)
    windows = Windows(own[None], where[place[own]][None], 1)
    (found, other), share = whole_pings(windows, boat.soundings, points[kept], rows, 0.002)
    assert found.tolist() == list(range(3 * BEAMS, 3 * BEAMS + 15))
    assert other.tolist() == where[place[found]].tolist()
    assert share == pytest.approx(30 / 40)


def test_passes_in_another_order_are_all_found() -> None:
    run = np.arange(900)
    file = np.concatenate([np.arange(600, 900), np.arange(300, 600), np.arange(300)])  # where its three passes stand
    found = in_order(Windows(run[:, None] + np.arange(5), file[:, None] + np.arange(5), 1))
    assert found is not None
    assert sorted(found.run_rows[:, 0].tolist()) == run.tolist()


def test_a_sounding_that_the_file_holds_twice_has_two_pairs() -> None:
    boat = Boat()
    once = boat.placed(rotation(ANGLES), LEVER)
    both = np.concatenate([once, once + np.array([0.1, 0.0, 0.0])])
    own = 3 * BEAMS + np.arange(5, 10)
    windows = Windows(np.stack([own, own]), np.stack([own, own + len(once)]), 1)
    (found, other), _ = whole_pings(windows, boat.soundings, both, np.arange(len(both)), 0.002)
    assert found.tolist() == np.repeat(3 * BEAMS + np.arange(BEAMS), 2).tolist()
    assert set(other.tolist()) == {*found.tolist(), *(found + len(once)).tolist()}
