"""Which mistakes are named, on both sides of the tolerance, and where two give the same numbers."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipeline.entry_check.answer import Answer, answer_of
from pipeline.entry_check.identification import Pairs
from pipeline.entry_check.run_soundings import EntrySource
from pipeline.mount import Mounted
from tests.support.entered import ANGLES, COARSE, COARSE_LEVER, LEVER, SOURCE, Boat, rotation

BOAT = Boat((0.0, 0.0, 0.0, 0.0))  # four passes
RIGHT_R = rotation(ANGLES)


def answer(
    points: np.ndarray, source: EntrySource = SOURCE, heights_differ: bool = False, noise_m: float = 3e-4,
    boat: Boat = BOAT, evenness: float = 1.0,
) -> Answer:  # fmt: skip
    points = points + np.random.default_rng(5).normal(0, noise_m, points.shape)
    pairs = Pairs(boat.soundings, points, len(points), 1.0, 0.0, False, "order", evenness=evenness)
    return answer_of(pairs, source, heights_differ, 0.0005)


def codes(found: Answer) -> set[frozenset[str]]:
    return {frozenset({*one.keys} - {"right", "plain"}) for one in found.explanations}


@pytest.mark.parametrize(
    ("angle_deg", "lever_m", "is_right"),
    [(0.0, 0.0, True), (0.008, 0.0, True), (0.013, 0.0, False), (0.0, 0.0045, True), (0.0, 0.006, False)],
)
def test_both_sides_of_the_tolerance(angle_deg: float, lever_m: float, is_right: bool) -> None:
    R = rotation(ANGLES | {"roll": ANGLES["roll"] + angle_deg})
    assert answer(BOAT.placed(R, LEVER + np.array([lever_m, 0, 0]))).is_right == is_right


@pytest.mark.parametrize(
    ("R", "lever", "expected"),
    [
        (rotation(ANGLES | {"roll": 48.8}), LEVER, {"sign_roll"}),
        (rotation(ANGLES | {"yaw": 2.0}), LEVER * [1, 1, -1], {"sign_yaw", "sign_z"}),
        (rotation(ANGLES, "roll pitch yaw"), LEVER, {"order_roll_pitch_yaw"}),
        (rotation(COARSE), COARSE_LEVER, {"not_entered"}),
        (rotation(COARSE), LEVER, {"not_entered"}),
        (RIGHT_R, COARSE_LEVER, {"not_entered"}),
        (RIGHT_R @ RIGHT_R, RIGHT_R @ LEVER + LEVER, {"doubled"}),
        (RIGHT_R, LEVER[[1, 0, 2]], {"axes_yxz"}),
    ],
)
def test_the_mistake_is_named(R: np.ndarray, lever: np.ndarray, expected: set[str]) -> None:
    found = answer(BOAT.placed(R, lever))
    assert codes(found) == {frozenset(expected)}
    assert found.verdict == "wrong"


def test_two_mistakes_with_the_same_numbers_are_both_named() -> None:
    """A correction of yaw from 0: 'twice' and a coarse value of twice the total cannot be; its sign and 'minus' can."""
    coarse = Mounted(rotation(ANGLES | {"yaw": 0.0}), LEVER)
    found = answer(BOAT.placed(rotation(ANGLES | {"yaw": 2.0}), LEVER), replace(SOURCE, coarse=coarse))
    assert codes(found) == {frozenset({"minus"}), frozenset({"sign_yaw"})}


def test_an_unknown_point_is_told_from_a_shift_of_all_positions() -> None:
    found = answer(BOAT.placed(RIGHT_R, LEVER + np.array([0.41, -0.33, 0.27])))
    assert (found.verdict, codes(found)) == ("wrong", {frozenset({"other_point"})})
    assert found.rotation_right
    assert found.lever_m == pytest.approx([0.41, -0.33, 0.27], abs=0.001)
    found = answer(BOAT.placed(RIGHT_R, LEVER) + np.array([0.41, -0.33, 0.27]))
    assert (found.verdict, codes(found)) == ("right_but", {frozenset({"shift"})})


def test_a_shift_is_told_in_east_and_north() -> None:
    """The pool's y axis points to 163 degrees: its x axis to 253, west-south-west."""
    turned = replace(SOURCE, azimuth_rad=np.radians(163.0))
    found = answer(BOAT.placed(RIGHT_R, LEVER) + np.array([1.0, 0.0, 0.0]), turned)
    east, north = np.sin(np.radians(253.0)), np.cos(np.radians(253.0))
    assert f"shifted by {east:+.3f} m east, {north:+.3f} m north" in found.explanations[0].words[0]


