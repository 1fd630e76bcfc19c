"""Which mistakes are named, on both sides of the tolerance, and where two give the same numbers."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.entry_check.answer import Answer, answer_of
from pipeline.entry_check.identification import Pairs
from pipeline.entry_check.run_soundings import EntrySource
from pipeline.mount import Mounted
from tests.support.entered import ANGLES, COARSE, COARSE_LEVER, LEVER, SOURCE, Boat, rotation

BOAT = Boat()
RIGHT_R = rotation(ANGLES)


def answer(
    points: np.ndarray, source: EntrySource = SOURCE, heights_differ: bool = False, noise_m: float = 3e-4
) -> Answer:
    points = points + np.random.default_rng(5).normal(0, noise_m, points.shape)
    return answer_of(Pairs(BOAT.soundings, points, len(points), 1.0, 0.0, False, "order"), source, heights_differ)


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
    assert found.certain
    assert not found.is_right


def test_two_mistakes_with_the_same_numbers_are_both_named() -> None:
    """A correction of yaw from 0: 'twice' and a coarse value of twice the total cannot be; its sign and 'minus' can."""
    coarse = Mounted(rotation(ANGLES | {"yaw": 0.0}), LEVER)
    found = answer(BOAT.placed(rotation(ANGLES | {"yaw": 2.0}), LEVER), replace(SOURCE, coarse=coarse))
    assert codes(found) == {frozenset({"minus"}), frozenset({"sign_yaw"})}


def test_an_unknown_point_is_no_mistake_of_the_catalogue() -> None:
    found = answer(BOAT.placed(RIGHT_R, LEVER + np.array([0.41, -0.33, 0.27])))
    assert found.explanations == ()
    assert found.rotation_right
    assert found.lever_m == pytest.approx([0.41, -0.33, 0.27], abs=0.001)


@pytest.mark.parametrize(("delay_s", "code"), [(0.02, "sonar_latency_missing"), (0.04, "sonar_latency_sign")])
def test_latency(delay_s: float, code: str) -> None:
    assert codes(answer(BOAT.placed(RIGHT_R, LEVER, delay_s))) == {frozenset({code})}


@pytest.mark.parametrize("heights_differ", [False, True])
def test_other_heights(heights_differ: bool) -> None:
    found = answer(BOAT.placed(RIGHT_R, LEVER) + np.array([0, 0, -8.3]), heights_differ=heights_differ)
    assert found.is_right == heights_differ
    assert codes(found) == ({frozenset()} if heights_differ else {frozenset({"heights"})})
    assert found.way.judged == (True, True, False)


def test_too_few_or_too_rough_soundings_cannot_tell() -> None:
    assert not answer(BOAT.placed(RIGHT_R, LEVER), noise_m=1.0).certain
