"""Every mistake's rotation and lever arm, against scipy."""

from collections.abc import Iterable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.entry_check.hypotheses import RIGHT, Entered, lever_arms, rotations, starts
from tests.support.entered import ANGLES, COARSE, COARSE_LEVER, LASER, LEVER, SOURCE, rotation

CHANGE = {name: ANGLES[name] - COARSE[name] for name in ANGLES}


def turned(**signs: float) -> dict[str, float]:
    return {name: signs.get(name, 1.0) * angle for name, angle in ANGLES.items()}


EXPECTED_ROTATIONS = {
    RIGHT: rotation(ANGLES),
    "not_entered": rotation(COARSE),
    "twice": rotation({name: ANGLES[name] + CHANGE[name] for name in ANGLES}),
    "minus": rotation({name: COARSE[name] - CHANGE[name] for name in ANGLES}),
    "correction_alone": rotation(CHANGE),
    "added": rotation({name: ANGLES[name] + COARSE[name] for name in ANGLES}),
    "doubled": rotation(ANGLES) @ rotation(ANGLES),
    "backwards": np.linalg.inv(rotation(ANGLES)),
    "radians": rotation({name: np.degrees(angle) for name, angle in ANGLES.items()}),
    "degrees": rotation({name: np.radians(angle) for name, angle in ANGLES.items()}),
    "roll_for_pitch": rotation({"roll": ANGLES["pitch"], "pitch": ANGLES["roll"], "yaw": ANGLES["yaw"]}),
    "coarse_pitch": rotation(ANGLES | {"pitch": COARSE["pitch"]}),
    "zero_yaw": rotation(ANGLES | {"yaw": 0.0}),
    "sign_roll": rotation(turned(roll=-1.0)),
    "sign_pitch_sign_yaw": rotation(turned(pitch=-1.0, yaw=-1.0)),
    "order_roll_pitch_yaw": rotation(ANGLES, "roll pitch yaw"),
    "sign_yaw_order_pitch_yaw_roll": rotation(turned(yaw=-1.0), "pitch yaw roll"),
}
x, y, z = LEVER
EXPECTED_ARMS = {
    RIGHT: LEVER,
    "not_entered": COARSE_LEVER,
    "twice": 2 * LEVER - COARSE_LEVER,
    "correction_alone": LEVER - COARSE_LEVER,
    "added": LEVER + COARSE_LEVER,
    "doubled": rotation(ANGLES) @ LEVER + LEVER,
    "from_laser": LEVER - LASER.lever_arm_body_m,
    "sonar_axes": np.linalg.inv(rotation(ANGLES)) @ LEVER,
    "feet": LEVER * 0.3048,
    "coarse_x": (COARSE_LEVER[0], y, z),
    "axes_yxz": (y, x, z),
    "axes_yxz_sign_z": (y, x, -z),
    "sign_z": (x, y, -z),
}


def values(entered: Iterable[Entered], key: str) -> list[np.ndarray]:
    return [one.value for one in entered if one.key == key]


@pytest.mark.parametrize("key", EXPECTED_ROTATIONS)
def test_rotation_of_a_mistake(key: str) -> None:
    assert any(np.allclose(value, EXPECTED_ROTATIONS[key], atol=1e-12) for value in values(rotations(SOURCE), key))


@pytest.mark.parametrize("key", EXPECTED_ARMS)
def test_lever_arm_of_a_mistake(key: str) -> None:
    assert any(np.allclose(value, EXPECTED_ARMS[key], atol=1e-12) for value in values(lever_arms(SOURCE), key))


def test_all_are_rotations_and_the_right_one_alone_is_free_of_mistakes() -> None:
    for one in rotations(SOURCE):
        assert np.allclose(one.value @ one.value.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(one.value) > 0
    for entered in (rotations(SOURCE), lever_arms(SOURCE)):
        assert [one.key for one in entered if not one.mistakes] == [RIGHT]


def test_the_right_mount_is_the_first_start() -> None:
    first = starts(SOURCE)[0]
    assert np.allclose(first.R_body_from_sensor, rotation(ANGLES))
    assert np.allclose(first.lever_arm_body_m, LEVER)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1, -1])
def test_a_value_a_little_off_has_a_start_near_it(axis: int, sign: int) -> None:
    """Half a step is left: 0.0125° and 5 mm, which the search by places bridges at 10 m (it asks for 8 mm)."""
    right = starts(SOURCE)[0]
    for share in (0.0, 0.3, 0.7, 1.0):
        turn = Rotation.from_rotvec(np.eye(3)[axis] * sign * np.radians(0.0625) * share).as_matrix()
        shift = np.eye(3)[axis] * sign * 0.025 * share
        near = starts(SOURCE)[:25]
        left = [turn @ right.R_body_from_sensor @ one.R_body_from_sensor.T for one in near]
        assert min(np.degrees(Rotation.from_matrix(R).magnitude()) for R in left) < 0.01255
        assert min(np.linalg.norm(right.lever_arm_body_m + shift - one.lever_arm_body_m) for one in near) < 0.00501
