"""Stripes of height that are left out: found on both sides of their tolerances, and cut where they are."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pipeline.adjustment.wall_stripes import BESIDE_M, BIN_M, OutsideStripes, Stripe, stripes_of_face
from pipeline.maths.adjustment.profiles import off_line
from pipeline.maths.adjustment.residual_means import BinMean

LOWEST, BINS, TOLERANCE_M = -40, 40, 0.006


def profile(off_m: dict[int, float], sigma_m: float = 0.0005, slope: float = 0.002) -> list[BinMean]:
    """Means from 4 m below the water up to it: on a line, and off it at some numbers of bins."""
    values = [slope * k + off_m.get(k, 0.0) for k in range(LOWEST, LOWEST + BINS)]
    return [
        BinMean((2, LOWEST + k), 100, 20, value, abs(value), sigma_m, 19.0, 3.0) for k, value in enumerate(values)
    ]


def stripes(off_m: dict[int, float], **more: float) -> list[Stripe]:
    return stripes_of_face(("mbes", 2), profile(off_m, **more), (TOLERANCE_M, 0.0), (0.0, 4.0))


def test_a_plane_that_leans_has_no_stripe() -> None:
    assert stripes({}, slope=0.05) == []


def test_a_footing_is_cut_to_the_lower_end() -> None:
    (found,) = stripes(dict.fromkeys(range(-40, -33), 0.05))
    assert (found.face, found.low_m, found.points) == (2, -np.inf, 700)
    assert found.high_m == pytest.approx(-33 * BIN_M + BESIDE_M)
    assert found.off_m == pytest.approx(0.05, abs=0.002)


def test_a_footing_of_two_fifths_of_the_wall_is_cut() -> None:
    (found,) = stripes(dict.fromkeys(range(-40, -24), 0.13))
    assert (found.low_m, found.points) == (-np.inf, 1600)
    assert found.high_m == pytest.approx(-24 * BIN_M + BESIDE_M)


def test_a_ledge_amid_the_wall_is_cut_alone() -> None:
    (found,) = stripes(dict.fromkeys(range(-20, -17), -0.03))
    assert (found.low_m, found.high_m) == pytest.approx((-20 * BIN_M - BESIDE_M, -17 * BIN_M + BESIDE_M))
    assert found.off_m == pytest.approx(-0.03, abs=0.002)


def bent(bow_m: float) -> dict[int, float]:
    """What a bow takes away from the profile of a wall 4 m deep."""
    up = {k: 1 + (k + 0.5) * BIN_M / 4.0 for k in range(LOWEST, LOWEST + BINS)}
    return {k: -bow_m * 4 * h * (1 - h) for k, h in up.items()}


def test_a_bow_that_follows_a_footing_does_not_hide_it() -> None:
    """The adjustment has bent the face by -5 cm: so the residuals of all heights are off, and without the bow few."""
    off_m = {k: value + (0.06 if k < -30 else 0.0) for k, value in bent(-0.05).items()}
    assert [one.points for one in stripes(off_m)] == [100]  # one of the ten heights
    (found,) = stripes_of_face(("mbes", 2), profile(off_m), (TOLERANCE_M, 0.0), (-0.05, 4.0))
    assert found.high_m == pytest.approx(-30 * BIN_M + BESIDE_M)
    assert found.off_m == pytest.approx(0.06, abs=0.002)


def test_a_wall_that_is_truly_bowed_has_no_stripe() -> None:
    assert stripes_of_face(("mbes", 2), profile({}), (TOLERANCE_M, 0.0), (0.02, 4.0)) == []


@pytest.mark.parametrize(("points", "found"), [(4, 0), (5, 1)])
def test_what_a_cut_has_left_of_a_height_is_no_stripe(points: int, found: int) -> None:
    """Of a hundred points at other heights."""
    means = profile({-40: 0.05})
    means[0] = replace(means[0], count=points)
    assert len(stripes_of_face(("mbes", 2), means, (TOLERANCE_M, 0.0), (0.0, 4.0))) == found


def test_growth_near_the_water_is_cut_to_the_water() -> None:
    (found,) = stripes(dict.fromkeys(range(-6, -2), 0.02))
    assert found.low_m == pytest.approx(-6 * BIN_M - BESIDE_M)
    assert found.high_m == np.inf


@pytest.mark.parametrize(("heights", "found"), [(range(-5, 0), 1), (range(-20, -15), 0), (range(-40, -35), 1)])
def test_heights_at_an_end_are_off_together_where_each_alone_is_not_certain(heights: range, found: int) -> None:
    """Five heights of 12 mm with 3 mm each: four sigmas alone, nine together."""
    assert len(stripes(dict.fromkeys(heights, 0.012), sigma_m=0.003)) == found


@pytest.mark.parametrize(("off_m", "sigma_m", "found"), [(0.0055, 0.0001, 0), (0.0065, 0.0001, 1), (0.02, 0.005, 0)])
def test_what_is_tolerated_or_uncertain_is_kept(off_m: float, sigma_m: float, found: int) -> None:
    assert len(stripes({-20: off_m}, sigma_m=sigma_m)) == found


def test_heights_of_a_rough_wall_may_be_off_by_as_much_as_they_scatter() -> None:
    """Of normal heights with 5 mm three sigmas and the tolerance are 21 mm; patches of 20 mm allow 66 mm."""
    rng = np.random.default_rng(3)
    rough = {k: float(value) for k, value in enumerate(np.clip(rng.normal(0.0, 0.005, BINS), -0.01, 0.01), LOWEST)}
    assert stripes(rough) == []
    (found,) = stripes(rough | {-20: 0.05})
    assert found.off_m == pytest.approx(0.05, abs=0.005)
    assert stripes_of_face(("mbes", 2), profile(rough | {-20: 0.05}), (TOLERANCE_M, 0.02), (0.0, 4.0)) == []


@pytest.mark.parametrize(("wrong", "off"), [(10, 7.0), (18, 7.0), (18, 0.05), (18, -0.3)])
def test_the_robust_line_is_that_of_most_heights(wrong: int, off: float) -> None:
    place = np.arange(40.0)
    value = 0.3 * place - 2.0
    value[:wrong] += off
    np.testing.assert_allclose(off_line(place, value), np.where(place < wrong, off, 0.0), atol=1e-9)


WALL = SimpleNamespace(normal=np.array([-1.0, 0.0, 0.0]), distance_m=0.0)  # at x = 0, seen from x < 0
STATE = cast(Any, SimpleNamespace(heads=("mbes",), surfaces=[WALL] * 3))


class Model:
    """A model in which points in the target frame are those in the sensor's, which lies at (-5, 0, 0)."""

    wet_heights_m = -3.0, 1.0  # the water stands at 1 m
    faces, height_of_face = SimpleNamespace(surface=np.arange(3)), np.zeros(3)
    body = SimpleNamespace(
        trajectory=SimpleNamespace(track_of_point=lambda t_ns, lever_arm_m: np.tile([-5.0, 0.0, 0.0], (len(t_ns), 1))),
        lever_arm=lambda sensor, state: np.zeros(3),
    )

    def points_in_target(self, sensor: str, batch: dict[str, np.ndarray], state: Any) -> np.ndarray:
        return np.column_stack([batch["x"], 0 * batch["x"], batch["z"]])


