"""The patent's steps against clouds that were turned and shifted by other means: signs, gains, the coupling."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import PlaneMoments, fit_plane
from pipeline.maths.patent.angles import (
    AngleTolerances,
    PassPlanes,
    angle_deviations,
    angle_step,
    fourth_normal,
    iterate_angles,
    patent_cosines,
)
from pipeline.maths.patent.lifted_moments import lift
from pipeline.maths.patent.offsets import (
    AlternationTolerances,
    DryFace,
    OffsetObservations,
    PassOffsets,
    WetFace,
    alternate,
    patent_offsets,
)
from tests.support.targets import by_letters, members

DOWN = np.array([0.0, 0.0, -1.0])


UNTURNED = np.eye(3)


def normals_of(turn=UNTURNED):
    root = np.sqrt(0.5)
    n = {"P1": [-root, -root, 0], "P2": [-1, 0, 0], "P3": [-root, root, 0]}
    found = {name: turn @ np.array(v) for name, v in n.items()}
    return found | {"P4": fourth_normal(found["P1"], found["P2"])}


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


def straight_pass(distance, number, mount_error, lever_error, swing_deg=0.0, azimuth=0.0, noise=0.0):
    """A pass along +y at x = -distance: soundings on the faces, generated from the truth; and the laser's planes.

    The forward model is its own: for each ping the fan's plane is cut with the faces in the target frame, and the
    sonar coordinates follow by inverting the *true* mount. The lifted features then use the wrong, coarse mount.
    """
    rng = np.random.default_rng(number)
    model = by_letters(8.0, 3.0, 1.0, 0.5)
    R_true = Rotation.from_euler("ZXY", np.radians([-2.0, 1.2, -48.8])).as_matrix()
    lever_true = np.array([0.3, 0.2, -2.0])
    R_coarse = Rotation.from_rotvec(-np.asarray(mount_error)).as_matrix() @ R_true
    turn = Rotation.from_euler("z", azimuth).as_matrix()  # of the target in the frame that "body" is aligned with
    lifted, laser, heights = {}, {}, {}
    for face in model.faces:
        inside = face.vertices_m[:, 2].max() < -0.5 or face.family == "P2"
        if not inside or face.normal[2] < 0:
            continue
        w = rng.dirichlet(np.ones(len(face.vertices_m)), 300)
        points = w @ face.vertices_m
        points = points[points[:, 2] < -0.5]
        # When is a point seen? When the fan's plane (normal: the mbes y axis) passes through it.
        y = points[:, 1].copy()
        for _ in range(30):
            heading = np.radians(swing_deg) * np.sin(0.9 * y + number)
            roll = np.radians(1.0) * np.sin(2.1 * y)
            T = Rotation.from_euler("ZXY", np.column_stack([heading, 0.2 * roll, roll])).as_matrix()
            p = np.column_stack([np.full_like(y, -distance) + 0.05 * np.sin(y), y, np.full_like(y, 1.3)])
            body = np.einsum("nji,nj->ni", T, points - p)
            mbes = (body - lever_true) @ R_true
            y = y + mbes[:, 1] / (T @ R_true)[:, 1, 1]
        assert np.abs(mbes[:, 1]).max() < 1e-9
        mbes[:, [0, 2]] += rng.normal(scale=noise, size=(len(mbes), 2)) if noise else 0.0
        features = lift(turn @ T, p @ turn.T, mbes @ R_coarse.T)
        key = face.family if face.family != "H" else face.name
        lifted[key] = lifted.get(key, 0) + features.T @ features
        heights[face.name] = face.vertices_m[0, 2]
    for family in ("P1", "P2", "P3"):
        dry = np.concatenate([model.faces[k].vertices_m + np.array([0, 0, 4.0]) for k in members(model, family)])
        laser[family] = fit_plane(PlaneMoments.of(dry @ turn.T), turn @ model.faces[members(model, family)[0]].normal)
    normals = {name: plane.normal for name, plane in laser.items()}
    normals["P4"] = fourth_normal(normals["P1"], normals["P2"])
    one = PassPlanes(number, {f: lifted[f] for f in ("P1", "P2", "P3")}, normals)
    wet = [WetFace(name, m, heights[name]) for name, m in lifted.items() if name.endswith("top")]
    return PassOffsets(one, laser["P2"], laser["P1"]), wet, lever_true - np.asarray(lever_error), R_coarse, R_true


DRY = [DryFace("P1-5-top", 1.5, 1.5, 1000), DryFace("P3-5-top", 2.0, 2.0, 1000)]


def several(mount_error, lever_error, azimuth=0.0, swing_deg=1.5):
    made = [straight_pass(d, k, mount_error, lever_error, swing_deg, azimuth) for k, d in enumerate((4.0, 7.5, 5.5))]
    return [one for one, *_ in made], [face for _, wet, *_ in made for face in wet], made[0][2]


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
