"""Roughness: what it adds to the variance of means over a wall, against walls whose fields are known."""

from collections.abc import Callable

import numpy as np
import pytest

from pipeline.maths.adjustment.ping_differences import Lines
from pipeline.maths.adjustment.rough_blocks import SIZES_M, PlacedLines
from pipeline.maths.adjustment.roughness import OF_PLACE, Walls, covering, of_wall

Array = np.ndarray
LENGTH_M, PINGS, PASSES = 12.0, 300, 4
SIGMA_M, NOISE_M = 0.004, 0.001  # of the field, and of a line's mean
Field = Callable[[Array], Array]


def field(rng: np.random.Generator, length_m: float, sigma_m: float = SIGMA_M) -> Field:
    """A field along the wall with covariance σ² exp(-t² / 2 ℓ²)."""
    waves, phases = rng.normal(size=64) / length_m, rng.uniform(0, 2 * np.pi, 64)
    return lambda place: sigma_m * np.sqrt(2 / 64) * np.cos(np.outer(place, waves) + phases).sum(axis=1)


def lines(rng: np.random.Generator, wall: Field, passes: int = PASSES, drift_m: float = 0.0) -> PlacedLines:
    """Lines of passes along the wall, each with its own noise and its own slow drift."""
    place = np.tile(np.linspace(0.0, LENGTH_M, PINGS), passes)
    run = np.repeat(np.arange(passes), PINGS)
    drifts = [field(rng, 2.0, drift_m) for _ in range(passes)]
    value = wall(place) + NOISE_M * rng.normal(size=len(place))
    value += np.concatenate([drift(place[run == k]) for k, drift in enumerate(drifts)])
    return PlacedLines(value, np.full(len(place), NOISE_M**-2.0), place, run)


def certain_effects(found: PlacedLines) -> Array:
    """By size of the blocks what roughness adds to the design effect, zero where it is not certain."""
    return np.array([one.added * one.certain for one in found.by_size()])


@pytest.mark.parametrize("length_m", [0.1, 0.3])
def test_the_design_effect_is_that_of_the_mean_of_the_wall(length_m: float) -> None:
    """Over many walls the variance of the mean is that of independent noise, times the effect in the mean."""
    means, effects = [], []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        found = lines(rng, field(rng, length_m))
        means.append(np.mean(found.value) / (NOISE_M / np.sqrt(len(found.value))))
        effects.append(1 + certain_effects(found).max())
    assert np.mean(effects) == pytest.approx(np.mean(np.square(means)), rel=0.35)
    expected = np.sqrt(2 * np.pi) * length_m * SIGMA_M**2 / LENGTH_M / (NOISE_M**2 / (PINGS * PASSES))  # ω G
    assert np.mean(effects) == pytest.approx(expected, rel=0.35)


def test_the_effect_grows_with_the_size_of_blocks_until_they_are_longer_than_the_field() -> None:
    added = np.mean([_by_size(seed, 0.3) for seed in range(40)], axis=0)
    assert added[0] < 0.7 * added[1] < 0.7 * 1.1 * added[2]
    assert len(SIZES_M) == len(added)


def _by_size(seed: int, length_m: float) -> Array:
    rng = np.random.default_rng(seed)
    return certain_effects(lines(rng, field(rng, length_m)))


def test_what_differs_from_pass_to_pass_is_no_roughness() -> None:
    """Drift of 2 mm, which noise of a tenth of a millimetre in a block's mean shows clearly."""
    drawn = [lines(np.random.default_rng(seed), np.zeros_like, drift_m=0.002) for seed in range(40)]
    found = [certain_effects(one).max() for one in drawn]
    assert np.mean(np.array(found) == 0.0) > 0.9


def test_a_single_pass_has_roughness_where_it_scatters_more_than_its_noise() -> None:
    smooth, rough = (
        certain_effects(lines(np.random.default_rng(1), wall, passes=1)).max()
        for wall in (np.zeros_like, field(np.random.default_rng(2), 0.2))
    )
    assert smooth == 0.0
    assert rough > 100.0


def test_blocks_that_one_of_two_passes_has_seen_say_nothing() -> None:
    """The second pass sees 0.9 m: the blocks that only the first one has seen may scatter by its own errors."""
    rng = np.random.default_rng(3)
    found = lines(rng, np.zeros_like, passes=2, drift_m=0.01)
    seen = (found.run == 0) | (found.place_m < 0.9)
    part = PlacedLines(found.value[seen], found.weight[seen], found.place_m[seen], found.run[seen])
    assert certain_effects(part).max() == 0.0
    assert not any(one.tested for one in part.by_size())


def test_few_blocks_say_nothing() -> None:
    rng = np.random.default_rng(1)
    found = lines(rng, field(rng, 0.3))
    near = found.place_m < 0.6
    short = PlacedLines(found.value[near], found.weight[near], found.place_m[near], found.run[near])
    assert certain_effects(short).max() == 0.0


