"""Planes that can serve and planes that cannot, both sides of each limit; the height of the water."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pipeline.errors import RawDataError
from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.dry_planes import (
    BOW_M,
    CELL_M,
    COVERED,
    FULL,
    NEAR_WATER_M,
    UNEVEN_M,
    WAVES_M,
    dry_planes,
    reaching_water,
    water_level_m,
)
from pipeline.maths.surfaces.flatness import plane_axes

Array = np.ndarray
FAR, BOAT = np.array([300.0, -700.0, 9.0]), np.array([294.0, -700.0, 9.5])  # the boat lies to the west
WATER_M = 8.0


def wall(width_m: float, height_m: float, shape: Callable[[Array, Array], Array] | None = None, seed: int = 1) -> Array:
    """Points (n, 3) of a wall that looks to the west and stands in the water."""
    rng, n = np.random.default_rng(seed), round(600 * width_m * height_m)
    along, up = rng.uniform(-width_m / 2, width_m / 2, n), rng.uniform(0, height_m, n)
    off = rng.normal(0, 0.005, n) + (0.0 if shape is None else shape(along, up))
    return np.column_stack([FAR[0] + off, FAR[1] + along, WATER_M + up])


def largest(points: Array) -> DryPlane:
    return dry_planes(points, BOAT)[0]


def test_columns_with_points_enough_end_somewhere() -> None:
    """Of columns a cell wide, those with 20 points or more; the last ones of a wall have fewer, or more."""
    points = wall(4.1, 2.0)[:420]
    plane = largest(points)
    along = np.floor(points @ plane_axes(plane.normal)[0] / CELL_M)
    columns = [np.sort(points[along == k, 2]) for k in np.unique(along)]
    expected = [heights[0] for heights in columns if len(heights) >= FULL]  # a fiftieth of them is none
    assert len(columns) > len(expected) > 10
    np.testing.assert_array_equal(plane.column_ends_m, expected)


@pytest.mark.parametrize("height_m", [2.0, 4.0, 6.0])
@pytest.mark.parametrize("every", [10**9, 200, 67])
def test_a_high_wall_ends_at_the_water_too(height_m: float, every: int) -> None:
    """Columns of 300 points and more, and a few of the wall's image below the water: one to 67, or 200, of its own."""
    points = np.concatenate([wall(8.0, height_m, seed=seed) for seed in range(4)])
    image = points[::every] * [1, 1, -1] + [0, 0, 2 * WATER_M]
    assert water_level_m([largest(np.concatenate([points, image]))]) == pytest.approx(WATER_M, abs=0.035)


@pytest.mark.parametrize("width_m", [2.4, 3.0, 3.6, 4.5])
def test_a_narrow_part_of_a_wall_is_no_row_of_gaps(width_m: float) -> None:
    """Of the upper half the wall is a tenth to a quarter as wide: a bin there has about a fifth of the usual points."""
    tower = wall(width_m, 3.0, seed=2) + np.array([0.0, 0.0, 3.0])
    plane = largest(np.concatenate([wall(20.0, 3.0), tower]))
    assert len(plane.gaps_m) == 0


def test_echoes_of_the_water_move_no_plane_and_no_outline() -> None:
    """Splash: of the points up to 0.25 m above the water one in four lies up to 10 cm before the wall. The water's own
    echoes: 1500 points on its surface, up to 0.4 m beyond the wall's ends, some of which lie in the wall's plane."""
    rng, points = np.random.default_rng(5), wall(8.0, 2.0)
    splashed = np.flatnonzero((points[:, 2] < WATER_M + 0.25) & (rng.uniform(size=len(points)) < 0.25))
    points[splashed, 0] -= rng.uniform(0, 0.1, len(splashed))
    before, along = rng.uniform(-0.2, 0.1, 1500), rng.uniform(-4.4, 4.4, 1500)
    sea = np.column_stack([FAR[0] + before, FAR[1] + along, WATER_M + rng.normal(0, 0.02, 1500)])
    plane, plain = largest(np.concatenate([points, sea])), largest(wall(8.0, 2.0))
    assert plane.refused == ""
    assert plane.tilt_deg == pytest.approx(90.0, abs=0.05)
    width, of_plain = (np.ptp(one.corners_m(one.outline_m)[:, 1]) for one in (plane, plain))
    assert width == pytest.approx(of_plain, abs=0.02)
    assert water_level_m([plane]) == pytest.approx(WATER_M, abs=0.05)


