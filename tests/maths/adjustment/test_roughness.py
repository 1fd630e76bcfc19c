"""Roughness: what it adds to the variance of means over a wall, against walls whose fields are known."""

from collections.abc import Callable

import numpy as np
import pytest

from pipeline.maths.adjustment.roughness import SIZES_M, _PlacedLines

Array = np.ndarray
LENGTH_M, PINGS, PASSES = 12.0, 300, 4
SIGMA_M, NOISE_M = 0.004, 0.001  # of the field, and of a line's mean
Field = Callable[[Array], Array]


def field(rng: np.random.Generator, length_m: float, sigma_m: float = SIGMA_M) -> Field:
    """A field along the wall with covariance σ² exp(-t² / 2 ℓ²)."""
    waves, phases = rng.normal(size=64) / length_m, rng.uniform(0, 2 * np.pi, 64)
    return lambda place: sigma_m * np.sqrt(2 / 64) * np.cos(np.outer(place, waves) + phases).sum(axis=1)


def lines(rng: np.random.Generator, wall: Field, passes: int = PASSES, drift_m: float = 0.0) -> _PlacedLines:
    """Lines of passes along the wall, each with its own noise and its own slow drift."""
    place = np.tile(np.linspace(0.0, LENGTH_M, PINGS), passes)
    run = np.repeat(np.arange(passes), PINGS)
    drifts = [field(rng, 2.0, drift_m) for _ in range(passes)]
    value = wall(place) + NOISE_M * rng.normal(size=len(place))
    value += np.concatenate([drift(place[run == k]) for k, drift in enumerate(drifts)])
    return _PlacedLines(value, np.full(len(place), NOISE_M**-2.0), place, run)


@pytest.mark.parametrize("length_m", [0.1, 0.3])
def test_the_design_effect_is_that_of_the_mean_of_the_wall(length_m: float) -> None:
    """Over many walls the variance of the mean is that of independent noise, times the effect in the mean."""
    means, effects = [], []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        found = lines(rng, field(rng, length_m))
        means.append(np.mean(found.value) / (NOISE_M / np.sqrt(len(found.value))))
        effects.append(1 + found.by_size()[:, 0].max())
    assert np.mean(effects) == pytest.approx(np.mean(np.square(means)), rel=0.35)
    expected = np.sqrt(2 * np.pi) * length_m * SIGMA_M**2 / LENGTH_M / (NOISE_M**2 / (PINGS * PASSES))  # ω G
    assert np.mean(effects) == pytest.approx(expected, rel=0.35)


def test_the_effect_grows_with_the_size_of_blocks_until_they_are_longer_than_the_field() -> None:
    added = np.mean([_by_size(seed, 0.3) for seed in range(40)], axis=0)
    assert added[0] < 0.7 * added[1] < 0.7 * 1.1 * added[2]
    assert len(SIZES_M) == len(added)


def _by_size(seed: int, length_m: float) -> Array:
    rng = np.random.default_rng(seed)
    return lines(rng, field(rng, length_m)).by_size()[:, 0]


def test_what_differs_from_pass_to_pass_is_no_roughness() -> None:
    """Drift of 2 mm, which noise of a tenth of a millimetre in a block's mean shows clearly."""
    found = [lines(np.random.default_rng(seed), np.zeros_like, drift_m=0.002).by_size().max() for seed in range(40)]
    assert np.mean(np.array(found) == 0.0) > 0.9


def test_a_single_pass_has_roughness_where_it_scatters_more_than_its_noise() -> None:
    smooth, rough = (
        lines(np.random.default_rng(1), wall, passes=1).by_size()[:, 0].max()
        for wall in (np.zeros_like, field(np.random.default_rng(2), 0.2))
    )
    assert smooth == 0.0
    assert rough > 100.0


def test_few_blocks_say_nothing() -> None:
    rng = np.random.default_rng(1)
    found = lines(rng, field(rng, 0.3))
    near = found.place_m < 0.6
    short = _PlacedLines(found.value[near], found.weight[near], found.place_m[near], found.run[near])
    assert short.by_size()[:, 0].max() == 0.0


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
        short = _PlacedLines(whole.value[near], whole.weight[near], whole.place_m[near], whole.run[near])
        found.append(short.by_size()[:, 0].max() > 0)
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
        short = _PlacedLines(whole.value[near], whole.weight[near], whole.place_m[near], whole.run[near])
        found.append(short.by_size()[:, 0].max() > 0)
    assert low <= np.mean(found) <= high
