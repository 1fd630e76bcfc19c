"""Geodesy against pyproj; interpolation against scipy's slerp; both against a boat seen from the pool."""

import numpy as np
import pytest
from pyproj import Transformer
from scipy.spatial.transform import Rotation, Slerp

from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic, rotation_ecef_from_level
from pipeline.maths.geometry.trajectory import GeodeticPoses, Trajectory, poses_in_pool

PLACES = np.array([[0.0, 0.0, 0.0], [36.0, 120.1, 12.0], [-72.3, -179.9, 3000.0], [89.999, 10.0, -50.0]])


def test_earth_centred_coordinates_are_pyprojs():
    lat, lon, h = PLACES.T
    expected = Transformer.from_crs(4979, 4978, always_xy=True).transform(lon, lat, h)
    ours = ecef_from_geodetic(np.radians(lat), np.radians(lon), h)
    np.testing.assert_allclose(ours, np.column_stack(expected), atol=2e-9)


@pytest.mark.parametrize("place", PLACES[:3].tolist())
@pytest.mark.parametrize("azimuth_deg", [0.0, 47.0, -163.0])
def test_pool_frame_is_pyprojs_topocentric_turned_by_the_azimuth(place, azimuth_deg):
    lat, lon, h = place
    near = np.array(place) + np.random.default_rng(1).normal(size=(20, 3)) * [1e-4, 1e-4, 5.0]
    pipeline = (
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lat_0={lat} +lon_0={lon} +h_0={h}"
    )
    east, north, up = Transformer.from_pipeline(pipeline).transform(near[:, 1], near[:, 0], near[:, 2])
    a = np.radians(azimuth_deg)
    along = east * np.sin(a) + north * np.cos(a)  # y: the direction at this azimuth
    right = east * np.cos(a) - north * np.sin(a)  # x: 90 degrees further clockwise
    frame = PoolFrame.at(np.radians(lat), np.radians(lon), h, a)
    ours = frame.points_from_ecef(ecef_from_geodetic(*np.radians(near[:, :2].T), near[:, 2]))
    np.testing.assert_allclose(ours, np.column_stack([right, along, up]), atol=1e-8)


def test_level_axes_are_east_north_up():
    R = rotation_ecef_from_level(np.radians([36.0]), np.radians([120.0]))[0]
    step = 1e-7
    here, there = (ecef_from_geodetic(np.radians([36.0 + d]), np.radians([120.0]), np.zeros(1))[0] for d in (0, step))
    assert R[:, 1] @ (there - here) == pytest.approx(np.linalg.norm(there - here), rel=1e-6)
    np.testing.assert_allclose(np.cross(R[:, 0], R[:, 1]), R[:, 2], atol=1e-15)


@pytest.fixture
def wild():
    rng = np.random.default_rng(3)
    t_ns = np.cumsum(rng.integers(4_000_000, 6_000_000, 400)) + 1_462_608_000_000_000_000
    R = Rotation.from_rotvec(np.cumsum(rng.normal(scale=0.02, size=(400, 3)), axis=0))
    positions = np.cumsum(rng.normal(scale=0.01, size=(400, 3)), axis=0)
    return t_ns, positions, R


def test_interpolation_is_linear_and_slerp(wild):
    t_ns, positions, R = wild
    moments = np.random.default_rng(4).integers(t_ns[0], t_ns[-1], 1000)
    seconds = (t_ns - t_ns[0]) * 1e-9
    at = (moments - t_ns[0]) * 1e-9
    trajectory = Trajectory.build(t_ns, positions, R.as_matrix())
    expected_R = Slerp(seconds, R)(at).as_matrix()
    expected_p = np.column_stack([np.interp(at, seconds, positions[:, k]) for k in range(3)])
    got_p, got_R = trajectory.poses_at(moments)
    np.testing.assert_allclose(got_R, expected_R, atol=1e-13)
    np.testing.assert_allclose(got_p, expected_p, atol=1e-12)
    x = np.random.default_rng(5).normal(size=(1000, 3))
    placed = trajectory.points_from_body(moments, x)
    np.testing.assert_allclose(placed, expected_p + np.einsum("nij,nj->ni", expected_R, x), atol=1e-12)


def test_records_themselves_come_back_and_moving_the_frame_commutes(wild):
    t_ns, positions, R = wild
    trajectory = Trajectory.build(t_ns, positions, R.as_matrix())
    np.testing.assert_allclose(trajectory.poses_at(t_ns)[1], R.as_matrix(), atol=1e-14)
    turn, shift = Rotation.from_rotvec([0.1, -0.4, 2.0]).as_matrix(), np.array([5.0, -2.0, 1.0])
    x = np.ones((len(t_ns), 3))
    moved = trajectory.transformed(turn, shift).points_from_body(t_ns + 1000, x)
    np.testing.assert_allclose(moved, trajectory.points_from_body(t_ns + 1000, x) @ turn.T + shift, atol=1e-12)


def test_holes_and_ends_are_not_covered():
    trajectory = Trajectory.build(np.array([0, 10, 100, 110]), np.zeros((4, 3)), np.tile(np.eye(3), (4, 1, 1)))
    t = np.array([-1, 0, 5, 10, 50, 99, 105, 110, 111])
    assert trajectory.covers(t, 10).tolist() == [False, True, True, False, False, False, True, True, False]
    assert trajectory.covers(t, 90)[1:-1].all()


def test_a_boat_north_of_the_origin_heading_along_the_wall():
    """Azimuth 47 degrees, boat 10 m along the wall and heading along it: body axes are the pool's."""
    lat, lon = np.radians([36.0, 120.1])
    a = np.radians(47.0)
    frame = PoolFrame.at(lat, lon, 12.0, a)
    north, east = 10 * np.cos(a), 10 * np.sin(a)
    position, R = poses_in_pool(
        frame,
        GeodeticPoses(
            np.array([lat + north / 6_358_000]),  # radius of the meridian at 36 degrees
            np.array([lon + east / (6_385_500 * np.cos(lat))]),
            np.array([13.0]),
            np.zeros(1),
            np.zeros(1),
            np.array([a]),
        ),
    )
    np.testing.assert_allclose(position[0], [0, 10, 1], atol=2e-3)
    np.testing.assert_allclose(R[0], np.eye(3), atol=2e-6)


def test_more_records_than_are_computed_at_a_time(wild, monkeypatch):
    t_ns, positions, R = wild
    whole = Trajectory.build(t_ns, positions, R.as_matrix())
    rates = whole.rates(0.05)
    monkeypatch.setattr("pipeline.maths.geometry.trajectory.BLOCK", 7)
    again = Trajectory.build(t_ns, positions, R.as_matrix())
    np.testing.assert_array_equal(again.steps_rad, whole.steps_rad)
    np.testing.assert_array_equal(again.rates(0.05), rates)