@pytest.mark.parametrize("behind", [1.0, -1.0])
def test_a_pan_of_sheet_piling_ends_at_its_webs(behind: float) -> None:
    """Webs at 45°, to the back of the pan or to its front: their first centimetres lie near its plane."""
    pan = np.concatenate([wall(1.2, 3.0, seed=seed) for seed in range(4)])
    web = np.concatenate([wall(0.64, 3.0, seed=seed) for seed in range(4)])
    along = (web[:, 1] - FAR[1]) * np.sqrt(0.5)  # from -0.225 to 0.225 m, as far as it goes back
    webs = [
        np.column_stack([web[:, 0] + behind * (0.225 + along), FAR[1] + end * (0.825 + along), web[:, 2]])
        for end in (-1.0, 1.0)
    ]
    plane = next(p for p in dry_planes(np.concatenate([pan, *webs]), BOAT) if abs(p.normal[0]) > 0.99)
    corners = plane.corners_m(plane.outline_m)[:, 1] - FAR[1]
    np.testing.assert_allclose([corners.min(), corners.max()], [-0.6, 0.6], atol=0.008)


def test_a_plane_of_few_points_is_chance() -> None:
    """Beside a wall with 3000 points a square metre a small one with 600 serves, one with 200 does not."""
    dense = np.concatenate([wall(8.0, 3.0, seed=seed) for seed in range(5)])
    for every, serves in ((1, True), (3, False)):
        beside = wall(1.4, 1.4)[::every] + np.array([3.0, 20.0, 0.0])
        first, second = dry_planes(np.concatenate([dense, beside]), BOAT)[:2]
        assert first.refused == ""
        assert second.refused == ("" if serves else f"only {second.points} points on it"), every


def test_a_low_bank_does_not_serve() -> None:
    """A slope of 11° that rises by 0.76 m serves; one by 0.3 m, as a patch of waves might, does not."""
    for length, serves in ((4.0, True), (1.6, False)):
        upright = wall(6.0, length)
        up = upright[:, 2] - WATER_M
        bank = np.column_stack([upright[:, 0] + up * np.cos(np.radians(11.0)), upright[:, 1], WATER_M + 0.19 * up])
        plane = largest(bank)
        assert plane.refused == ("" if serves else f"rises by {0.19 * 1.6 * 0.5:.1f} m alone"), length


def test_a_plain_wall_serves_and_looks_to_the_boat() -> None:
    plane = largest(wall(8.0, 3.0))
    assert plane.refused == ""
    np.testing.assert_allclose(plane.normal, [-1, 0, 0], atol=2e-4)
    assert plane.tilt_deg == pytest.approx(90.0, abs=0.05)
    corners = plane.corners_m(plane.outline_m)
    np.testing.assert_allclose(corners.max(axis=0) - corners.min(axis=0), [0, 7.94, 2.92 - WAVES_M], atol=0.03)
    np.testing.assert_allclose(corners[:, 0], FAR[0], atol=0.01)
    from_the_other_side = dry_planes(wall(8.0, 3.0), BOAT + np.array([20.0, 0, 0]))[0]
    np.testing.assert_allclose(from_the_other_side.normal, -plane.normal, atol=1e-9)
    assert from_the_other_side.distance_m == pytest.approx(-plane.distance_m)


@pytest.mark.parametrize(("share", "refused"), [(0.8, ""), (1.3, "bent by")])
def test_a_bent_wall_does_not_serve(share: float, refused: str) -> None:
    plane = largest(wall(8.0, 3.0, lambda along, _: share * BOW_M * (along / 4.0) ** 2))
    assert plane.refused.startswith(refused)
    assert bool(plane.refused) == bool(refused)