@pytest.mark.parametrize(("drift_m", "length_m", "least"), [(0.0, 0.2, 0.9), (0.003, 0.0, 0.0)])
def test_two_passes_of_a_short_wall_are_rough_where_they_are_alike(
    drift_m: float, length_m: float, least: float
) -> None:
    """1.2 m of wall, four blocks of 25 cm or more in two passes: too few pairs for a test."""
    found = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        wall = field(rng, length_m, 0.01) if length_m else np.zeros_like
        whole = lines(rng, wall, passes=2, drift_m=drift_m)
        near = whole.place_m < 1.2
        short = PlacedLines(whole.value[near], whole.weight[near], whole.place_m[near], whole.run[near])
        found.append(certain_effects(short).max() > 0)
    assert np.mean(found) >= least
    assert least or np.mean(found) < 0.4


@pytest.mark.parametrize(("sigma_m", "low", "high"), [(0.0, 0.0, 0.003), (SIGMA_M, 0.9, 1.0)])
def test_four_passes_of_a_short_wall_are_rough_where_it_is(sigma_m: float, low: float, high: float) -> None:
    """Few blocks: a normal limit for what they have in common finds roughness on three of a hundred smooth walls."""
    found = []
    for seed in range(60 if sigma_m else 500):
        rng = np.random.default_rng(seed)
        whole = lines(rng, field(rng, 0.2, sigma_m))
        near = whole.place_m < 1.6
        short = PlacedLines(whole.value[near], whole.weight[near], whole.place_m[near], whole.run[near])
        found.append(certain_effects(short).max() > 0)
    assert low <= np.mean(found) <= high


def at_place(per_length: Array, G: Array, dof: Array, height_m: float | Array = 2.0, **changed: Array) -> Walls:
    """Walls with blocks of all sizes that say the same; all are tested, and the first is certain."""
    shape = 2, len(G), len(SIZES_M)
    added = np.broadcast_to((per_length * G)[:, None], shape).copy()
    first = np.zeros(shape, dtype=bool)
    first[0, 0, 0] = True
    values = {"added": added, "certain": first, "tested": np.ones(shape, dtype=bool)} | changed
    return Walls(**values, per_length=per_length, height_m=np.broadcast_to(height_m, len(G)).astype(float), dof=dof)


def test_a_short_wall_is_as_rough_as_the_place_and_a_long_one_as_it_is_itself() -> None:
    """G is 3, 1 and 0 of walls with 100, 20 and 0 degrees of freedom; the last has no soundings."""
    per_length, dof = np.array([2.0, 5.0, 4.0, 0.0]), np.array([100.0, 20.0, 0.0, 0.0])
    found = at_place(per_length, np.array([3.0, 1.0, 0.0, 0.0]), dof).roughness()
    of_place = (100 * 3.0 + 20 * 1.0) / 120
    assert found.added[2] == pytest.approx(4.0 * of_place)
    assert found.added[1] == pytest.approx(5.0 * (20 * 1.0 + OF_PLACE * of_place) / (20 + OF_PLACE))
    assert 0.95 < found.added[0] / 6.0 < 1.0
    assert found.added[3] == found.patch_m[3] == 0.0
    np.testing.assert_allclose(found.patch_m[:3] ** 2 * SIZES_M[0] * per_length[:3], found.added[:3])


def test_a_low_wall_averages_over_fewer_patches() -> None:
    """Two walls of one field: over a height of 1 m the lines' means vary by four times as much as over 4 m."""
    per_length, dof = np.ones(2), np.array([50.0, 0.0])
    found = at_place(per_length, np.array([1.0, 0.0]), dof, np.array([4.0, 1.0])).roughness()
    assert found.added[1] == pytest.approx(4.0)


def test_the_growth_with_the_size_is_that_of_all_walls_together() -> None:
    """One wall shows by its long blocks that G is three times that of the short ones; the other has none so long."""
    added = np.zeros((2, 2, len(SIZES_M)))
    added[0, 0], added[0, 1] = [1.0, 2.0, 3.0, 3.0], [1.0, 0.0, 0.0, 0.0]
    found = at_place(np.ones(2), np.ones(2), np.array([40.0, 40.0]), added=added).roughness()
    np.testing.assert_allclose(found.added, [3.0, 3.0])
    added[0, 0] = [0.1, 9.0, 9.0, 9.0]  # s V(s) cannot grow faster than s
    found = at_place(np.ones(2), np.ones(2), np.array([40.0, 40.0]), added=added).roughness()
    assert found.added[1] <= 8.0


