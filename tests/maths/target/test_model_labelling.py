"""The target's faces against coordinates worked out by hand; labels by polygon."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.errors import ConfigError
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import LabelSettings, label_points
from pipeline.maths.target.outlines import Outline, build_target
from tests.support.targets import by_letters, members


@pytest.fixture
def target():
    return by_letters(a=8.0, b=3.0, c=1.0, e=0.5)


def named(model, name):
    return next(face for face in model.faces if face.name == name)


def corners(face):
    return {tuple(round(float(v), 9) for v in vertex) for vertex in face.vertices_m}


def test_masks_leave_out_points_by_place_and_height_on_both_sides_of_their_limits():
    """A wall toward the boat at x < 0, of 6 m round y = 1: to the right as the boat sees it is -y. Water at 0.5 m."""
    outline = Outline("wall", [[0, 4, -4], [0, -2, -4], [0, -2, 2], [0, 4, 2]], masks_m=((1.0, 1.5, -1.5, 1.0),))
    model = build_target([outline], [], 0.5, None)
    places = np.array([[0.0, 1.0 - along, z] for along, z in (
        (1.25, 0.0), (0.95, 0.0), (0.85, 0.0), (1.55, 0.0), (1.65, 0.0), (1.25, -1.55), (1.25, -1.65), (1.25, 1.05),
        (1.25, 1.15), (-1.25, 0.0),
    )])  # fmt: skip
    labels = label_points(model, places, TargetBeams.head_on(len(places)), LabelSettings(0.05, 0.1, 0.1))
    masked = [True, True, False, True, False, True, False, True, False, False]
    assert labels.masked.tolist() == masked
    assert labels.face.tolist() == [-1 if hidden else 0 for hidden in masked]
    assert (labels.edge_weight[~np.array(masked)] == 1.0).all()
    there = label_points(
        model.mirrored(), places * [1, -1, 1], TargetBeams.head_on(len(places)), LabelSettings(0.05, 0.1, 0.1)
    )
    assert there.masked.tolist() == masked


def test_a_mask_does_not_tilt_the_face_at_its_edges():
    """Slanted rays with noise in their ranges: what is left beside a mask stands off no more than all else. Weights
    rise beside it over the ramp, and half of a footprint's length is kept."""
    outline = Outline("wall", [[0, 4, -4], [0, -4, -4], [0, -4, 2], [0, 4, 2]], masks_m=((0.0, 0.5, -np.inf, np.inf),))
    model, rng = build_target([outline], [], 0.0, None), np.random.default_rng(1)
    origin, met = np.array([-3.0, 3.0, -1.0]), np.zeros((40_000, 3))
    met[:, 1], met[:, 2] = rng.uniform(-1.5, 1.0, len(met)), -1.0
    ray = (met - origin) / np.linalg.norm(met - origin, axis=1)[:, None]
    points = met + ray * rng.normal(0, 0.03, len(met))[:, None]
    across = np.cross(ray, [0.0, 0.0, 1.0]) * 0.01
    beams = replace(TargetBeams.from_origins(np.tile(origin, (len(met), 1)), points), half_widths=(across, across))
    labels = label_points(model, points, beams, LabelSettings(0.2, 0.015, 0.1, ramp_m=0.05))
    for low, high in ((0.15, 0.3), (-0.8, -0.65)):  # y on either side of -0.5 to 0
        beside = (met[:, 1] > low) & (met[:, 1] < high) & (labels.face == 0)
        assert abs(np.mean(points[beside, 0])) < 0.003
    kept = labels.face == 0
    assert not kept[(met[:, 1] > -0.5) & (met[:, 1] < 0.0)].any()
    half_m = 2 * 0.01 * np.linalg.norm(origin) / np.cos(np.arctan2(3.0, 3.0))  # of a footprint at y = 0: some cm
    assert 0.015 < met[kept & (met[:, 1] > 0), 1].min() < 0.015 + half_m + 0.01
    ramp = np.sort(labels.edge_weight[kept & (met[:, 1] > 0.0) & (met[:, 1] < 0.3)])
    assert ramp[0] < 0.1 < ramp[-1] == 1.0


