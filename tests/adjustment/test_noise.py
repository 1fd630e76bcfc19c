"""Noise that differs from face to face, or that soundings share: weights, sigmas, and what the tables say of it."""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from pipeline.adjustment.iteration import MountAdjustment, adjust_mount
from pipeline.adjustment.noise_tables import groups_table, sigma_check
from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.pool import Adjust
from tests.support.effort import often
from tests.support.forward_points import QUIET, columns, error_of, made, problem

REPEATS = often(8, 60)
SLANTED = (0, 2)  # faces P1 and P3
TIMES = 4.0  # the noise of ranges there, in sigmas of the session

Noise = Callable[[np.random.Generator, np.ndarray, np.ndarray], np.ndarray]


def noisier_on_slanted_faces(rng: np.random.Generator, t_ns: np.ndarray, face: np.ndarray) -> np.ndarray:
    return np.where(np.isin(face, SLANTED), 0.008 * np.sqrt(TIMES**2 - 1) * rng.normal(size=len(t_ns)), 0.0)


def shared_for_a_third_of_a_second(rng: np.random.Generator, t_ns: np.ndarray, face: np.ndarray) -> np.ndarray:
    slot = t_ns // 333_000_000
    return np.asarray(0.006 * rng.normal(size=slot.max() - slot.min() + 1)[slot - slot.min()])


def with_errors_of_ranges(seed: int, errors: Noise | None) -> tuple[MountAdjustment, pd.DataFrame]:
    """The adjustment of soundings with further errors of their ranges, and the check of its sigmas."""
    streams, model = made(seed)
    if errors is not None:
        (part,) = streams["mbes"].parts
        x = np.column_stack([part.columns[f"{axis}_mbes_m"] for axis in "xyz"])
        t_ns, face = part.columns["t_ns"], part.columns["face"]
        further = errors(np.random.default_rng(seed), t_ns, face) / np.linalg.norm(x, axis=1)
        streams["mbes"] = Stream((MemoryPart("m", columns(t_ns, face, x * (1 + further)[:, None], "mbes_m")),))
    found = adjust_mount(problem(model, QUIET), streams, Adjust(), 5.0)
    return found, sigma_check(found)


@pytest.fixture(scope="module")
def usual() -> list[tuple[MountAdjustment, pd.DataFrame]]:
    return [with_errors_of_ranges(seed, None) for seed in range(200, 200 + REPEATS)]


def test_slanted_faces_that_are_noisier_get_their_own_weight_and_the_sigmas_stay_true() -> None:
    squared, slanted, others = [], [], []
    for seed in range(200, 200 + REPEATS):
        found, _ = with_errors_of_ranges(seed, noisier_on_slanted_faces)
        e = error_of(found)
        squared.append(e @ np.linalg.solve(found.solution.covariance[:6, :6], e))
        factors, scales = (by["mbes"] for by in (found.weighting.factors, found.weighting.scales))
        slanted.append(factors[list(SLANTED)])
        others.append(factors[[1, 3]])
        assert np.all(np.abs(scales - 1) < 0.25)  # so no good sounding on a noisier face was taken for an outlier
    low, high = chi2.ppf([0.0005, 0.9995], 6 * REPEATS) / REPEATS
    assert low < np.mean(squared) < high
    assert TIMES**2 / 2 < np.mean(slanted) < TIMES**2  # the noise of angles, which is as configured, has a part
    assert np.mean(others) == pytest.approx(1.0, abs=0.1)


def test_the_check_of_the_sigmas_is_one_in_the_mean(usual: list[tuple[MountAdjustment, pd.DataFrame]]) -> None:
    ratio, dof = (np.array([check[name] for _, check in usual]) for name in ("slots_ratio", "slots_dof"))
    assert np.all(dof > 3)
    sigma = np.sqrt(2 / dof.sum(axis=0))  # of the mean over all slots of all repeats
    assert np.all(np.abs((ratio * dof).sum(axis=0) / dof.sum(axis=0) - 1) < 3.5 * sigma)


def test_what_soundings_share_for_longer_than_a_ping_shows_in_the_check() -> None:
    found = [with_errors_of_ranges(seed, shared_for_a_third_of_a_second)[1] for seed in range(300, 304)]
    mean = np.mean([check["slots_ratio"] for check in found], axis=0)
    assert mean.max() > 2


def test_the_table_has_the_families_together_and_each_alone(
    usual: list[tuple[MountAdjustment, pd.DataFrame]],
) -> None:
    found, _ = usual[0]
    groups = groups_table(found).set_index("group")
    names = ["laser", "mbes_vertical", "mbes_horizontal", "ins_white", "ping"]
    assert groups.index[:5].tolist() == names
    assert groups.index[5:].tolist() == [f"{sensor}:{family}" for sensor in ("laser", "mbes") for family in
                                         ("P1", "P2", "P3", "H")]  # fmt: skip
    for name in ("count", "cut", "reduced"):
        assert groups.loc["laser", name] == groups.loc["laser:P1":"laser:H", name].sum()
        assert groups.loc["mbes_vertical", name] == groups.loc["mbes:P1":"mbes:P3", name].sum()
        assert groups.loc["mbes_horizontal", name] == groups.loc["mbes:H", name]
    of_families = groups.loc["mbes:P1":"mbes:P3", "variance_factor"]
    assert of_families.min() < groups.loc["mbes_vertical", "variance_factor"] < of_families.max()
    alone = groups.loc["mbes:H"]
    assert alone["variance_factor"] == pytest.approx(groups.loc["mbes_horizontal", "variance_factor"])
    assert groups["mean_effect"].notna().tolist() == [False] * 9 + [True] * 4


def test_without_a_solution_there_is_no_check() -> None:
    streams, model = made(8)
    for name, stream in streams.items():
        (part,) = stream.parts
        wall = part.columns["face"] == 1
        streams[name] = Stream((MemoryPart(part.name, {k: v[wall] for k, v in part.columns.items()}),))
    assert sigma_check(adjust_mount(problem(model, QUIET), streams, Adjust(), 5.0)).empty
