"""Georeferencing against other programs: real boat rows of CIDCO's LidarToolkit, cases of CIDCO's MBES-lib.

Their frames differ from ours (CONVENTIONS.md), so every case also tests how the three angles are meant:

* LidarToolkit: level is north, west, up; the body forward, port, up; pitch + is bow down. Roll and heading are ours,
  pitch is ours negated.
* MBES-lib: level is north, east, down; the body forward, starboard, down; roll, pitch and heading are ours.
"""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from pipeline.config.mount import Mount
from pipeline.maths.geometry.geodesy import (
    FLATTENING,
    SEMI_MAJOR_M,
    PoolFrame,
    ecef_from_geodetic,
    rotation_ecef_from_level,
)
from pipeline.maths.geometry.rotations import mount_from_rotation, rotation_from_attitude, rotation_from_mount
from pipeline.maths.geometry.trajectory import GeodeticPoses, Trajectory, poses_in_pool
from pipeline.maths.sonar.ray_tracing import Cast, trace
from pipeline.maths.sonar.soundings import points_in_mbes, refracted_points
from pipeline.mount import mount_of
from tests.support.lidar_toolkit import dcm_nwu

# x east, y north, z up from x north, y west, z up; and x starboard, y forward, z up from x forward, y port, z up.
R_OURS_FROM_NWU = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
# The same from north, east, down; and from forward, starboard, down.
R_OURS_FROM_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FILES = [f"q_25_passage_{n}_{what}.bin" for n, what in product((1, 2), ("sphere1", "sphere2", "target1"))]
ROWS = (46, 92, 43, 164, 102, 60)


# --- real boat rows: xn = pn + C(roll, pitch, heading) (B xs + a) ----------------------------------------------------
@pytest.fixture(scope="module")
def rows(data: Path) -> np.ndarray:
    tables = [np.fromfile(data / "georeferencing" / name, "<f8").reshape(-1, 22) for name in FILES]
    assert tuple(map(len, tables)) == ROWS
    return np.concatenate(tables)