def test_where_no_test_finds_roughness_short_walls_have_what_is_likely() -> None:
    """The first wall is tested and smooth; the second is too short for a test, and its passes are nearly alike."""
    shape = 2, 2, len(SIZES_M)
    certain, tested = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    tested[:, 0], certain[0, 1, 0] = True, True
    per_length, dof = np.ones(2), np.array([60.0, 2.0])
    found = at_place(per_length, np.array([0.2, 7.0]), dof, certain=certain, tested=tested).roughness()
    np.testing.assert_allclose(found.added, [0.0, 7.0])
    certain[0, 0, 3] = True  # of the smooth wall: found where it has blocks for a test
    tested[0, 0, 3] = False
    found = at_place(per_length, np.array([0.2, 7.0]), dof, certain=certain, tested=tested).roughness()
    np.testing.assert_allclose(found.added, [0.0, 7.0])


def test_the_sharing_of_a_place_is_the_best_of_means() -> None:
    """Walls whose G varies by half of it, each known by few blocks: the squares of what is wrong are the smallest."""
    rng, dof = np.random.default_rng(4), 8
    own = np.maximum(rng.normal(1.0, 0.5, 4000), 0.0)
    seen = own * rng.chisquare(dof, len(own)) / dof
    shared = at_place(np.ones(len(own)), seen, np.full(len(own), float(dof))).roughness().added
    wrong = [np.mean((values - own) ** 2) for values in (shared, seen, np.full(len(own), seen.mean()))]
    assert wrong[0] < 0.8 * min(wrong[1:])


def test_passes_that_overlap_in_part_leave_no_error_for_a_test() -> None:
    """Seven passes of four blocks, each farther by two: as many blocks and passes as means, so nothing is left over."""
    rng = np.random.default_rng(2)
    wall, place = field(rng, 0.2), np.linspace(0.0, 4.0, 4 * PINGS, endpoint=False)
    parts = [place[(place >= 0.5 * k) & (place < 0.5 * k + 1.0)] for k in range(7)]
    where, run = np.concatenate(parts), np.repeat(np.arange(7), [len(part) for part in parts])
    value = wall(where) + 1e-5 * rng.normal(size=len(where))
    with np.errstate(all="raise"):
        found = PlacedLines(value, np.full(len(where), 1e10), where, run).by_size()[0]
    assert not found.tested
    assert found.added > 0


def test_a_place_that_was_rough_with_more_walls_stays_rough() -> None:
    nothing = np.zeros((2, 2, len(SIZES_M)), dtype=bool)
    walls = at_place(np.ones(2), np.array([2.0, 1.0]), np.array([20.0, 20.0]), certain=nothing)
    assert not walls.roughness().added.any()
    again = walls.roughness(shown=True)
    assert (again.added > 1.0).all()
    assert again.shown


def test_lines_that_cover_a_part_of_the_height_are_told_pass_by_pass() -> None:
    """The second pass covers half of the height that the first does; in each a ledge hides some more."""
    heights_m = np.array([4.0, 4.0, 2.7, 4.0, 3.0, 2.0, 2.0, 1.5, 1.2, 2.0])
    runs = np.repeat([3, 7], 5)
    told = covering(heights_m**2 / 12, runs)
    assert told.tolist() == [True, True, False, True, True, True, True, True, False, True]


@pytest.mark.parametrize("fans", [True, False])
def test_lines_of_a_part_of_the_height_have_their_weight_all_the_same(fans: bool) -> None:
    """Half of the lines see half of the height, where the wall has another shape: noise of a decimetre in their means.

    Their weight is half of that of whole lines. So the effect is 1.5 times that of the whole lines alone.
    """
    rng = np.random.default_rng(5)
    whole = lines(rng, field(rng, 0.3))
    n, part = len(whole.value), 0.1 * rng.normal(size=len(whole.value))
    of_part = np.repeat([False, True], n)
    total, height_m = np.where(of_part, 0.5, 1.0) * whole.weight[0], np.where(of_part, 1.0, 2.0)
    both = Lines(
        record=np.arange(2 * n), surface=np.zeros(2 * n, dtype=int), total=total, spread=total * height_m**2 / 12,
        mean=np.concatenate([whole.value, part]), slope=np.concatenate([whole.value, part]),
        along=np.tile([0.0, 1.0], (2 * n, 1)), of_mean=total, of_slope=total, sloping=np.ones(2 * n, dtype=bool),
    )  # fmt: skip
    place, run = np.tile(whole.place_m, 2), np.tile(whole.run, 2)
    means, slopes = of_wall(both, np.arange(2 * n), place, run, fans, walls=1)
    alone = whole.by_size()
    if fans:
        assert [one.added for one in means] == pytest.approx([1.5 * one.added for one in alone])
        assert [one.added for one in slopes] == pytest.approx([1.125 / 3 * one.added for one in alone])
        assert [one.tested for one in means] == [one.tested for one in alone]
    else:
        all_lines = PlacedLines(both.mean, total, place, run).by_size()
        assert [one.added for one in means] == [one.added for one in all_lines]
        assert means[0].added != pytest.approx(1.5 * alone[0].added, rel=0.05)  # as a filter would have it
