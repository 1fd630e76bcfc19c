"""Planes found in a point cloud: voxels, growth, flatness, outlines."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.maths.surfaces.flatness import cells_of, flatness, plane_axes
from pipeline.maths.surfaces.growing import GrowthLimits, distances_from, grown_regions, plane_of_voxels
from pipeline.maths.surfaces.outline import area, clipped, convex_hull, inside, shrunk
from pipeline.maths.surfaces.voxels import Voxels, merged_voxels, voxels_of, voxels_with_rows

Array = np.ndarray
FAR = np.array([812.3, -455.7, 12.4])  # from the origin, as in a harbour
LIMITS = GrowthLimits(thickness_m=0.03, distance_m=0.04, least_voxels=10)


def wall(
    normal: tuple[float, float, float], width_m: float, height_m: float, seed: int, noise_m: float = 0.005,
    corner: tuple[float, float, float] = (0.0, 0.0, 0.0), density: float = 400.0,
) -> Array:  # fmt: skip
    """Points (n, 3) on a rectangle whose lower corner is ``corner`` and which lies along the plane's axes."""
    rng = np.random.default_rng(seed)
    unit = np.array(normal) / np.linalg.norm(normal)
    axes = plane_axes(unit)
    n = round(density * width_m * height_m)
    u, w = rng.uniform(0, width_m, n), rng.uniform(0, height_m, n)
    in_plane = u[:, None] * axes[0] + w[:, None] * axes[1]
    return np.asarray(FAR + np.array(corner) + in_plane + rng.normal(0, noise_m, (n, 1)) * unit)


def angle_deg(one: Array, other: Array) -> float:
    sine = np.linalg.norm(np.cross(one, other)) / np.linalg.norm(one) / np.linalg.norm(other)
    return float(np.degrees(np.arcsin(sine)))


@given(st.integers(0, 10_000), st.integers(1, 300), st.integers(1, 4))
def test_voxels_of_batches_are_those_of_all_points(seed: int, n: int, batches: int) -> None:
    points = FAR + np.random.default_rng(seed).normal(0, 1.0, (n, 3))
    whole = voxels_of(points, 0.5)
    parts = merged_voxels(voxels_of(part, 0.5) for part in np.array_split(points, batches) if len(part))
    np.testing.assert_array_equal(parts.code, whole.code)
    np.testing.assert_array_equal(parts.count, whole.count)
    np.testing.assert_allclose(parts.second, whole.second, atol=1e-9)
    assert int(whole.count.sum()) == n
    own = np.all(np.floor(points / 0.5).astype(int) == whole.index[0], axis=1)
    np.testing.assert_allclose(whole.mean_m[0], points[own].mean(axis=0), atol=1e-9)
    np.testing.assert_allclose(whole.covariance[0], np.cov(points[own].T, ddof=0).reshape(3, 3), atol=1e-9)


def test_each_point_has_the_row_of_its_voxel() -> None:
    points = np.random.default_rng(3).normal(scale=1.5, size=(800, 3)) + FAR
    voxels, row = voxels_with_rows(points, 0.5)
    np.testing.assert_array_equal(voxels.index[row], np.floor(points / 0.5))


def test_a_plane_of_voxels_is_the_plane_of_their_points() -> None:
    points = wall((-1.0, 0.3, 0.1), 6.0, 3.0, 1, noise_m=0.02)
    voxels = voxels_of(points, 0.3)
    plane = plane_of_voxels(voxels, np.arange(len(voxels)))
    values, vectors = np.linalg.eigh(np.cov(points.T, ddof=0))
    assert angle_deg(plane.normal, vectors[:, 0]) < 1e-6
    assert plane.rms_m == pytest.approx(np.sqrt(values[0]), rel=1e-6)
    away = points @ plane.normal - plane.distance_m
    squares = distances_from(voxels, np.arange(len(voxels)), plane) ** 2 @ voxels.count
    assert squares == pytest.approx(away @ away, rel=1e-6)


def test_neighbours_touch_and_each_pair_is_there_both_ways() -> None:
    points = FAR + np.random.default_rng(3).uniform(0, 2.0, (400, 3))
    voxels = voxels_of(points, 0.25)
    starts, others = voxels.neighbours
    near = np.max(np.abs(voxels.index[:, None] - voxels.index[None]), axis=2) == 1
    for row in range(len(voxels)):
        assert sorted(others[starts[row] : starts[row + 1]]) == np.flatnonzero(near[row]).tolist()


