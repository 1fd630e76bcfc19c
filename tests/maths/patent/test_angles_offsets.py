"""The patent's steps against clouds that were turned and shifted by other means: signs, gains, the coupling."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.patent.angles import (
    AngleTolerances,
    angle_deviations,
    angle_step,
    iterate_angles,
    patent_cosines,
)
from pipeline.maths.patent.offsets import (
    AlternationTolerances,
    OffsetObservations,
    alternate,
    patent_offsets,
)
from tests.support.straight_passes import DRY, normals_of, several, straight_pass

DOWN = np.array([0.0, 0.0, -1.0])


@pytest.mark.parametrize(("axis", "index"), [((1, 0, 0), 0), ((0, 1, 0), 1), ((0, 0, 1), 2)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_turn_about_one_axis_is_that_deviation_alone(axis, index, sign):
    turn = Rotation.from_rotvec(sign * 0.01 * np.array(axis)).as_matrix()
    found = angle_deviations(normals_of(turn), normals_of())
    expected = np.zeros(3)
    expected[index] = sign * 0.01
    np.testing.assert_allclose(found, expected, atol=6e-5)  # second order: 0.01² / 2


def test_the_fourth_normal_points_down():
    np.testing.assert_allclose(normals_of()["P4"], DOWN, atol=1e-15)


def test_the_patents_pitch_cosine_takes_in_roll():
    """Why its sign rule fails whenever roll exceeds pitch: both change n4 · n1 with equal weight."""

    def cosine(axis):
        turned = normals_of(Rotation.from_rotvec(0.01 * np.array(axis)).as_matrix())
        return patent_cosines(turned, normals_of())["cosine_pitch_mbes"]

    assert abs(abs(cosine((1, 0, 0))) - abs(cosine((0, 1, 0)))) < 1e-4 < abs(cosine((1, 0, 0)))


@pytest.mark.parametrize("axis", range(3))
def test_one_angle_alone_comes_back_with_its_sign(axis):
    error = np.zeros(3)
    error[axis] = np.radians(1.0)
    passes, _, lever = several(error, np.zeros(3))
    result = iterate_angles([one.planes for one in passes], lever, AngleTolerances(60, 1e-9, 1e-9))
    assert result.converged
    np.testing.assert_allclose(result.rotation_vector_rad, error, atol=1e-7)


def test_a_straight_pass_shows_a_yaw_error_by_half_only():
    """A swept sonar does not turn its cloud rigidly: the wall's normal stays, a 45 degree face turns by half."""
    made = straight_pass(6.0, 0, [0, 0, np.radians(1.0)], np.zeros(3))
    step = angle_step([made[0].planes], np.eye(3), made[2])
    assert step.correction_rad[2] / np.radians(1.0) == pytest.approx(0.5, abs=0.06)


def test_with_a_wrong_lever_arm_the_angles_alone_are_biased_and_the_alternation_is_not():
    error, lever_error = np.radians([0.8, -0.8, 0.8]), np.array([0.08, -0.08, 0.08])
    passes, wet, lever = several(error, lever_error)
    alone = iterate_angles([one.planes for one in passes], lever, AngleTolerances(60, 1e-9, 1e-9))
    assert alone.converged
    assert np.degrees(np.abs(alone.rotation_vector_rad - error)).max() > 0.01
    tolerances = AlternationTolerances(500, 1e-10, 1e-9)
    result = alternate([one.planes for one in passes], OffsetObservations(passes, DRY, wet), lever, tolerances)
    assert result.converged
    np.testing.assert_allclose(np.degrees(result.rotation_vector_rad - error), 0, atol=1e-5)
    np.testing.assert_allclose(result.lever_arm_correction_m, lever_error, atol=1e-6)


@pytest.mark.parametrize("azimuth_deg", [0.0, 47.0, -163.0])
def test_offsets_are_turned_from_the_target_into_the_body(azimuth_deg):
    """Everything turned together (target frame against body) must give the same body corrections... here the target
    frame itself is the turned one, so X, Y change and the lever arm correction does not."""
    lever_error = np.array([0.05, 0.0, 0.03])
    made = straight_pass(6.0, 0, np.zeros(3), lever_error)
    found = patent_offsets(OffsetObservations([made[0]], DRY, made[1]), np.eye(3), made[2], True)
    np.testing.assert_allclose(found.body_m[[0, 2]], lever_error[[0, 2]], atol=2e-3)
    np.testing.assert_allclose(found.target_m[2], lever_error[2], atol=2e-3)


def test_every_pair_of_faces_is_a_row_and_z_is_laser_minus_sonar():
    made = straight_pass(6.0, 0, np.zeros(3), np.array([0, 0, 0.04]))
    found = patent_offsets(OffsetObservations([made[0]], DRY, made[1]), np.eye(3), made[2], True)
    assert len(found.pairs) == len(DRY) * len(made[1])
    assert sum(pair["weight"] for pair in found.pairs) == pytest.approx(1.0)
    for pair in found.pairs:
        assert pair["dz_m"] == pytest.approx(0.04, abs=1e-3)  # sonar placed 4 cm too low: to be raised


def test_missing_faces_are_named():
    made = straight_pass(6.0, 0, np.zeros(3), np.zeros(3))
    with pytest.raises(DegenerateGeometryError, match="laser sees no horizontal"):
        patent_offsets(OffsetObservations([made[0]], [], made[1]), np.eye(3), made[2], True)
    with pytest.raises(DegenerateGeometryError, match="no pass"):
        angle_step([], np.eye(3), made[2])