def test_a_level_face_has_no_masks():
    level = Outline("deck", [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], masks_m=((0.0, 0.5, -1.0, 1.0),))
    with pytest.raises(ConfigError, match=r"deck\.masks: a level face has no left and right"):
        build_target([level], [], 0.0, None)


def test_the_wall(target):
    wall = named(target, "P2")
    assert corners(wall) == {(0, -1.5, -4), (0, 1.5, -4), (0, 1.5, 4), (0, -1.5, 4)}
    assert wall.normal.tolist() == [-1, 0, 0]


def test_lowest_blocks_stand_at_the_foot_on_the_low_side_and_a_block_higher_on_the_other(target):
    assert corners(named(target, "P1-0")) == {(0, -1.5, -4), (1, -2.5, -4), (1, -2.5, -3.5), (0, -1.5, -3.5)}
    assert corners(named(target, "P3-0")) == {(0, 1.5, -3.5), (1, 2.5, -3.5), (1, 2.5, -3), (0, 1.5, -3)}
    assert corners(named(target, "P1-0-top")) == {(0, -1.5, -3.5), (1, -1.5, -3.5), (1, -2.5, -3.5)}
    assert named(target, "P1-1").vertices_m[:, 2].min() == -3.0
    assert sum(face.name.startswith("P1-") and face.family == "P1" for face in target.faces) == 8


def test_low_side_north_mirrors_the_stacks():
    model = by_letters(8.0, 3.0, 1.0, 0.5, low_side="north")
    assert named(model, "P3-0").vertices_m[:, 2].min() == -4.0
    assert named(model, "P1-0").vertices_m[:, 2].min() == -3.5


def test_given_bases_and_counts():
    model = by_letters(8.0, 3.0, 1.0, 0.5, blocks_per_side=2, first_base_m=-3.0, stagger_m=0.2)
    assert [named(model, f"P1-{k}").vertices_m[:, 2].min() for k in (0, 1)] == [-3.0, -2.0]
    assert named(model, "P3-0").vertices_m[:, 2].min() == -2.8
    assert len(members(model, "P1")) == 2


def test_normals_point_to_the_vessel_and_p4_down(target):
    root = np.sqrt(0.5)
    first, third = named(target, "P1-0").normal, named(target, "P3-0").normal
    np.testing.assert_allclose(first, [-root, -root, 0])
    np.testing.assert_allclose(third, [-root, root, 0])
    np.testing.assert_allclose(np.cross(first, named(target, "P2").normal), [0, 0, -root], atol=1e-12)


def test_all_faces_of_a_side_are_coplanar_and_corners_lie_on_their_planes(target):
    for face in target.faces:
        np.testing.assert_allclose(face.vertices_m @ face.normal, face.distance_m, atol=1e-12)
    for family in ("P1", "P3"):
        assert len({round(target.faces[k].distance_m, 12) for k in members(target, family)}) == 1


def test_clearance_is_the_distance_to_the_edges_not_to_the_box(target):
    top = named(target, "P1-0-top")  # triangle (0, -1.5), (1, -1.5), (1, -2.5)
    inside = np.array([[0.75, -1.75, -3.5]])
    assert top.clearance(inside)[0] == pytest.approx(0.25)
    across_the_slope = np.array([[0.25, -2.25, -3.5]])  # in the bounding box, outside the triangle
    assert top.clearance(across_the_slope)[0] < -0.3
    spread = np.array([[0.2, 0.0, 0.0]])
    assert top.clearance(inside, spread)[0] == pytest.approx(0.05)