def _solve(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boresight and lever arm in LidarToolkit's frames: rotation and shift of one cloud onto the other (Kabsch)."""
    C = np.array([dcm_nwu(*rph) for rph in rows[:, 10:13]])
    body = np.einsum("nji,nj->ni", C, rows[:, 0:3] - rows[:, 16:19])
    scanner = rows[:, 4:7]
    u, _, vt = np.linalg.svd((body - body.mean(axis=0)).T @ (scanner - scanner.mean(axis=0)))
    B = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return B, body.mean(axis=0) - B @ scanner.mean(axis=0)


def test_lidar_toolkit_mount(rows: np.ndarray) -> None:
    B, a = _solve(rows)
    assert a == pytest.approx([-0.185596, 0.037658, 2.419063], abs=1e-6)
    assert pytest.approx(dcm_nwu(*np.radians([0.4395, -1.8681, 0.3992])), abs=2e-6) == B


def test_lidar_toolkit_rows(rows: np.ndarray) -> None:
    """Our attitude, mount and trajectory place every real point where LidarToolkit placed it."""
    B, a = _solve(rows)
    R_body_from_laser = rotation_from_mount(*mount_from_rotation(R_OURS_FROM_NWU @ B @ R_OURS_FROM_NWU.T))
    body = rows[:, 4:7] @ R_OURS_FROM_NWU.T @ R_body_from_laser.T + R_OURS_FROM_NWU @ a
    roll, pitch, heading = rows[:, 10:13].T
    attitude = rotation_from_attitude(roll, -pitch, heading)
    expected = rows[:, 0:3] @ R_OURS_FROM_NWU.T
    position = rows[:, 16:19] @ R_OURS_FROM_NWU.T
    assert np.abs(position + np.einsum("nij,nj->ni", attitude, body) - expected).max() < 1e-9
    t_ns, first = np.unique(np.rint(rows[:, 3] * 1e9).astype(np.int64), return_index=True)
    trajectory = Trajectory.build(t_ns, position[first], attitude[first])
    assert np.abs(trajectory.points_from_body(t_ns, body[first]) - expected[first]).max() < 1e-9


# --- MBES-lib: soundings ---------------------------------------------------------------------------------------------
PLACE = (48.4525, -68.5232, 15.401)
NEAR = (48.4525033333222, -68.52320333332072, 15.267333333333)
SOUNDINGS = {
    "A1": ((0, 0, 0), (0, 0, 0), (0, 0, 0), PLACE, (0.0, 0.0, 7.4), 1e-9),
    "A2": ((1, 2, 45), (0, 0, 0), (0, 0, 0), PLACE, (0.2739082412, 0.0912656601, 7.3943657507), 1e-9),
    "A3": ((1, 2, 45), (1, 2, 3), (0, 0, 0), PLACE, (-0.3215086477, 2.2498008231, 10.3920656486), 1e-9),
    "A4": ((1, 2, 45), (1, 2, 3), (0.4, 0.5, 0.6), PLACE, (-0.2394900282, 2.2597419967, 10.3884422996), 1e-9),
    "A5": ((1, 2, 45), (1, 2, 3), (0.4, 0.5, 0.6), NEAR, (-0.6101546444, 2.5063106918, 10.2547756501), 1e-5),
}
Triple = tuple[float, float, float]


def _mount(boresight_deg: Triple, lever_m: Triple) -> Mount:
    """Our mount of a sonar that MBES-lib describes by a boresight and a lever arm of the forward-starboard-down body.

    The sensor's own axes are turned like the body's, so our angles follow from P B P.
    """
    B = _dcm_ned(*np.radians(boresight_deg))
    angles = np.degrees(mount_from_rotation(R_OURS_FROM_NED @ B @ R_OURS_FROM_NED.T))
    values = (float(value) for value in (*angles, *(R_OURS_FROM_NED @ np.array(lever_m, dtype=float))))
    return Mount(**dict(zip(("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m"), values, strict=True)))


@pytest.mark.parametrize("case", SOUNDINGS)
def test_mbes_lib_soundings(case: str) -> None:
    attitude_deg, lever_m, boresight_deg, centroid, expected, tolerance = SOUNDINGS[case]
    mounted = mount_of(_mount(boresight_deg, lever_m))
    frame = PoolFrame.at(*np.radians(centroid[:2]), centroid[2], 0.0)
    pose = [np.array([value]) for value in (*np.radians(PLACE[:2]), PLACE[2], *np.radians(attitude_deg))]
    positions, R_pool_from_body = poses_in_pool(frame, GeodeticPoses(*pose))
    straight_down = np.array([[0.0, 0.0, -1480.0 * 0.01 / 2]])
    body = straight_down @ mounted.R_body_from_sensor.T + mounted.lever_arm_body_m
    placed = Trajectory(np.zeros(1, np.int64), positions, R_pool_from_body, np.zeros((1, 3)))
    point = placed.positions_m[0] + placed.R_frame_from_body[0] @ body[0]
    assert R_OURS_FROM_NED.T @ point == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize("case", SOUNDINGS)
def test_mbes_lib_soundings_in_ecef(case: str) -> None:
    """The same through ECEF: a point below the boat is where its latitude, longitude and height say."""
    *_, centroid, expected, tolerance = SOUNDINGS[case]
    place = np.radians(centroid[0]), np.radians(centroid[1])
    frame = PoolFrame.at(*place, centroid[2], 0.0)
    level = R_OURS_FROM_NED @ np.array(expected)
    ecef = ecef_from_geodetic(*(np.array([value]) for value in (*place, centroid[2])))
    ecef = ecef + level @ rotation_ecef_from_level(np.array(place[0]), np.array(place[1])).T
    assert frame.points_from_ecef(ecef)[0] == pytest.approx(level, abs=max(tolerance * 1e-3, 5e-9))


CAST = """
    0.03 1448.37 0.16 1446.37 0.23 1449.22 0.37 1446.69 0.43 1445.8 0.58 1448.19 0.63 1448.61 0.8 1449.56 0.87
    1449.07 1.03 1449.72 1.07 1449.48 1.23 1450.05 1.29 1449.61 1.45 1450.23 1.49 1449.73 1.67 1450.44 1.71
    1449.78 1.87 1450.63 1.93 1450.38 2.08 1450.81 2.14 1450.72 2.29 1451.24 2.37 1451.19 2.5 1451.49 2.59
    1451.3 2.71 1451.68 2.8 1451.46 2.91 1451.79 3.01 1451.64 3.1 1451.9 3.23 1451.76 3.32 1452.08 3.45 1451.92
    3.53 1452.14 3.65 1452 3.73 1452.18 3.87 1452.06 3.93 1452.45 4.08 1452.42 4.14 1452.77 4.29 1452.66 4.35
    1452.82 4.49 1452.73 4.56 1452.92 4.7 1452.8 4.76 1453.19 4.91 1453.06 4.98 1453.22 5.13 1453.2 5.19 1453.23
    5.34 1453.24 5.4 1453.33 5.55 1453.26 5.61 1453.4 5.75 1453.31 5.84 1453.44 5.97 1453.37 6.07 1453.57 6.19
    1453.41 6.28 1453.69 6.4 1453.55 6.52 1453.78 6.61 1453.65 6.72 1453.91 6.83 1453.76 6.94 1454.17 7.03
    1453.89 7.16 1454.37 7.25 1454.14 7.37 1454.52 7.47 1454.39 7.58 1454.61 7.69 1454.47 7.79 1454.67 7.92
    1454.53 8 1454.81 8.16 1454.69 8.23 1455.2 8.39 1455.08 8.45 1455.36 8.62 1455.29 8.67 1455.38 8.81 1455.38
    8.87 1455.38 9.03 1455.4 9.09 1455.39 9.23 1455.42 9.3 1455.41 9.47 1455.42 9.51 1455.43 9.71 1455.43 9.72
    1455.46 9.92 1455.46 10.14 1455.47 10.15 1455.47 10.36 1455.48
"""  # depth m, speed m/s: SVP-0.svp of MBES-lib's test (MIT), 96 points


def test_mbes_lib_ray_traced_sounding() -> None:
    """Within 15 mm, which their own layers and ours differ by in this noisy cast; a straight ray is 6 cm off.

    They refract level from the head's speed to the cast's, 1.9 m/s more, we in the plane of the array, which is tilted
    by 2°: a millimetre.
    """
    place, height = (0.859282504615, -1.189079133235), -25.753195024025
    frame = PoolFrame.at(0.859286627204, -1.189078930041, -25.711914675768, 0.0)
    attitude = (0.0273983876, 0.0243184966, 0.1056083942)
    pose = [np.array([value]) for value in (*place, height, *attitude)]
    positions, R_pool_from_body = poses_in_pool(frame, GeodeticPoses(*pose))
    R = R_pool_from_body @ mount_of(_mount((0.62, 0.0, 0.0), (0.0, 0.0, 0.0))).R_body_from_sensor
    speed, times, angle = np.array([1446.4250488]), np.array([2 * 0.0091418369]), np.array([0.7031931281])
    straight, _ = points_in_mbes(times, angle, np.zeros(1), speed)
    cast = Cast(*np.array(CAST.split(), dtype=float).reshape(-1, 2).T)
    ray = R[0] @ straight[0] / np.linalg.norm(straight[0])
    level = np.hypot(*ray[:2])
    across, depth = trace(cast, np.zeros(1), np.arcsin(level * cast.speed_at(np.zeros(1)) / speed), times / 2)
    theirs = np.array([*(ray[:2] / level * across), -depth[0]])
    ours = R[0] @ refracted_points(straight, speed, R, np.zeros(1), cast)[0]
    expected = np.array([-26.8825997032, 7.3549385469, 10.4758625062])
    misses = [np.abs(R_OURS_FROM_NED.T @ (positions[0] + one) - expected) for one in (theirs, R[0] @ straight[0])]
    assert misses[0].max() < 0.015
    assert misses[1].max() > 0.05
    assert np.linalg.norm(ours - theirs) < 0.0015


def test_mbes_lib_straight_down_is_a_lower_height() -> None:
    frame = PoolFrame.at(*np.radians(PLACE[:2]), PLACE[2], 0.0)
    below = ecef_from_geodetic(*(np.array([value]) for value in (*np.radians(PLACE[:2]), PLACE[2] - 7.4)))
    assert frame.points_from_ecef(below)[0] == pytest.approx([0.0, 0.0, -7.4], abs=5e-9)


# --- MBES-lib: matrices ----------------------------------------------------------------------------------------------
def _dcm_ned(roll: float, pitch: float, heading: float) -> np.ndarray:
    """Our attitude in MBES-lib's frames."""
    (ours,) = rotation_from_attitude(np.array([roll]), np.array([pitch]), np.array([heading]))
    return np.asarray(R_OURS_FROM_NED.T @ ours @ R_OURS_FROM_NED)


BORESIGHTS = {
    (1.0, 2.0, 3.0): [
        [0.998021196624068, -0.0517197397456515, 0.0357597484569552],
        [0.0523040745924708, 0.998509315434203, -0.0156022681730626],
        [-0.0348994967025010, 0.0174417749028302, 0.999238614955483],
    ],
    (10.0, 26.0, 39.0): [
        [0.698494163262967, -0.560601422747957, 0.444783035535905],
        [0.565629420690258, 0.813244715626515, 0.136734746700144],
        [-0.438371146789077, 0.156073948237737, 0.885139345156633],
    ],
    (56.0, 67.0, 91.0): [
        [-0.00681919846209329, -0.572426244871090, 0.819927858238222],
        [0.390671618245856, 0.753257618534275, 0.529130084967049],
        [-0.920504853452440, 0.323930786284440, 0.218494074216318],
    ],
}


@pytest.mark.parametrize("angles_deg", BORESIGHTS)
def test_mbes_lib_rotations(angles_deg: Triple) -> None:
    assert _dcm_ned(*np.radians(angles_deg)) == pytest.approx(np.array(BORESIGHTS[angles_deg]), abs=1e-12)


@pytest.mark.parametrize("angles_deg", BORESIGHTS)
def test_mbes_lib_boresights_as_mounts(angles_deg: Triple) -> None:
    """A boresight survives being written as our three mount angles."""
    mounted = mount_of(_mount(angles_deg, (0.0, 0.0, 0.0)))
    B = R_OURS_FROM_NED.T @ mounted.R_body_from_sensor @ R_OURS_FROM_NED
    assert pytest.approx(np.array(BORESIGHTS[angles_deg]), abs=1e-12) == B


@pytest.mark.parametrize(
    ("angles_deg", "expected"),
    [((180, 0, 0), (1, -1, -1)), ((0, 180, 0), (-1, 1, -1)), ((0, 0, 180), (-1, -1, 1))],
)
def test_mbes_lib_half_turns(angles_deg: Triple, expected: Triple) -> None:
    assert _dcm_ned(*np.radians(angles_deg)) @ np.ones(3) == pytest.approx(expected, abs=1e-12)


def test_mbes_lib_ned_to_ecef() -> None:
    ours = rotation_ecef_from_level(np.radians(16.0), np.radians(19.0))
    expected = [
        [-0.260620240054051, -0.325568154457157, -0.908890789521783],
        [-0.0897387452327910, 0.945518575599317, -0.312956196296995],
        [0.961261695938319, 0.0, -0.275637355816999],
    ]
    assert ours @ R_OURS_FROM_NED == pytest.approx(np.array(expected), abs=1e-12)


def test_mbes_lib_ecef_to_ned() -> None:
    ours = rotation_ecef_from_level(np.radians(45.0), np.radians(56.0))
    expected = [
        [-0.395409094035560, -0.586218089412104, 0.707106781186548],
        [-0.829037572555042, 0.559192903470747, 0.0],
        [-0.395409094035560, -0.586218089412104, -0.707106781186548],
    ]
    assert pytest.approx(np.array(expected), abs=1e-12) == R_OURS_FROM_NED.T @ ours.T


def test_mbes_lib_ellipsoid() -> None:
    def at(*place: float) -> np.ndarray:
        return ecef_from_geodetic(*(np.array([float(v)]) for v in place))[0]

    assert at(0, 0, 0) == pytest.approx([6378137.0, 0.0, 0.0], abs=1e-9)
    assert at(np.pi / 2, 0, 0)[2] == pytest.approx(6356752.3142, abs=5e-5)
    assert pytest.approx(6356752.3142, abs=5e-5) == SEMI_MAJOR_M * (1 - FLATTENING)