def regions_of(points: Array, size_m: float = 0.3, limits: GrowthLimits = LIMITS) -> tuple[Voxels, list[Array]]:
    voxels = voxels_of(points, size_m)
    return voxels, grown_regions(voxels, limits)


@pytest.mark.parametrize("turn_deg", [0.0, 31.0, 163.0])
def test_a_wall_with_a_return_and_the_ground_are_three_planes(turn_deg: float) -> None:
    turn = np.radians(turn_deg)
    normals = [(-np.cos(turn), -np.sin(turn), 0.0), (-np.cos(turn + 0.8), -np.sin(turn + 0.8), 0.0), (0.0, 0.0, 1.0)]
    along = plane_axes(np.array(normals[0]))[0]
    points = [
        wall(normals[0], 8.0, 3.0, 1),
        wall(normals[1], 4.0, 3.0, 2, corner=tuple(8.0 * along)),
        wall(normals[2], 8.0, 8.0, 3, corner=(-20.0, -20.0, 0.0)),
    ]
    voxels, regions = regions_of(np.concatenate(points))
    assert len(regions) == 3
    found = [plane_of_voxels(voxels, rows) for rows in regions]
    for normal, own in zip(normals, points, strict=True):
        plane = min(found, key=lambda each: angle_deg(each.normal, np.array(normal)))
        assert angle_deg(plane.normal, np.array(normal)) < 0.05
        assert np.abs(own @ plane.normal - plane.distance_m).mean() < 0.006
    assert all(len(np.unique(rows)) == len(rows) for rows in regions)
    assert sum(map(len, regions)) == len(np.unique(np.concatenate(regions)))


def test_steps_of_a_wall_are_planes_of_their_own_from_the_limit_on() -> None:
    """Two halves, one 0.1 m before the other: apart. 0.02 m: together, and as uneven."""
    for step_m, expected in ((0.1, 2), (0.02, 1)):
        halves = [wall((-1, 0, 0), 5.0, 3.0, 1), wall((-1, 0, 0), 5.0, 3.0, 2, corner=(step_m, -5.0, 0.0))]
        assert len(regions_of(np.concatenate(halves))[1]) == expected


def test_a_bush_and_a_line_of_points_are_no_planes() -> None:
    rng = np.random.default_rng(5)
    bush = FAR + rng.normal(0, 1.0, (20_000, 3))
    wire = FAR + np.column_stack([np.zeros(4000), rng.uniform(0, 40, 4000), np.full(4000, 5.0)])
    assert regions_of(bush)[1] == []
    assert regions_of(wire + rng.normal(0, 0.003, (4000, 3)))[1] == []
    assert grown_regions(voxels_of(np.empty((0, 3)), 0.3), LIMITS) == []


def test_the_same_points_in_another_order_are_the_same_regions() -> None:
    points = np.concatenate([wall((-1, 0.2, 0), 6.0, 3.0, 1), wall((-0.2, -1, 0), 4.0, 3.0, 2)])
    shuffled = np.random.default_rng(0).permutation(points)
    for one, other in zip(regions_of(points)[1], regions_of(shuffled)[1], strict=True):
        np.testing.assert_array_equal(one, other)


def in_plane(points: Array, normal: Array) -> tuple[Array, Array]:
    unit = normal / np.linalg.norm(normal)
    away = (points - points.mean(axis=0)) @ unit
    return points @ plane_axes(unit).T, away


def test_noise_is_no_unevenness_and_waves_are() -> None:
    normal = np.array([-1.0, 0.1, 0.0])
    points = wall(tuple(normal), 10.0, 3.0, 1, noise_m=0.01)
    place, away = in_plane(points, normal)
    plain = flatness(place, away, 0.5)
    assert plain.uneven_m < 0.002
    assert plain.bow_m < 0.003
    assert plain.width_m == pytest.approx(10.0, abs=1.0)
    assert plain.height_m == pytest.approx(3.0, abs=1.0)
    assert plain.covered > 0.8
    waves = flatness(place, away + 0.02 * np.sin(2 * np.pi * place[:, 0] / 3.0), 0.5)
    assert waves.uneven_m == pytest.approx(0.02 / np.sqrt(2), rel=0.15)