def beams_from(origin, points, half_width=0.0):
    rays = points - origin
    ranges = np.linalg.norm(rays, axis=1, keepdims=True)
    unit = rays / ranges
    side = np.cross(unit, [0, 1.0, 0])
    return TargetBeams(unit, ranges[:, 0], (side / np.linalg.norm(side, axis=1, keepdims=True) * half_width,))


def test_points_are_labelled_by_polygon_gate_and_margin(target):
    numbers = {face.name: k for k, face in enumerate(target.faces)}
    points = np.array(
        [
            [0.02, 0.0, -2.0],  # wall, 2 cm behind its plane
            [0.2, 0.0, -2.0],  # too far from it
            [0.0, 1.49, -2.0],  # within the margin of its edge
            [0.5, -2.0, -3.75],  # middle of the lowest southern block
            [0.5, -2.0, -3.25],  # the gap above it
            [0.5, 2.0, -3.25],  # middle of the lowest northern block
            [0.75, -1.75, -3.5],  # top of the lowest southern block
        ]
    )
    origin = np.array([-5.0, 0.0, -0.5])
    labels = label_points(target, points, beams_from(origin, points), LabelSettings(0.05, 0.03, np.radians(5)))
    assert labels.face.tolist() == [
        numbers["P2"], -1, -1, numbers["P1-0"], -1, numbers["P3-0"], numbers["P1-0-top"],
    ]  # fmt: skip
    assert labels.off_surface.tolist() == [False, True, False, False, True, False, False]
    assert labels.near_edge.tolist() == [False, False, True, False, False, False, False]


def test_faces_are_seen_from_their_fronts_only_and_not_too_flat(target):
    top = np.array([[0.75, -1.75, -3.5]])
    for height, grazing_deg, good in ((-0.5, 5, True), (-0.5, 40, False), (-3.9, 5, False)):
        beams = beams_from(np.array([-5.0, -1.75, height]), top)
        label = label_points(target, top, beams, LabelSettings(0.05, 0.03, np.radians(grazing_deg)))
        assert bool(label.face[0] >= 0) is good, (height, grazing_deg)
        assert bool(label.grazing[0]) is not good


def test_a_grazed_face_needs_its_margin_along_the_ray(target):
    """0.5 degrees at 6 m, grazing at 27: the footprint is 11 cm long, so 4 cm from the far edge is too near."""
    origin = np.array([-5.0, -1.75, -0.5])
    points = np.array([[0.75, -1.75, -3.5], [0.96, -1.75, -3.5]])
    fine = label_points(target, points, beams_from(origin, points), LabelSettings(0.05, 0.03, 0.0))
    wide = label_points(target, points, beams_from(origin, points, np.radians(0.25)), LabelSettings(0.05, 0.03, 0.0))
    assert (fine.face >= 0).tolist() == [True, True]
    assert (wide.face >= 0).tolist() == [True, False]


def test_the_spot_of_a_round_beam_is_long_where_the_face_is_grazed(target):
    """A beam of 1 cm at 5.7 degrees is 10 cm long: 4 cm from an edge of a top is too near, 6 cm is not."""
    points = np.array([[0.75, -1.75, -3.5], [0.96, -1.75, -3.5], [0.94, -1.75, -3.5]])
    steep, flat = points + np.array([-3.0, 0.0, 3.0]), points + np.array([-6.0, 0.0, 0.6])
    for origins, good in ((steep, [True, True, True]), (flat, [True, False, True])):
        rays = points - origins
        ranges = np.linalg.norm(rays, axis=1)
        beams = TargetBeams(rays / ranges[:, None], ranges)
        found = label_points(target, points, beams, LabelSettings(0.05, 0.03, 0.0, spot_m=0.005))
        assert (found.face >= 0).tolist() == good


