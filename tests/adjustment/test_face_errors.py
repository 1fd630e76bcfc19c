"""Shifts of single faces: equations, signs, and what they add to the total covariance."""

from dataclasses import replace

import numpy as np

from pipeline.adjustment.face_errors import FinalSolution, final_solution, with_shared_noise
from pipeline.adjustment.iteration import adjust_mount
from pipeline.adjustment.observation_model import ObservationModel
from pipeline.artefacts.streams import Stream
from pipeline.config.pool import Adjust
from tests.support.forward_points import MBES_ONLY, NOISY, error_of, made, problem

LEVEL_FACE = MBES_ONLY  # the sonar alone sees this horizontal face


def solved_with_faces(streams: dict[str, Stream], model: ObservationModel) -> FinalSolution:
    calibration = problem(model, NOISY)
    adjustment = adjust_mount(calibration, streams, Adjust(), 5.0)
    sums = {}
    for sensor, stream in streams.items():
        (part,) = stream.parts
        observations = model.linearise(sensor, part.columns, adjustment.values)
        _, weight = adjustment.weighting.weights(observations)
        sums[sensor] = observations.sums(weight, by_face=True)
    found = final_solution(calibration, adjustment, with_shared_noise(calibration, adjustment, sums))
    if all(ping.excess == 0 for ping in adjustment.pings.values()):  # else sums of faces are approximate
        u = adjustment.state.size
        scale = np.sqrt(np.maximum(np.diag(adjustment.equations.normal), 1e-300))
        alike = found.equations.normal[:u, :u] / scale / scale[:, None]
        np.testing.assert_allclose(alike, adjustment.equations.normal / scale / scale[:, None], atol=1e-3)
    return found


def sensitivity_of(found: FinalSolution, face: int) -> np.ndarray:
    """Change (6,) of the mount by the face's shift."""
    return found.solution.sensitivity[:6, found.solution.fixed.tolist().index(found.names.index(f"face_{face}"))]


def test_its_effect_is_what_the_shift_does_to_the_mount() -> None:
    """Little noise, with and without the shift along the normal: the truth is the estimate plus S times the error."""
    streams, model = made(12, NOISY, sensors=0.02)
    moved, _ = made(12, NOISY, sensors=0.02, shifted={LEVEL_FACE: 0.006})
    calibration = problem(model, NOISY)
    errors = [error_of(adjust_mount(calibration, points, Adjust(), 5.0)) for points in (moved, streams)]
    expected = 0.006 * sensitivity_of(solved_with_faces(streams, model), LEVEL_FACE)
    assert abs(expected[5]) > 0.005
    np.testing.assert_allclose((errors[0] - errors[1])[5], expected[5], rtol=0.05)
    np.testing.assert_allclose((errors[0] - errors[1])[3:5], expected[3:5], atol=1e-4)
    np.testing.assert_allclose((errors[0] - errors[1])[:3], expected[:3], atol=3e-5)


def test_a_face_that_looks_against_its_family_stands_out_the_other_way() -> None:
    streams, model = made(12, NOISY)
    sense = model.faces.sense.copy()
    sense[LEVEL_FACE] = -1.0
    turned = replace(model, faces=replace(model.faces, sense=sense))
    found, other = (sensitivity_of(solved_with_faces(streams, one), LEVEL_FACE) for one in (model, turned))
    np.testing.assert_allclose(other, -found, rtol=1e-9)


def test_a_face_that_both_sensors_see_alone_in_its_family_moves_nothing() -> None:
    """Its shift is that of the surface."""
    found = solved_with_faces(*made(13, NOISY))
    sigma = np.sqrt(np.diag(found.solution.covariance))[:6]
    np.testing.assert_array_less(np.abs(sensitivity_of(found, 1)) * 1e-3, 1e-3 * sigma)
