"""Parts of a wall one above the other are one face; what only looks like that is not."""

import numpy as np
import pytest

from pipeline.finding.dry_planes import dry_planes
from pipeline.finding.stacked_planes import GAP_M, SAME_M

BOAT = np.array([294.0, -700.0, 9.5])


def part(along: tuple[float, float], up: tuple[float, float], off_m: float = 0.0, seed: int = 1) -> np.ndarray:
    """Points (n, 3) of a part of a wall that looks to the west, 900 to each square metre."""
    rng = np.random.default_rng(seed)
    n = round(900 * np.ptp(along) * np.ptp(up))
    x, y, z = rng.normal(300.0 + off_m, 0.005, n), rng.uniform(*along, n) - 700.0, rng.uniform(*up, n) + 8.0
    return np.column_stack([x, y, z])


LOWER = part((0.0, 3.0), (0.0, 1.6))


def serving(upper: np.ndarray) -> list[float]:
    """Heights of the faces that a lower part and another one make, the highest first."""
    planes = dry_planes(np.concatenate([LOWER, upper]), BOAT)
    return sorted((plane.flat.height_m for plane in planes if plane.points > 500), reverse=True)


def test_a_gap_of_a_metre_parts_no_wall() -> None:
    assert serving(part((0.0, 3.0), (2.6, 4.2), seed=2)) == [pytest.approx(4.2, abs=0.3)]


@pytest.mark.parametrize(("along", "off_m"), [((1.2, 4.0), 0.0), ((0.0, 3.0), SAME_M)])
def test_parts_that_share_half_of_their_width_or_are_set_back_a_little_are_one(
    along: tuple[float, float], off_m: float
) -> None:
    assert len(serving(part(along, (2.6, 4.2), off_m, seed=2))) == 1


@pytest.mark.parametrize(
    "upper",
    [
        part((0.0, 3.0), (1.7 + GAP_M + 0.4, 5.5), seed=2),
        part((0.0, 3.0), (2.6, 4.2), off_m=4 * SAME_M, seed=2),
        part((3.6, 6.6), (0.0, 1.6), seed=2),
        part((2.2, 5.2), (2.6, 4.2), seed=2),
    ],
    ids=["too far above", "set back", "beside", "mostly beside"],
)
def test_other_parts_stay_two(upper: np.ndarray) -> None:
    assert len(serving(upper)) == 2