def test_what_rounding_hides_is_undecidable() -> None:
    """A shift by 2 cm spreads by less than rounding if it is taken for a lever arm."""
    found = answer(BOAT.placed(RIGHT_R, LEVER) + np.array([0.02, 0.0, 0.0]), noise_m=0.003)
    assert found.verdict in ("undecidable", "uncertain")
    assert any(one.mount_is_right for one in found.explanations)


@pytest.mark.parametrize(("delay_s", "code"), [(0.02, "sonar_latency_missing"), (0.04, "sonar_latency_sign")])
def test_latency(delay_s: float, code: str) -> None:
    found = answer(BOAT.placed(RIGHT_R, LEVER, delay_s))
    assert (found.verdict, codes(found)) == ("right_but", {frozenset({code})})


@pytest.mark.parametrize("delay_s", [0.13, -0.08])
def test_another_time_base(delay_s: float) -> None:
    found = answer(BOAT.placed(RIGHT_R, LEVER, delay_s))
    assert (found.verdict, codes(found)) == ("right_but", {frozenset({"delay"})})
    assert found.way.fitted.delay_s == pytest.approx(delay_s, abs=0.001)


@pytest.mark.parametrize("heights_differ", [False, True])
def test_other_heights(heights_differ: bool) -> None:
    found = answer(BOAT.placed(RIGHT_R, LEVER) + np.array([0, 0, -8.3]), heights_differ=heights_differ)
    assert found.verdict == ("right" if heights_differ else "right_but")
    assert codes(found) == ({frozenset()} if heights_differ else {frozenset({"heights"})})
    assert found.way.any_height


@pytest.mark.parametrize("heights_differ", [False, True])
def test_a_wrong_z_is_found_below_any_heights(heights_differ: bool) -> None:
    """Roll and pitch move the soundings level by z: 4 m are no height reference."""
    lifted = BOAT.placed(RIGHT_R, LEVER * [1, 1, -1]) + np.array([0, 0, -8.3])
    found = answer(lifted, heights_differ=heights_differ)
    assert found.verdict == "wrong"
    assert codes(found) == {frozenset({"sign_z"} if heights_differ else {"sign_z", "heights"})}


def test_an_angle_may_be_the_attitudes_but_a_large_one_turns_the_lever_arm_too() -> None:
    turned = rotation({"roll": 0.0, "pitch": 0.0, "yaw": 2.0})
    found = answer(BOAT.placed(turned @ RIGHT_R, turned @ LEVER))
    assert (found.verdict, codes(found)) == ("right_but", {frozenset({"attitudes"})})
    found = answer(BOAT.placed(rotation(ANGLES | {"yaw": -1.6}), LEVER))
    assert (found.verdict, codes(found)) == ("undecidable", {frozenset({"attitudes"}), frozenset({"mistyped"})})


def test_a_mistyped_roll_is_no_other_order_of_rotations_that_nearly_fits() -> None:
    """Two digits exchanged; the order pitch · yaw · roll would be off by three hundredths of that, as if rounded."""
    wanted = {"roll": -48.7612, "pitch": 1.2051, "yaw": -1.9960}
    for roll, key in ((-48.7162, "exchanged"), (-48.6912, "mistyped")):
        source = replace(SOURCE, total=Mounted(rotation(wanted), LEVER))
        found = answer(BOAT.placed(rotation(wanted | {"roll": roll}), LEVER), source)
        assert found.verdict in ("wrong", "undecidable")
        assert frozenset({key}) in codes(found)
        assert codes(found) <= {frozenset({key}), frozenset({"attitudes"})}
        (words,) = [one.words for one in found.explanations if key in one.keys]
        said = re.match(r"roll was entered as (.*)° in place of -48.7612°", words[0])
        assert said is not None
        assert float(said[1]) == pytest.approx(roll, abs=1e-9 if key == "exchanged" else 5e-4)
    assert len(codes(found)) == 2  # without exchanged digits it may be the INS's alignment as well


