"""The compiled sums of a batch against numpy's: linearisation, weights and interval sums one after the other."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.adjustment.iteration import adjust_mount
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.adjustment.point_sums import SummedBatch, summed
from pipeline.artefacts.streams import Batch
from pipeline.config.pool import Adjust
from pipeline.maths.adjustment.interval_sums import IntervalSums, merged
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.robust_weights import histogram
from pipeline.maths.kernels.interval_group import COUNT, CUT, FIRST_BIN, INFORMATION, REDUCED
from tests.support.forward_points import NOISY, made, problem

Case = tuple[Batch, ObservationModel, CurrentValues]


@pytest.fixture(scope="module", params=["laser", "mbes"])
def sensor(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def adjusted() -> tuple[dict[str, Batch], ObservationModel, CurrentValues]:
    """Points, some of them outliers and near edges, at values with drift, factors, shares, scales and white noise."""
    streams, model = made(12, NOISY)
    values = adjust_mount(problem(model, NOISY), streams, Adjust(), 5.0).values
    surfaces = len(values.state.surfaces)
    by_surface = {name: np.linspace(0.8, 1.3, surfaces) for name in streams}
    white = np.array([0.002, 0.001, 0.003, 3e-5, 2e-5, 5e-5])
    weighting = replace(values.weighting, factors=by_surface, edge_shares=by_surface, scales=by_surface, white=white)
    random, batches = np.random.default_rng(2), {}
    for name, stream in streams.items():
        (part,) = stream.parts
        edge = random.choice([1.0, 0.4, 0.0], len(part.columns["t_ns"]), p=[0.8, 0.15, 0.05])
        batches[name] = {**part.columns, "edge_weight": edge}
    assert values.drift is not None
    assert values.weighting.robust is not None
    return batches, model, replace(values, weighting=replace(weighting, robust=(1.0, 2.5)))  # many are cut or reduced


def by_numpy(
    batch: Batch, model: ObservationModel, sensor: str, values: CurrentValues
) -> tuple[IntervalSums, np.ndarray]:
    observations, weighting = model.linearise(sensor, batch, values), values.weighting
    robust, weight = weighting.weights(observations)
    normalised = weighting.normalised(observations)
    rows = []
    for number in range(len(values.state.surfaces)):
        own = observations.surface == number
        w = robust[own]
        counts = [own.sum(), (w == 0).sum(), ((w > 0) & (w < 1)).sum(), observations.edge_weight[own][w > 0].sum()]
        rows.append(np.concatenate([counts, histogram(normalised[own])]))
    return observations.sums(weight), np.array(rows)


def assert_same(found: SummedBatch, expected: tuple[IntervalSums, np.ndarray]) -> None:
    sums, (of_intervals, statistics) = merged([found.sums]), expected
    for field in fields(IntervalSums):
        one, other = (getattr(each, field.name) for each in (sums, of_intervals))
        size = np.abs(other).max(axis=0)  # of each sum by itself: features differ by decades
        np.testing.assert_allclose(one / np.maximum(size, 1e-300), other / np.maximum(size, 1e-300), atol=1e-11)
    of_points = found.statistics[:, :FIRST_BIN]
    np.testing.assert_allclose(of_points, statistics[:, :FIRST_BIN], rtol=1e-12)
    assert of_points[:, [COUNT, CUT, REDUCED, INFORMATION]].sum(axis=0).min() > 0
    assert np.abs(found.statistics - statistics)[:, FIRST_BIN:].sum() <= 2  # of one point that lies on a limit


def test_the_same_as_numpys(adjusted: Case, sensor: str) -> None:
    batches, model, values = adjusted
    assert_same(summed(batches[sensor], model, sensor, values), by_numpy(batches[sensor], model, sensor, values))


def test_at_the_coarse_values_without_drift_and_weights(adjusted: Case, sensor: str) -> None:
    batches, model, _ = adjusted
    values = CurrentValues(model.coarse)
    found, expected = summed(batches[sensor], model, sensor, values), by_numpy(batches[sensor], model, sensor, values)
    np.testing.assert_allclose(found.statistics[:, CUT : REDUCED + 1], 0.0)
    np.testing.assert_allclose(merged([found.sums]).normal, expected[0].normal, rtol=1e-9, atol=1e-9)


def test_rows_in_any_order_and_read_only(adjusted: Case, sensor: str) -> None:
    batches, model, values = adjusted
    order = np.random.default_rng(5).permutation(len(batches[sensor]["t_ns"]))
    shuffled = {name: column[order] for name, column in batches[sensor].items()}
    for column in shuffled.values():
        column.flags.writeable = False
    assert_same(summed(shuffled, model, sensor, values), by_numpy(batches[sensor], model, sensor, values))


def test_a_laser_that_is_calibrated_is_placed_by_the_mount_of_the_state(adjusted: Case) -> None:
    batches, model, values = adjusted
    R = values.state.R_body_from_sensor
    lever_arm = model.body.lever_arm("laser", values.state) + np.array([0.01, -0.02, 0.03])
    state = State.at(R, lever_arm, values.state.surfaces, "laser")
    batch = {name: column[:200] for name, column in batches["laser"].items()}
    own = np.random.default_rng(3).normal(0, 5, (3, 200))
    batch |= {f"{axis}_laser_m": values for axis, values in zip("xyz", own, strict=True)}
    at = CurrentValues(state, values.drift, replace(values.weighting, robust=(1e6, 1e9)))
    found, (sums, _) = summed(batch, model, "laser", at), by_numpy(batch, model, "laser", at)
    np.testing.assert_allclose(merged([found.sums]).right, sums.right, rtol=1e-8, atol=1e-8 * np.abs(sums.right).max())


def test_no_points(adjusted: Case, sensor: str) -> None:
    batches, model, values = adjusted
    found = summed({name: column[:0] for name, column in batches[sensor].items()}, model, sensor, values)
    assert len(found.sums) == 0
    assert not found.statistics.any()


@given(first=st.integers(0, 5000), count=st.integers(1, 60), step=st.integers(1, 40))
@settings(max_examples=20, deadline=None)
def test_any_few_points(adjusted: Case, sensor: str, first: int, count: int, step: int) -> None:
    """From one point on: whatever surfaces, intervals and weights are among them."""
    batches, model, values = adjusted
    rows = (first + step * np.arange(count)) % len(batches[sensor]["t_ns"])
    batch = {name: column[rows] for name, column in batches[sensor].items()}
    expected, statistics = by_numpy(batch, model, sensor, values)
    found = summed(batch, model, sensor, values)
    np.testing.assert_allclose(found.statistics[:, :FIRST_BIN], statistics[:, :FIRST_BIN], rtol=1e-12)
    sums = merged([found.sums])
    np.testing.assert_array_equal(sums.record, expected.record)
    for one, other in ((sums.normal, expected.normal), (sums.right, expected.right)):
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-8 * np.abs(other).max(initial=0.0))
