"""The warning that a wall could stand off unnoticed: its figures, and both sides of its limits."""

import numpy as np
import pandas as pd
import pytest

from pipeline.config.verdict import VerdictLimits
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.report.unseen_faces import unseen_face_error

LIMITS = VerdictLimits(max_sigma_m=0.025, max_sigma_deg=0.1)


def shift(unknown: str = "wet_quay_shift", considered: float = 0.02, expected: float = 0.03, **changed: float) -> dict:
    """Return a row of table ``freed``: an error of one sigma moves lever arm y by 4 mm, unless changed."""
    effects = dict.fromkeys((f"effect_{name}" for name in MOUNT_NAMES), 0.0) | {"effect_lever_arm_y": -0.004} | changed
    return {"unknown": unknown, "known": True, "considered": considered, "expected": expected} | effects


def said(*rows: dict) -> list[str]:
    return [one.words for one in unseen_face_error(pd.DataFrame(rows), LIMITS)]


def test_an_error_of_four_sigmas_is_told_with_what_it_does() -> None:
    """3.84 times 30 mm stand off, 5.8 times the sigma of 20 mm: y by 5.8 times 4 mm, above 20 but not 25 mm."""
    assert said(shift()) == []
    (words,) = said(shift(effect_lever_arm_y=-0.005), shift("wet_return_shift"))
    assert words.startswith("a wall that stands off by 115 mm below the water could go unnoticed (quay), and lever arm")
    assert "lever arm y would be wrong by 29 mm;" in words


def test_angles_count_by_their_own_limit() -> None:
    (words,) = said(shift(effect_rotation_y=np.radians(0.05)), shift("wet_return_shift"))
    assert "(quay), and roll would be wrong by 0.29°;" in words


def test_a_turn_is_told_in_degrees() -> None:
    turn = shift("wet_quay_2_turn_1", np.radians(0.1), np.radians(0.15), effect_rotation_y=np.radians(0.05))
    (words,) = said(turn, shift())
    assert words.startswith("a wall that is turned by 0.6° below the water could go unnoticed (quay_2), and roll would")
    assert "would be wrong by 0.29°;" in words


def test_of_a_face_that_nothing_tests_ten_sigmas_are_told() -> None:
    (words,) = said(shift(expected=100.0))
    assert words.startswith("a wall that stands off by 200 mm below the water")
    assert "wrong by 40 mm;" in words


@pytest.mark.parametrize(
    "row",
    [
        shift(considered=0.002, effect_lever_arm_y=1.0),
        shift("wet_quay_bow", effect_lever_arm_y=1.0),
        shift("wet_quay_turn_1", considered=np.radians(0.02), effect_rotation_x=1.0),
        shift(expected=np.nan, effect_lever_arm_y=1.0),
        shift(effect_lever_arm_y=1.0) | {"known": False},
    ],
    ids=["surveyed", "bow", "direction surveyed", "not seen", "fixed"],
)
def test_other_rows_say_nothing(row: dict) -> None:
    assert said(row) == []