def test_an_order_of_rotations_is_still_named_whatever_its_values_differ_in() -> None:
    wanted = {"roll": -48.7612, "pitch": 1.2051, "yaw": -1.9960}
    typed = {"roll": -48.76, "pitch": 1.21, "yaw": -2.0}  # two decimals
    source = replace(SOURCE, total=Mounted(rotation(wanted), LEVER))
    found = answer(BOAT.placed(rotation(typed, "pitch yaw roll"), LEVER), source)
    assert (found.verdict, codes(found)) == ("wrong", {frozenset({"order_pitch_yaw_roll"})})


def test_exchanged_digits_of_the_lever_arm() -> None:
    wanted, typed = LEVER * [1, 1, 0] + [0, 0, -2.0137], LEVER * [1, 1, 0] + [0, 0, -2.0317]
    found = answer(BOAT.placed(RIGHT_R, typed), source=replace(SOURCE, total=Mounted(RIGHT_R, wanted)))
    assert codes(found) == {frozenset({"exchanged"})}
    assert "z was entered as -2.0317 m in place of -2.0137 m: two digits are exchanged" in found.explanations[0].words


@pytest.mark.parametrize(("R", "expected"), [(RIGHT_R, "uncertain"), (rotation(ANGLES | {"roll": 48.8}), "wrong")])
def test_other_positions_in_each_pass_hide_a_centimetre_but_no_sign(R: np.ndarray, expected: str) -> None:
    moved = np.repeat(np.random.default_rng(4).normal(0, 0.02, (4, 3)), len(BOAT.x_mbes) // 4, axis=0)
    found = answer(BOAT.placed(R, LEVER + np.array([0.01, 0.0, 0.0])) + moved)
    assert found.verdict == expected
    assert found.excess_m == pytest.approx(0.02, abs=0.01)


def test_too_few_or_too_rough_soundings_cannot_tell() -> None:
    assert answer(BOAT.placed(RIGHT_R, LEVER), noise_m=1.0).verdict == "uncertain"


@pytest.mark.parametrize("passes", [1, 2])
def test_a_pass_with_the_old_values_is_not_passed_over(passes: int) -> None:
    """The right mount explains most of the soundings exactly; the others were placed with the coarse one."""
    old = np.arange(len(BOAT.x_mbes)) < passes * len(BOAT.x_mbes) // 4
    found = answer(np.where(old[:, None], BOAT.placed(rotation(COARSE), COARSE_LEVER), BOAT.placed(RIGHT_R, LEVER)))
    assert not found.is_right
    assert found.excess_m > 0.02


def test_outliers_are_no_second_mount() -> None:
    points, random = BOAT.placed(RIGHT_R, LEVER), np.random.default_rng(2)
    bad = random.random(len(points)) < 0.1
    points[bad] += random.normal(0, 0.5, (bad.sum(), 3))
    assert answer(points).is_right


@pytest.mark.parametrize(("evenness", "expected"), [(0.6, "right"), (0.3, "uncertain")])
def test_passes_that_were_not_found_may_lie_elsewhere(evenness: float, expected: str) -> None:
    assert answer(BOAT.placed(RIGHT_R, LEVER), evenness=evenness).verdict == expected


@pytest.mark.parametrize(("rolling", "expected"), [(1.0, "right"), (0.001, "uncertain")])
def test_without_roll_and_pitch_no_z_is_proved_below_any_heights(rolling: float, expected: str) -> None:
    boat = Boat((0.0, 0.0, 0.0, 0.0), rolling=rolling)
    found = answer(boat.placed(RIGHT_R, LEVER) + np.array([0, 0, -8.3]), heights_differ=True, boat=boat)
    assert found.verdict == expected
