"""Rotations against scipy, and the conventions against hand-made vectors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from pipeline.maths.geometry import rotations as r

vectors = arrays(np.float64, 3, elements=st.floats(-3.0, 3.0))
angles = st.floats(-np.pi, np.pi)


@given(vectors)
def test_exponential_map_is_scipys(vector):
    R = r.exp_so3(vector)
    np.testing.assert_allclose(R, Rotation.from_rotvec(vector).as_matrix(), atol=2e-15)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)


@given(vectors)
def test_logarithm_inverts_the_exponential(vector):
    np.testing.assert_allclose(r.exp_so3(r.log_so3(r.exp_so3(vector))), r.exp_so3(vector), atol=1e-14)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-9, 1e-6, 9.9e-4, 1.1e-3, 1.0, np.pi - 1e-9, np.pi])
def test_logarithm_keeps_its_precision_from_zero_to_half_a_turn(size):
    vector = size * np.array([0.6, 0.0, -0.8])
    back = r.log_so3(r.exp_so3(vector))
    np.testing.assert_allclose(np.abs(back), np.abs(vector), atol=1e-15 + 1e-7 * (size > 3))


@given(angles, st.floats(-1.5, 1.5), angles)
def test_mount_angles_come_back(roll, pitch, yaw):
    R = r.rotation_from_mount(roll, pitch, yaw)
    expected = Rotation.from_euler("ZXY", [yaw, pitch, roll]).as_matrix()  # intrinsic: Rz Rx Ry
    np.testing.assert_allclose(R, expected, atol=1e-14)
    np.testing.assert_allclose(r.rotation_from_mount(*r.mount_from_rotation(R)), R, atol=1e-13)


def test_signs_of_the_attitude():
    def turned(roll, pitch, azimuth, vector):
        R = r.rotation_from_attitude(np.array([roll]), np.array([pitch]), np.array([azimuth]))[0]
        return R @ vector

    starboard, forward = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    assert turned(0.1, 0, 0, starboard)[2] < 0  # roll +: starboard down
    assert turned(0, 0.1, 0, forward)[2] > 0  # pitch +: bow up
    assert turned(0, 0, 0.1, forward)[0] > 0  # azimuth +: bow to the east of north


def test_attitude_is_the_same_three_numbers_in_north_east_down():
    """P C P = Rz(az) Ry(pitch) Rx(roll) with forward-right-down axes, P swapping x, y and turning z."""
    P = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
    roll, pitch, azimuth = 0.3, -0.2, 2.1
    C = r.rotation_from_attitude(np.array([roll]), np.array([pitch]), np.array([azimuth]))[0]
    ned = Rotation.from_euler("ZYX", [azimuth, pitch, roll]).as_matrix()
    np.testing.assert_allclose(P @ C @ P, ned, atol=1e-15)


def test_the_first_order_matrix_of_the_patent_is_no_rotation():
    vector = np.radians([0.6, -0.6, 0.53])  # 1 degree in all
    patent = np.eye(3) + r.skew(vector)
    size = np.linalg.norm((patent - r.exp_so3(vector)) @ np.array([0.5, 0.1, -0.8]))
    assert 0.5e-4 < size < 2e-4


def test_quaternions_go_both_ways_whatever_component_is_largest():
    vectors = np.array([[0.1, 0, 0], [3.1, 0.1, 0], [0.1, 3.1, 0], [0, 0.1, 3.1], [2, 2, 1.0]])
    R = Rotation.from_rotvec(vectors).as_matrix()
    q = r.quaternion_from_rotation(R)
    np.testing.assert_allclose(np.abs(q), np.abs(Rotation.from_matrix(R).as_quat(scalar_first=True)), atol=1e-14)
    np.testing.assert_allclose(r.rotation_from_quaternion(q), R, atol=1e-14)


def test_more_quaternions_than_are_computed_at_a_time(monkeypatch):
    R = Rotation.random(23, random_state=4).as_matrix()
    expected = r.quaternion_from_rotation(R)
    monkeypatch.setattr(r, "BLOCK", 5)
    np.testing.assert_array_equal(r.quaternion_from_rotation(R), expected)
