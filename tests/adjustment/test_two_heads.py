"""Two heads in one adjustment, on points of an own forward model: truth, covariance across the heads, signs."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from pipeline.adjustment.iteration import MountAdjustment, adjust_mount
from pipeline.config.pool import Adjust
from pipeline.maths.adjustment.parameters import State
from tests.support.forward_points import NOISY, QUIET, error_of, made, problem, solved


def covariance_of(found: MountAdjustment) -> np.ndarray:
    """Of both mounts (12, 12)."""
    places = np.searchsorted(found.solution.estimated, found.state.mounts)
    return found.solution.covariance[np.ix_(places, places)]


def test_without_noise_the_truth_of_both_heads_comes_back() -> None:
    found = solved(1, sensors=1e-7, heads=2)
    assert found.converged
    assert found.state.heads == ("mbes", "mbes_2")
    assert np.abs(error_of(found)).max() < 1e-7


@pytest.mark.thorough
def test_errors_of_both_heads_are_as_large_as_their_common_covariance_says() -> None:
    """Mean normalised squared error of the twelve, and of the heads' difference, where the cross-covariance counts."""
    repeats = 40
    of_both, of_difference = [], []
    difference = np.hstack([np.eye(6), -np.eye(6)])
    for seed in range(300, 300 + repeats):
        found = solved(seed, NOISY, heads=2)
        assert found.converged
        e, C = error_of(found), covariance_of(found)
        of_both.append(e @ np.linalg.solve(C, e))
        d, D = difference @ e, difference @ C @ difference.T
        of_difference.append(d @ np.linalg.solve(D, d))
    for found_mean, dof in ((np.mean(of_both), 12), (np.mean(of_difference), 6)):
        low, high = chi2.ppf([0.0005, 0.9995], dof * repeats) / repeats
        assert low < found_mean < high


def test_a_head_alone_is_less_certain_than_beside_another() -> None:
    """Both see the same drift of the INS and the same faces: each is better for the other, and they correlate."""
    streams, model = made(8, NOISY, heads=2)
    both = covariance_of(adjust_mount(problem(model, NOISY), streams, Adjust(), 5.0))
    streams, model = made(8, NOISY)
    alone = covariance_of(adjust_mount(problem(model, NOISY), streams, Adjust(), 5.0))
    assert np.all(np.diag(both)[:6] < 1.05 * np.diag(alone))
    assert np.diag(both)[:6].sum() < 0.98 * np.diag(alone).sum()
    sigma = np.sqrt(np.diag(both))
    assert np.abs((both / np.outer(sigma, sigma))[:6, 6:]).max() > 0.15


def test_the_covariance_of_both_is_that_of_a_dense_least_squares() -> None:
    """Derivatives by differences of distances computed here, one row a point; the INS is exact."""
    streams, model = made(5, QUIET, heads=2)
    found = adjust_mount(problem(model, QUIET), streams, Adjust(), 5.0)
    assert all(np.all(ping.effects.of_mean == 1) and ping.excess == 0 for ping in found.pings.values())
    chosen, rows = found.solution.estimated, []
    weights = []
    for sensor, stream in streams.items():
        (part,) = stream.parts
        seen = model.linearise(sensor, part.columns, found.values)
        weights.append(found.weighting.weights(seen)[1])
        rows.append(np.column_stack([slope(found.state, sensor, seen, model, k) for k in chosen]))
    A, w = np.concatenate(rows), np.concatenate(weights)
    dense = np.linalg.inv(A.T @ (w[:, None] * A))
    places = np.searchsorted(chosen, found.state.mounts)
    dense, sparse = dense[np.ix_(places, places)], covariance_of(found)
    sigma = np.sqrt(np.diag(dense))
    np.testing.assert_allclose(sparse / np.outer(sigma, sigma), dense / np.outer(sigma, sigma), atol=0.02)
    assert np.abs(dense[:6, 6:] / np.outer(sigma[:6], sigma[6:])).max() > 0.05  # not zero by accident


def slope(state: State, sensor: str, seen: Any, model: Any, number: int) -> np.ndarray:
    step = 1e-6 * np.eye(state.size)[number]
    ends = [distances(state.updated(sign * step), sensor, seen, model) for sign in (1, -1)]
    return (ends[0] - ends[1]) / 2e-6


def distances(state: State, sensor: str, seen: Any, model: Any) -> np.ndarray:
    """Distances (n,) m of a sensor's points from their surfaces, by the trajectory's poses and the state's mounts."""
    points, surfaces = seen.points, [state.surfaces[k] for k in seen.surface]
    if sensor == "laser":
        X = np.column_stack([points[f"{axis}_target_m"] for axis in "xyz"])
    else:
        R, lever = state.mount_of(sensor)
        positions, turns = model.body.trajectory.poses_at(points["t_ns"])
        body = np.column_stack([points[f"{axis}_mbes_m"] for axis in "xyz"]) @ R.T + lever
        X = positions + Rotation.from_matrix(turns).apply(body)
    normal, centre = (np.array([getattr(one, name) for one in surfaces]) for name in ("normal", "centre_m"))
    shift = np.array([one.shift_m for one in surfaces])
    return np.sum(normal * (X - centre), axis=1) - shift - model.height_of_face[points["face"]]


@pytest.mark.parametrize("head", ["mbes", "mbes_2"])
def test_a_clock_of_one_head_is_found_as_that_head_s(head: str) -> None:
    """Its points are stamped late; freed for both heads, the latency is that head's alone, with its sign."""
    streams, model = made(3, NOISY, heads=2)
    (part,) = streams[head].parts
    part.columns["t_ns"] = part.columns["t_ns"] + 20_000_000
    names = ("mbes_latency", "mbes_2_latency")
    settings = Adjust().model_copy(update={"free": ("mbes_latency",)})
    found = adjust_mount(problem(model, NOISY), streams, settings, 5.0)
    values = dict(zip(found.state.names, found.state.additional_values(), strict=True))
    for name in names:
        sigma = np.sqrt(found.solution.covariance.diagonal()[found.solution.estimated == found.state.names.index(name)])
        expected = 0.02 if name == f"{head}_latency" else 0.0
        assert abs(values[name] - expected) < 4 * sigma[0]
        assert sigma[0] < 0.004
    e = error_of(found)
    assert e @ np.linalg.solve(covariance_of(found), e) < chi2.isf(1e-4, 12)