def test_a_bow_is_its_height_and_a_turned_plane_has_none() -> None:
    normal = np.array([-1.0, 0.0, 0.0])
    place, away = in_plane(wall(tuple(normal), 10.0, 3.0, 1), normal)
    u = place[:, 0] - place[:, 0].mean()
    assert flatness(place, away + 0.05 * (u / 5.0) ** 2, 0.5).bow_m == pytest.approx(0.05, rel=0.1)
    assert flatness(place, away + 0.01 * u, 0.5).bow_m < 0.003


@pytest.mark.parametrize(("share", "bent"), [(0.5, False), (2.0, True)])
def test_a_few_points_of_what_stands_behind_bend_no_wall(share: float, bent: bool) -> None:
    """The cell at one corner sees what stands 9 cm behind, with half a tenth of the usual points, or two tenths."""
    rng, usual = np.random.default_rng(1), 400
    place = rng.uniform(0.0, 1.0, (16 * usual, 2))
    beyond = rng.uniform(0.0, 0.25, (round(share * 0.1 * usual), 2)) + np.array([1.0, 0.75])
    away = np.concatenate([np.zeros(len(place)), np.full(len(beyond), -0.09)])
    flat = flatness(np.concatenate([place, beyond]), away, 0.25)
    assert (flat.bow_m > 0.01) == bent
    assert (flat.uneven_m > 0.003) == bent


def test_half_a_wall_is_half_covered() -> None:
    normal = np.array([-1.0, 0.0, 0.0])
    place, away = in_plane(wall(tuple(normal), 10.0, 4.0, 1), normal)
    kept = (place[:, 1] - place[:, 1].min()) < 4.0 * (place[:, 0] - place[:, 0].min()) / 10.0
    assert flatness(place[kept], away[kept], 0.25).covered == pytest.approx(0.5, abs=0.06)
    assert flatness(place[:2], away[:2], 0.25).covered == 0.0


@pytest.mark.parametrize("normal", [(-1, 0, 0), (0.6, 0.8, 0), (0, 0, 1), (-0.7, 0, 0.7), (0, 0, -1)])
def test_axes_are_right_handed_and_the_first_is_level(normal: tuple[float, float, float]) -> None:
    unit = np.array(normal) / np.linalg.norm(normal)
    level, up = plane_axes(unit)
    np.testing.assert_allclose(np.cross(level, up), unit, atol=1e-12)
    assert level[2] == 0
    assert up[2] >= 0 or abs(unit[2]) == 1


@given(st.integers(0, 10_000), st.integers(3, 60))
def test_the_hull_holds_all_points_and_its_corners_are_of_them(seed: int, n: int) -> None:
    points = np.random.default_rng(seed).normal(size=(n, 2))
    hull = convex_hull(points)
    centre = hull.mean(axis=0)
    assert np.all(inside(hull, centre + (1 - 1e-9) * (points - centre)))
    assert all(any(np.array_equal(corner, point) for point in points) for corner in hull)
    assert area(hull) > 0
    assert np.all(inside(hull, shrunk(hull, 0.01)))


def test_points_on_a_line_have_no_hull() -> None:
    assert convex_hull(np.column_stack([np.arange(5.0), np.arange(5.0)])).shape == (0, 2)


def test_a_square_is_cut_and_made_smaller() -> None:
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    assert area(clipped(square, np.array([0.0, 1.0]), 0.5)) == pytest.approx(3.0)
    assert area(clipped(square, np.array([0.0, 1.0]), 2.5)) == 0.0
    assert area(clipped(square, np.array([0.0, 1.0]), 0.0)) == pytest.approx(4.0)
    smaller = shrunk(square, 0.2)
    assert area(smaller) == pytest.approx(1.6**2)
    np.testing.assert_allclose(np.abs(smaller - 1.0), 0.8)
    assert len(shrunk(square, 1.1)) == 0


@pytest.mark.parametrize("count", [0, 1, 500])
@pytest.mark.parametrize("far_m", [0.0, 9000.0])  # the rectangle round them has few cells, or a thousand million
def test_cells_are_those_of_rows(count: int, far_m: float) -> None:
    places = np.random.default_rng(count).normal(scale=3.0, size=(count, 2))
    places[: count // 2] += far_m
    keys, inverse, counts = cells_of(places, 0.25)
    expected = np.unique(np.floor(places / 0.25).astype(np.int64), axis=0, return_inverse=True, return_counts=True)
    np.testing.assert_array_equal(keys, expected[0])
    np.testing.assert_array_equal(inverse, expected[1].reshape(-1))
    np.testing.assert_array_equal(counts, expected[2])
