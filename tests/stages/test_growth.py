"""A layer of growth of one thickness on all wet faces: it is estimated, and the lever arm's sigma has it."""

import json
from typing import Any

import pytest

from tests.support.docks import BOTH_SIDES, DOCK, LOCK
from tests.support.simulated import calibrated, made, mount_within_its_sigmas

LAYER_M = 0.04
PLACES: dict[str, tuple[dict[str, Any], ...]] = {"walls to one side": (DOCK,), "a lock": (BOTH_SIDES, LOCK)}


def lever_arm_x(place: str, growth_sigma_m: float, layer_m: float, errors_of: Any) -> tuple[float, float, bool]:
    """Error and total sigma of the lever arm's x, m, and whether all six errors are within 4 total sigmas."""
    faces = list(PLACES[place][-1]["target"]["faces"])
    layer = {"faces": faces, "part": "wet", "shift_m": layer_m}
    session = made(*PLACES[place], {"surroundings": {"back_wall": False, "face_faults": [layer]}}, seed=4)
    survey = {"offset_sigma_m": 0.005, "angle_sigma_deg": 0.03, "growth_sigma_m": growth_sigma_m}
    result = json.loads(calibrated(session, pool={"as_built": survey})["report/calibration.json"])
    errors = errors_of(result["mbes"], session.truth)
    return errors[3] / 1e3, result["mbes"]["sigma_mount_total"]["x_m"], mount_within_its_sigmas(result, errors, 4.0)


@pytest.mark.thorough
def test_on_walls_to_one_side_it_looks_like_a_lever_arm(errors_of: Any) -> None:
    """What the boat's turning tells of x on walls in several directions tells the two apart, if it is looked for."""
    taken_m, silent_m, within = lever_arm_x("walls to one side", 0.0, LAYER_M, errors_of)
    error_m, sigma_m, honest = lever_arm_x("walls to one side", 0.02, LAYER_M, errors_of)
    assert abs(taken_m) > 0.6 * LAYER_M
    assert not within
    assert abs(error_m) < abs(taken_m) / 2
    assert honest
    assert sigma_m > 1.3 * silent_m


def test_in_a_lock_the_walls_face_each_other_and_tell_it(errors_of: Any) -> None:
    error_m, sigma_m, honest = lever_arm_x("a lock", 0.02, LAYER_M, errors_of)
    assert honest
    assert abs(error_m) < LAYER_M / 10
    assert sigma_m < 0.02 / 5
