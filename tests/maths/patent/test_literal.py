"""The patent's words as printed, against clouds made by other means: signs, limits of the sign rule, north."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import PlaneMoments, fit_plane
from pipeline.maths.patent.lifted_moments import lift
from pipeline.maths.patent.literal_angles import iterate_literally, literal_deviations
from pipeline.maths.patent.literal_offsets import literal_offsets
from pipeline.maths.patent.literal_planes import SessionPlanes, literal_matrix
from tests.support.straight_passes import DRY, normals_of, straight_pass

AXES = ("pitch", "roll", "yaw")
UNMOVED = np.zeros(3)


def session_of(*passes):
    lifted = {name: sum(one.observed.planes.lifted[name] for one in passes) for name in ("P1", "P2", "P3")}
    return SessionPlanes(lifted, passes[0].laser)


def turned_wall(planes, angle):
    """The laser's wall turned about z: a difference between the sensors' walls that no mount angle takes away."""
    turn = Rotation.from_euler("z", angle).as_matrix()
    corners = np.array([[0, y, z] for y in (-1.5, 1.5) for z in (0.5, 4.0)]) @ turn.T
    wall = fit_plane(PlaneMoments.of(corners), turn @ np.array([-1.0, 0, 0]))
    return SessionPlanes(planes.lifted, {**planes.laser, "P2": wall})


# --- signs -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_turn_about_one_axis_gives_that_deviation_and_others_too(axis, sign):
    """Full angles, whatever turned the normal: roll turns n4 and n3 too, and is taken for a pitch and a yaw as well.
    (By pitch alone or yaw alone the other steps' cosines stay equal: no sign, no correction.)"""
    turn = Rotation.from_rotvec(sign * 0.01 * np.eye(3)[axis]).as_matrix()
    found = literal_deviations(normals_of(turn), normals_of())
    assert found[axis] == pytest.approx(sign * 0.01, rel=1e-4)
    sizes = {0: [1, 0, 0], 1: [1, 1, 0.5**0.5], 2: [0, 0, 1]}[axis]
    np.testing.assert_allclose(np.abs(found), 0.01 * np.array(sizes), atol=1e-6)
    if axis == 1:
        assert found[0] == pytest.approx(-sign * 0.01, rel=1e-4)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("error_deg", [1.0, -1.0])
def test_a_wrong_angle_comes_back_with_its_sign_and_the_stretch_in_it(axis, error_deg):
    """Alone and by a degree, in one straight pass: right but for t², the size of what I + Ω stretches."""
    error = np.radians(error_deg) * np.eye(3)[axis]
    made = straight_pass(6.0, 0, error, UNMOVED)
    found = iterate_literally(session_of(made), made.lever_arm_m, 50, np.radians(1e-3))
    assert found.converged
    assert not found.reason
    np.testing.assert_allclose(found.angles_rad, error, atol=np.radians(1.0) ** 2)
    assert abs(found.angles_rad[axis]) > 0.9 * abs(error[axis])


def test_the_sign_that_0118_suggests_doubles_the_error():
    """[0113-0117] give deviations; [0118] calls them corrections: applied with that sign they are applied backwards."""
    error = np.radians(1.0) * np.array([0.0, 1.0, 0.0])
    made = straight_pass(6.0, 0, error, UNMOVED)
    planes = session_of(made)

    def wall_angle(angles):
        normal = planes.mbes_normals(angles, made.lever_arm_m)["P2"]
        return np.arcsin(np.linalg.norm(np.cross(normal, planes.laser["P2"].normal)))

    deviation = literal_deviations(planes.mbes_normals(UNMOVED, made.lever_arm_m), planes.laser_normals)
    roll = deviation * [0, 1, 0]
    assert wall_angle(roll) == pytest.approx(2 * wall_angle(UNMOVED), rel=0.01)
    assert wall_angle(-roll) < 0.02 * wall_angle(UNMOVED)


def test_the_matrix_is_the_printed_one():
    theta, gamma, phi = 0.1, 0.2, 0.3
    printed = np.array([[0, -phi, gamma], [phi, 0, -theta], [-gamma, theta, 0]])
    np.testing.assert_array_equal(literal_matrix(np.array([theta, gamma, phi])), np.eye(3) + printed)


def test_planes_are_plain_total_least_squares_of_the_placed_points():
    """Noise along oblique rays: the other forms allow for it, this one does not."""
    rng = np.random.default_rng(5)
    angles, lever = np.array([0.02, -0.01, 0.03]), np.array([0.3, 0.2, -2.0])
    p = np.column_stack([np.full(500, -6.0), rng.uniform(-2, 2, 500), np.full(500, 1.3)])
    wall = np.column_stack([np.zeros(500), p[:, 1], rng.uniform(-3, -0.5, 500)])
    body = (wall - p - lever) * (1 + rng.normal(scale=0.01, size=(500, 1)))
    features = lift(np.broadcast_to(np.eye(3), (500, 3, 3)), p, body)
    planes = SessionPlanes({"P2": features.T @ features}, {"P2": straight_pass(6.0, 0, UNMOVED, UNMOVED).laser["P2"]})
    theta, gamma, phi = angles
    placed = p + lever + body @ np.array([[1, -phi, gamma], [phi, 1, -theta], [-gamma, theta, 1]]).T
    smallest = np.linalg.svd(placed - placed.mean(axis=0))[2][-1]
    found = planes.mbes_plane("P2", angles, lever)
    np.testing.assert_allclose(found.normal, -smallest * np.sign(smallest[0]), atol=1e-9)
    np.testing.assert_allclose(found.centroid_m, placed.mean(axis=0), atol=1e-9)


# --- the limits of the sign rule -------------------------------------------------------------------------------------
PHI = np.radians(0.5)
WRONG = np.radians([0.3, -0.4, 0.2])


@pytest.fixture(scope="module")
def stalled():
    made = straight_pass(6.0, 0, WRONG, UNMOVED)
    planes = turned_wall(session_of(made), PHI)
    return planes, made.lever_arm_m, iterate_literally(planes, made.lever_arm_m, 50, 1e-9)


def test_the_stall_is_the_derived_cycle(stalled):
    """β = ±φ/√3, α = ∓φ/3, γ = ±φ(√3 - 1)/√67.5 about the truth."""
    rows = stalled[2].rows[-2:]
    assert not stalled[2].converged
    odd, even = (np.radians([row[f"rotation_{axis}_deg"] for axis in "xyz"]) - WRONG for row in rows)
    sign = np.sign(odd[1])
    expected = sign * PHI * np.array([-1 / 3, 1 / np.sqrt(3), (np.sqrt(3) - 1) / np.sqrt(67.5)])
    np.testing.assert_allclose(np.abs(odd - even) / 2, np.abs(expected), rtol=0.1, atol=0.005 * PHI)
    np.testing.assert_allclose(odd[:2], expected[:2], atol=0.06 * PHI)
    np.testing.assert_allclose(even[:2], -expected[:2], atol=0.06 * PHI)
    for row in rows:
        assert np.radians(row["angle_P2_deg"]) == pytest.approx(2 * PHI / np.sqrt(3), rel=0.02)


def test_a_threshold_below_the_stall_is_never_met(stalled):
    planes, lever_arm_m, _ = stalled
    at = 2 * PHI / np.sqrt(3)
    assert not iterate_literally(planes, lever_arm_m, 50, 0.95 * at).converged
    assert iterate_literally(planes, lever_arm_m, 50, 1.05 * at).converged


def test_without_what_no_angle_takes_away_it_converges():
    """The same pass, all three angles wrong by 0.8°: below any threshold that I + Ω leaves."""
    error = np.radians([0.8, -0.8, 0.8])
    made = straight_pass(6.0, 0, error, UNMOVED)
    t = np.linalg.norm(error)
    found = iterate_literally(session_of(made), made.lever_arm_m, 50, t**2 / 4)
    assert found.converged
    assert found.iterations < 20
    assert 0.1 * t**2 < np.abs(found.angles_rad - error).max() < t**2


def test_layers_of_passes_far_apart_make_it_run_away():
    """A yaw of 3° at 4 and 8 m: the layers turn P3 by γ² σ_d² / (2 σ_s²), here more than γ/2."""
    yaw, distances = np.radians(3.0), (4.0, 8.0)
    turns = []
    for sign in (1.0, -1.0):
        error = np.array([0.0, 0.0, sign * yaw])
        passes = [straight_pass(d, k, error, UNMOVED) for k, d in enumerate(distances)]
        planes, lever_arm_m = session_of(*passes), passes[0].lever_arm_m
        normal = planes.mbes_plane("P3", UNMOVED, lever_arm_m).normal
        turns.append(np.cross(planes.laser["P3"].normal, normal)[2])
        found = iterate_literally(planes, lever_arm_m, 50, np.radians(0.02))
        if sign > 0:
            assert "the angles ran away: after step" in found.reason
            assert not found.converged
            assert np.isnan(found.angles_rad).all()
            assert len(found.rows) == found.iterations
    along = planes.mbes_plane("P3", error, lever_arm_m).eigenvalues_m2[1]
    layers = yaw**2 * np.var(distances) / (2 * along)
    np.testing.assert_allclose(turns, [layers - yaw / 2, layers + yaw / 2], rtol=0.1)
    assert layers > yaw / 2


# --- offsets ---------------------------------------------------------------------------------------------------------
def offsets(lever_error, azimuth_deg=0.0):
    made = straight_pass(6.0, 0, UNMOVED, lever_error)
    found = literal_offsets(session_of(made), (DRY, made.wet), np.radians(azimuth_deg), UNMOVED, made.lever_arm_m)
    return found.enu_m


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_x_and_z_come_back_and_y_with_all_of_x_in_it(sign):
    x, y, z = found = sign * np.array([0.05, 0.02, 0.03])
    np.testing.assert_allclose(offsets(found), [x, y + x, z], atol=3e-3)
    np.testing.assert_allclose(offsets([0, y, 0]), [0, y, 0], atol=3e-3)


def test_off_north_the_differences_belong_to_other_axes():
    x, _, z = lever_error = np.array([0.05, 0.0, 0.03])
    np.testing.assert_allclose(offsets(lever_error, 180.0), [-x, -x, z], atol=3e-3)
    north_is_minus_x, north_is_x = offsets(lever_error, 90.0), offsets(lever_error, -90.0)
    np.testing.assert_allclose(north_is_minus_x[1:], [-x, z], atol=3e-3)
    np.testing.assert_allclose(north_is_x[1:], [x, z], atol=3e-3)


@pytest.mark.parametrize("azimuth_deg", [45.0, -135.0])
def test_a_p1_that_runs_along_y_is_not_cut(azimuth_deg):
    with pytest.raises(DegenerateGeometryError, match="runs along the Y axis"):
        offsets(np.zeros(3), azimuth_deg)
    offsets(np.zeros(3), azimuth_deg + 1.0)


def test_a_sensor_without_horizontal_faces_is_named():
    made = straight_pass(6.0, 0, UNMOVED, UNMOVED)
    for faces, sensor in ((([], made.wet), "laser"), ((DRY, []), "sonar")):
        with pytest.raises(DegenerateGeometryError, match=f"the {sensor} sees no horizontal face"):
            literal_offsets(session_of(made), faces, 0.0, UNMOVED, made.lever_arm_m)


def test_z_is_of_one_pair_with_the_most_points():
    made = straight_pass(6.0, 0, UNMOVED, UNMOVED)
    most = max(made.wet, key=lambda face: face.lifted[-1, -1])
    many = [DRY[0], type(DRY[0])("P3-6-top", 3.0, 3.0, 5000)]
    found = literal_offsets(session_of(made), (many, made.wet), 0.0, UNMOVED, made.lever_arm_m)
    assert (found.pair["dry_face"], found.pair["wet_face"]) == ("P3-6-top", most.name)