def kept(sensor: str, batch: dict[str, np.ndarray], *cuts: tuple[int, float, float]) -> list[bool]:
    stripes = tuple(Stripe(sensor, *cut, 0.1, 1) for cut in cuts)
    numbers = np.arange(len(batch["face"]))
    left = OutsideStripes(cast(Any, Model()), STATE, sensor, stripes)(batch | {"t_ns": numbers})
    return np.isin(numbers, left["t_ns"]).tolist()


def test_points_in_stripes_are_left_out_by_face_and_height_above_the_water() -> None:
    batch = {"face": np.array([0, 0, 0, 1, 1, 2]), "z": np.array([-2.5, -1.5, 0.9, -2.5, 0.0, -2.5]), "x": np.zeros(6)}
    cuts = [(0, -np.inf, -3.0), (0, -0.5, np.inf), (2, -np.inf, np.inf)]
    assert kept("mbes", batch, *cuts) == [False, True, False, True, True, False]
    of_laser = {"face": np.array([0, 0, 1]), "z_target_m": np.array([1.4, 1.6, 1.4])}
    of_laser |= {"x_target_m": np.zeros(3), "y_target_m": np.zeros(3)}
    assert kept("laser", of_laser, (0, -np.inf, 0.5)) == [False, True, True]


def test_a_point_off_its_face_lies_where_its_ray_meets_the_face() -> None:
    """25 cm before the wall, 2 m below the sensor that is 5 m away: its ray meets the wall 2 / 4.75 × 0.25 m lower."""
    meets_m = -2.0 - 0.25 * 2.0 / 4.75 - 1.0
    batch = {"face": np.array([0]), "x": np.array([-0.25]), "z": np.array([-2.0])}
    assert kept("mbes", batch, (0, -np.inf, meets_m + 0.001)) == [False]
    assert kept("mbes", batch, (0, -np.inf, meets_m - 0.001)) == [True]


def test_a_stripe_within_another_is_nothing_new() -> None:
    cut = Stripe("mbes", 0, -np.inf, -3.0, 0.1, 1)
    assert Stripe("mbes", 0, -3.9, -2.95, 0.1, 1).within([cut])
    assert not Stripe("mbes", 0, -3.9, -2.85, 0.1, 1).within([cut])
    assert not Stripe("laser", 0, -3.9, -3.2, 0.1, 1).within([cut])
    assert not Stripe("mbes", 1, -3.9, -3.2, 0.1, 1).within([cut])
