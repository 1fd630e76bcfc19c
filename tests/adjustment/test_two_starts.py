"""The start from the other side of the walls' normal: where it lies, and that it changes no result with one minimum."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.adjustment import two_starts
from pipeline.adjustment.accumulation import accumulate
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.two_starts import chosen_iteration
from pipeline.adjustment.weighted_iteration import WeightedIteration, weighted_iteration
from pipeline.artefacts.streams import Stream
from pipeline.config.pool import Adjust
from pipeline.maths.adjustment.mirrored_mount import mirrored_mount
from pipeline.maths.adjustment.normal_equations import Linearisation
from tests.support.forward_points import LEVER_TRUE, NOISY, R_TRUE, made, problem
from tests.support.one_wall import made_of_wall


def linearised(streams: dict[str, Stream], model: ObservationModel) -> Linearisation:
    return Linearisation(accumulate(streams, model, CurrentValues(model.coarse)).sums, model.coarse, model.body)


def scale_of_distances(streams: dict[str, Stream], model: ObservationModel, R_body_from_mbes: np.ndarray) -> float:
    """By how much a metre of the distance from the wall x = 0 appears longer with this rotation, as a share.

    What roll, lever arm x and y, and yaw make of the distance by the boat's heading δ is taken off: terms with height
    and δ.
    """
    (batch,) = streams["mbes"].batches()
    sensor = np.column_stack([batch[f"{axis}_mbes_m"] for axis in "xyz"])
    body, T = sensor @ R_body_from_mbes.T + LEVER_TRUE, model.body.trajectory
    points = T.points_from_body(batch["t_ns"], body)
    heading = np.array([np.arctan2(-R[0, 1], R[1, 1]) for R in T.poses_at(batch["t_ns"])[1]])
    heading -= heading.mean()
    away = body[:, 0] - LEVER_TRUE[0]
    terms = np.column_stack([away, np.ones_like(away), body[:, 2], heading, heading * away, heading * body[:, 2]])
    return float(np.linalg.lstsq(terms, points[:, 0], rcond=None)[0][0])


def test_a_fan_turned_to_the_other_side_sees_one_wall_at_the_same_distances() -> None:
    """A fan square to the wall would see them longer by 6e-4; one turned the wrong way, shorter by 5e-3."""
    streams, model = made_of_wall(3, sensors=0.0)
    other = mirrored_mount(linearised(streams, model))
    assert other is not None
    turn = Rotation.from_matrix(other.R_body_from_sensor @ R_TRUE.T).as_rotvec(degrees=True)
    assert turn[2] == pytest.approx(4.0, abs=0.5)  # the true yaw is -2°, the mean heading less than 0.3°
    assert np.abs(turn[:2]).max() < 0.1
    assert other.lever_arm_m[1] - LEVER_TRUE[1] < -0.2  # so far along the wall the mean sounding comes back
    square = Rotation.from_rotvec(turn / 2, degrees=True).as_matrix() @ R_TRUE
    longer = [scale_of_distances(streams, model, R) for R in (R_TRUE, other.R_body_from_sensor, square)]
    assert longer[1] - longer[0] == pytest.approx(0.0, abs=2e-4)
    assert longer[2] - longer[0] == pytest.approx(1 / np.cos(np.radians(turn[2] / 2)) - 1, abs=2e-4)


def test_walls_of_several_directions_have_no_other_side() -> None:
    assert mirrored_mount(linearised(*made(3))) is None


def unsurveyed(model: ObservationModel) -> CalibrationProblem:
    """The problem of a wall that nobody has surveyed."""
    surveyed = problem(model, NOISY)
    return replace(surveyed, prior=replace(surveyed.prior, from_start=True))


def test_one_minimum_leaves_the_first_result_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    streams, model = made_of_wall(3, NOISY)
    first = weighted_iteration(unsurveyed(model), streams, Adjust(), 5.0)
    starts = []

    def counted(*arguments: Any) -> WeightedIteration:
        starts.append(arguments[4:])
        return weighted_iteration(*arguments)

    monkeypatch.setattr(two_starts, "weighted_iteration", counted)
    chosen = chosen_iteration(unsurveyed(model), streams, Adjust(), 5.0)
    assert len(starts) == 2
    assert chosen.rival is None
    assert chosen_iteration(problem(model, NOISY), streams, Adjust(), 5.0).rival is None
    assert len(starts) == 3  # a surveyed wall has no second start
    found, same = (one.last.linearisation.state for one in (chosen.weighted, first))
    assert np.array_equal(found.R_body_from_sensor, same.R_body_from_sensor)
    assert np.array_equal(found.lever_arm_m, same.lever_arm_m)


def test_several_heads_at_one_wall_are_in_doubt(monkeypatch: pytest.MonkeyPatch) -> None:
    streams, model = made_of_wall(3, NOISY)
    first = weighted_iteration(unsurveyed(model), streams, Adjust(), 5.0)
    monkeypatch.setattr(two_starts, "weighted_iteration", lambda *_: first)
    coarse = SimpleNamespace(heads=("mbes", "mbes_2"), mounts=[])
    two_heads = SimpleNamespace(prior=unsurveyed(model).prior, model=SimpleNamespace(coarse=coarse))
    chosen = chosen_iteration(cast(Any, two_heads), streams, Adjust(), 5.0)
    assert chosen.weighted is first
    assert chosen.rival is not None
    assert chosen.rival.strength == 0.0
    mount = first.last.linearisation.state.R_body_from_sensor
    off_deg = Rotation.from_matrix(mount @ R_TRUE.T).as_rotvec(degrees=True)[2]  # the true yaw is -2°
    assert np.degrees(chosen.rival.apart[2]) == pytest.approx(-2 * (-2.0 + off_deg), abs=0.6)  # twice the mean heading