@pytest.mark.parametrize(("share", "serves"), [(0.8, True), (1.25, False)])
def test_a_wall_of_uneven_stones_does_not_serve(share: float, serves: bool) -> None:
    """Each stone of half a metre stands out or back: as an uneven plane, or as two with holes."""
    stones = share * UNEVEN_M * np.random.default_rng(5).choice([-1.0, 1.0], size=(20, 8))
    plane = largest(wall(8.0, 3.0, lambda along, up: stones[(2 * (along + 4)).astype(int), (2 * up).astype(int)]))
    assert (plane.refused == "") == serves
    assert plane.refused.startswith(("uneven", "only")) != serves


@pytest.mark.parametrize(("size", "refused"), [((0.8, 3.0), "smaller than"), ((1.3, 3.0), ""), ((8.0, 0.7), "smaller")])
def test_a_small_plane_does_not_serve(size: tuple[float, float], refused: str) -> None:
    plane = largest(wall(*size))
    assert plane.refused.startswith(refused)
    assert bool(plane.refused) == bool(refused)


@pytest.mark.parametrize(("seen", "refused"), [(COVERED + 0.15, ""), (COVERED - 0.15, "only")])
def test_a_wall_with_holes_does_not_serve(seen: float, refused: str) -> None:
    points = wall(8.0, 3.0)
    row, column = (np.floor(2 * (points[:, k] - points[:, k].min())).astype(int) for k in (1, 2))
    kept = np.random.default_rng(4).uniform(size=(17, 7)) < seen  # squares of half a metre
    plane = largest(points[kept[row, column]])
    assert plane.refused.startswith(refused)
    assert bool(plane.refused) == bool(refused)


COURSES = [(0.0, 0.5), (1.0, 2.5), (3.0, 3.5)]  # one at least serves alone


def blocks(width_m: float, ledge_m: float = 0.0) -> Array:
    """Points of a wall of courses of blocks with gaps over them; the top of each is seen so far back."""
    points = wall(width_m, 4.0)
    up = points[:, 2] - WATER_M
    rng, n = np.random.default_rng(3), round(600 * width_m * ledge_m * len(COURSES))
    top = np.array([high for _, high in COURSES])[rng.integers(len(COURSES), size=n)] + rng.normal(0, 0.005, n)
    back, along = rng.uniform(0, ledge_m, n), rng.uniform(-width_m / 2, width_m / 2, n)
    ledges = np.column_stack([FAR[0] + back, FAR[1] + along, WATER_M + top])
    return np.concatenate([points[np.any([(up >= low) & (up <= high) for low, high in COURSES], axis=0)], ledges])


def test_ledges_hide_no_course_and_bend_no_wall() -> None:
    """All gaps are found, as they are without ledges, and the wall is as flat: tops of blocks lie behind its plane.

    A wider wall shows where the water is.
    """
    plain = wall(6.0, 3.0) + np.array([0.0, 10.0, 0.0])
    for ledge_m in (0.0, 0.1, 0.25, 0.6):
        found = dry_planes(np.concatenate([blocks(3.0, ledge_m), plain]), BOAT)
        (plane,) = [one for one in found if not one.refused and len(one.gaps_m)]
        assert plane.refused == "", ledge_m
        np.testing.assert_allclose(plane.gaps_m - WATER_M, [(0.5, 1.0), (2.5, 3.0)], atol=0.03)
        assert plane.flat.uneven_m < 0.005
        assert plane.outline_m[:, 1].max() - plane.outline_m[:, 1].min() > 2.9


def test_the_next_walls_points_raise_no_top() -> None:
    """Walls twice as high begin at both ends of this one, at 45°; for 4 cm their points lie in its plane."""
    low, (along, up) = wall(2.0, 2.0), wall(3.0, 4.0, seed=2)[:, 1:].T - [[FAR[1]], [0.0]]
    back = np.abs(along)
    beside = np.column_stack([FAR[0] + back, FAR[1] + np.sign(along) * (1.0 + back), up])
    (plane,) = [one for one in dry_planes(np.concatenate([low, beside]), BOAT) if abs(one.normal[0]) > 0.99]
    assert plane.refused == ""
    assert plane.corners_m(plane.outline_m)[:, 2].max() == pytest.approx(WATER_M + 2.0, abs=0.1)


