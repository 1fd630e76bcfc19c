"""Parts of a wall one above the other are one face; what only looks like that is not."""

import numpy as np
import pytest

from pipeline.finding.dry_planes import dry_planes, reaching_water
from pipeline.finding.stacked_planes import DENSE, GAP_M, SAME_M

BOAT = np.array([294.0, -700.0, 9.5])


def part(along: tuple[float, float], up: tuple[float, float], off_m: float = 0.0, seed: int = 1) -> np.ndarray:
    """Points (n, 3) of a part of a wall that looks to the west, 900 to each square metre."""
    rng = np.random.default_rng(seed)
    n = round(900 * np.ptp(along) * np.ptp(up))
    x, y, z = rng.normal(300.0 + off_m, 0.005, n), rng.uniform(*along, n) - 700.0, rng.uniform(*up, n) + 8.0
    return np.column_stack([x, y, z])


LOWER = part((0.0, 3.0), (0.0, 1.6))


def test_a_course_too_low_for_a_region_joins() -> None:
    """It is 0.3 m high, as a voxel, 0.6 m over the wall."""
    (wall,) = dry_planes(np.concatenate([LOWER, part((0.0, 3.0), (2.2, 2.5), seed=2)]), BOAT)
    assert wall.flat.height_m == pytest.approx(2.5, abs=0.3)
    np.testing.assert_allclose(wall.gaps_m, [[8.0 + 1.6, 8.0 + 2.2]], atol=0.04)


@pytest.mark.parametrize("high_m", [0.3, 0.6, 0.9])
def test_each_point_counts_once(high_m: float) -> None:
    """A course of 0.6 m has a plane of its own, and joins by its points."""
    points = np.concatenate([LOWER, part((0.0, 3.0), (2.2, 2.2 + high_m), seed=2)])
    (wall,) = dry_planes(points, BOAT)
    assert 0.7 * len(points) < wall.points < 0.95 * len(points)  # those near its edges are not counted


@pytest.mark.parametrize("up", [(-2.0, -0.6), (-0.9, -0.6)])
@pytest.mark.parametrize("share", [0.2, 1.0])
def test_the_image_of_a_wall_in_the_water_does_not_join(share: float, up: tuple[float, float]) -> None:
    """A wall in the water beside others, of which no image is seen: their points say where the water is."""
    image, beside = part((0.0, 3.0), up, seed=2), part((5.0, 9.0), (0.0, 1.6), seed=3)
    points = np.concatenate([LOWER, beside, image[: round(share * len(image))]])
    planes = reaching_water(dry_planes(points, BOAT), 8.0)
    served = [plane for plane in planes if not plane.refused]
    assert len(served) == 2
    assert all(plane.lowest_m > 7.9 for plane in served)


@pytest.mark.parametrize(("share", "number"), [(2 * DENSE, 1), (0.5 * DENSE, 2)])
def test_what_is_far_less_dense_does_not_join(share: float, number: int) -> None:
    upper = part((0.0, 3.0), (2.2, 3.8), seed=2)
    planes = dry_planes(np.concatenate([LOWER, upper[: round(share * len(upper))]]), BOAT)
    assert len(planes) == number


def serving(upper: np.ndarray) -> list[float]:
    """Heights of the planes that a lower part and another one make, the highest first. None leans by 0.4°."""
    planes = [one for one in dry_planes(np.concatenate([LOWER, upper]), BOAT) if one.points > 500]
    assert all(abs(plane.tilt_deg - 90) < 0.4 for plane in planes)
    return sorted((plane.flat.height_m for plane in planes), reverse=True)


def test_a_gap_of_a_metre_parts_no_wall() -> None:
    assert serving(part((0.0, 3.0), (2.6, 4.2), seed=2)) == [pytest.approx(4.2, abs=0.3)]


@pytest.mark.parametrize(("along", "off_m"), [((1.2, 4.0), 0.0), ((0.0, 3.0), 0.5 * SAME_M)])
def test_parts_that_share_half_of_their_width_or_are_set_back_a_little_are_one(
    along: tuple[float, float], off_m: float
) -> None:
    assert len(serving(part(along, (2.6, 4.2), off_m, seed=2))) == 1


@pytest.mark.parametrize(
    "upper",
    [
        part((0.0, 3.0), (1.7 + GAP_M + 0.4, 5.5), seed=2),
        part((0.0, 3.0), (2.1, 3.7), off_m=0.02, seed=2),
        part((0.0, 3.0), (2.1, 3.7), off_m=-0.03, seed=2),
        part((3.6, 6.6), (0.0, 1.6), seed=2),
        part((2.2, 5.2), (2.6, 4.2), seed=2),
    ],
    ids=["too far above", "set back", "standing out", "beside", "mostly beside"],
)
def test_other_parts_stay_two(upper: np.ndarray) -> None:
    assert len(serving(upper)) == 2


def test_rails_set_back_over_a_low_quay_lean_no_wall() -> None:
    """The quay alone is too low to serve. With two rails 25 mm behind its plane it would lean by 2°."""
    quay, rails = part((0.0, 6.0), (0.0, 0.6)), [part((0.0, 6.0), (up, up + 0.3), 0.025, 3) for up in (1.3, 1.8)]
    planes = dry_planes(np.concatenate([quay, *rails]), BOAT)
    assert all(plane.refused for plane in planes)