def test_the_whole_footprint_lies_below_the_highest_point(target):
    """On the wall the footprint of 2 degrees at 5 m reaches 8.7 cm up and down."""
    points = np.array([[0.0, 0.0, height] for height in (-1.0, -0.61, -0.57)])
    origin = np.array([-5.0, 0.0, -0.6])
    wide = beams_from(origin, points, np.radians(1.0))
    narrow, limits = TargetBeams(wide.directions, wide.ranges_m), LabelSettings(0.05, 0.03, 0.0, highest_m=-0.5)
    assert (label_points(target, points, wide, limits).face >= 0).tolist() == [True, True, False]
    assert (label_points(target, points, narrow, limits).face >= 0).tolist() == [True, True, True]


def test_noise_in_the_range_does_not_choose_the_points(target):
    """Else the edges of a grazed face would cut the noise of one sign off, at its two ends alternately."""
    random = np.random.default_rng(1)
    origin = np.array([-5.0, -1.75, -2.9])
    number = next(k for k, face in enumerate(target.faces) if face.name == "P1-0-top")
    points = np.column_stack([random.uniform(0, 1, 4000), random.uniform(-2.5, -1.5, 4000), np.full(4000, -3.5)])
    for half_width, longest_m in ((0.0, 0.014), (np.radians(0.25), 0.05)):
        beams = beams_from(origin, points, half_width)
        on_it = label_points(target, points, beams, LabelSettings(0.05, 0.03, np.radians(5))).face == number
        assert 300 < on_it.sum() < 2500
        for longer_m in (-longest_m, -longest_m / 3, longest_m / 3, longest_m):
            noisy = points + longer_m * beams.directions
            longer = replace(beams, ranges_m=beams.ranges_m + longer_m)
            again = label_points(target, noisy, longer, LabelSettings(0.05, 0.03, np.radians(5))).face == number
            np.testing.assert_array_equal(again, on_it, err_msg=str((half_width, longer_m)))


def test_an_echo_that_stands_on_the_corner_is_not_taken_wherever_its_beam_points(target):
    origin = np.array([-5.0, -1.75, -2.9])
    corner = np.array([1.0, -1.5, -3.5])  # of the lowest southern block's top
    ray = np.array([[0.85, -1.7, -3.5]]) - origin  # the beam's axis meets the top well inside
    reach = np.linalg.norm(corner - origin) / np.linalg.norm(ray)
    limits = LabelSettings(0.05, 0.03, np.radians(5))
    assert label_points(target, origin + ray, beams_from(origin, origin + ray), limits).face[0] >= 0
    echo = origin + reach * ray
    assert abs(echo[0, 2] + 3.5) < 0.05  # within the gate, and behind the margin
    assert label_points(target, echo, beams_from(origin, echo), limits).face[0] == -1


@pytest.mark.parametrize("e", [0.5, 0.4, 0.3])
def test_a_top_and_a_bottom_at_one_height_are_both_labelled(e):
    """-a/2 + e and -a/2 + 2e - e differ in the last bit for e = 0.4: neither side's faces may be lost by that."""
    model = by_letters(a=12 * e, b=3.0, c=1.0, e=e)
    for number, face in enumerate(model.faces):
        middle = face.vertices_m.mean(axis=0)[None, :]
        ahead = TargetBeams(-face.normal[None, :], np.ones(1))  # a ray from straight in front
        assert label_points(model, middle, ahead, LabelSettings(0.05, 0.01, 0.1)).face[0] == number, face.name


def test_what_lies_behind_a_face_is_hidden():
    from pipeline.target.surface import ClosestSurface

    surface = ClosestSurface(by_letters(8.0, 3.0, 1.0, 0.5))
    origin = np.array([[-5.0, 0.0, 1.0]])
    for x, hidden in ((-0.5, False), (0.0, False), (0.1, False), (0.2, True), (2.0, True)):  # the wall stands at x = 0
        assert surface.hides(origin, np.array([[x, 0.0, 0.0]]), 0.15).tolist() == [hidden], x
    assert surface.hides(origin, np.array([[3.0, 9.0, 0.0]]), 0.15).tolist() == [False]  # past the target