@pytest.mark.parametrize("tilt_deg", [20.0, 45.0, 80.0, 100.0])
def test_a_leaning_wall_is_cut_at_its_top(tilt_deg: float) -> None:
    """At a height, not at a place up the plane: 30,000 points to 1.5 m over the water, and a thin strip above them."""
    rng, n, upright = np.random.default_rng(4), 30_000, np.radians(tilt_deg)
    along, height = rng.uniform(-3, 3, n), np.r_[rng.uniform(0, 1.5, n - 300), rng.uniform(1.5, 2.5, 300)]
    along[-300:] = rng.uniform(-3.0, -2.9, 300)
    back = height / np.tan(upright) + rng.normal(0, 0.004, n) / np.sin(upright)
    plane = largest(np.column_stack([FAR[0] + back, FAR[1] + along, WATER_M + height]))
    assert plane.tilt_deg == pytest.approx(tilt_deg, abs=0.3)
    assert plane.corners_m(plane.outline_m)[:, 2].max() == pytest.approx(WATER_M + 1.5, abs=0.06)


@pytest.mark.parametrize(
    ("gaps", "above_m", "serves"),
    [
        ([], 0.55, False),
        ([1.5, 2.5], 0.55, True),
        ([1.5, 2.5], 0.65, False),  # the gap would end above the water
        ([1.5], 0.55, False),  # one alone
        ([1.7, 2.7], 0.55, False),  # the next one would not begin where the points end
    ],
)
def test_a_wall_of_blocks_may_end_with_a_gap(gaps: list[float], above_m: float, serves: bool) -> None:
    """Half a metre of points is missing over the water: it may be the next gap of a row, of half a metre each.

    gaps: heights of their lower ends above the next one's, which would end at the wall's lowest points.
    """
    plain = largest(wall(8.0, 3.0))
    low = plain.lowest_m - 1.0 + np.array(gaps)[:, None]
    plane = replace(plain, gaps_m=np.hstack([low, low + 0.5]))
    (judged,) = reaching_water([plane], plane.lowest_m - above_m)
    assert (judged.refused == "") == serves


def test_a_deck_is_level() -> None:
    rng = np.random.default_rng(2)
    deck = FAR + np.column_stack([rng.uniform(0, 6, 20_000), rng.uniform(0, 6, 20_000), rng.normal(0, 0.005, 20_000)])
    assert largest(deck).refused == "level"


@pytest.mark.parametrize(("above_m", "refused"), [(NEAR_WATER_M - 0.2, ""), (NEAR_WATER_M + 0.2, "ends 0.7 m above")])
def test_a_wall_on_piles_does_not_serve(above_m: float, refused: str) -> None:
    high = wall(6.0, 3.0, seed=2) + np.array([0.0, 20.0, above_m])
    planes = dry_planes(np.concatenate([wall(12.0, 3.0), high]), BOAT)
    level = water_level_m(planes)
    assert level == pytest.approx(WATER_M, abs=0.06)
    assert [plane.refused.startswith(refused) for plane in reaching_water(planes, level)] == [refused == "", True]
    assert bool(reaching_water(planes, level)[1].refused) == bool(refused)


def test_without_a_wall_there_is_no_water() -> None:
    with pytest.raises(RawDataError, match="no wall or slope whose points end at one height"):
        water_level_m([])
    ragged = wall(8.0, 4.0)
    ends = WATER_M + 2.5 * np.random.default_rng(3).uniform(size=40)[np.floor(ragged[:, 1] * 4).astype(int) % 40]
    with pytest.raises(RawDataError, match="no wall or slope"):
        water_level_m(dry_planes(ragged[ragged[:, 2] > ends], BOAT))
