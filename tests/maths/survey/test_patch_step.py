"""The step of the angles by passes over a bottom, against soundings placed by the definition of the mount."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.survey.patch_step import PieceSoundings, patch_step

ARM_M = np.array([0.3, 0.2, -2.0])
SLOPES = [(0.0, 0.0, -9.0), (0.25, -0.1, -7.0), (-0.1, 0.3, -8.0)]  # a, b, c of z = a x + b y + c, m

BEFOREHAND = 1e-3, np.radians(3.0), np.zeros(3)  # noise of a piece, of the coarse angles; not yet turned


def soundings(
    wrong: Rotation, slopes: list[tuple[float, float, float]], headings_deg: list[float], unrest_deg: float = 1.0
) -> list[PieceSoundings]:
    """Soundings on each slope as a mount places them that is turned away from the true one, which is level, by wrong⁻¹.

    Each pass hears a square at its own distances: rays from the head meet the slope; the wrong mount turns them.
    """
    random, pieces = np.random.default_rng(4), []
    for a, b, c in slopes:
        places, from_head, turns = [], [], []
        for number, heading in enumerate(headings_deg):
            attitude = np.column_stack([np.full(400, -heading), *random.normal(0, unrest_deg, (2, 400))])
            R = Rotation.from_euler("ZXY", attitude, degrees=True)
            at = np.column_stack([random.uniform(-1, 1, (400, 2)), np.zeros(400)])
            at[:, 2] = a * at[:, 0] + b * at[:, 1] + c
            ahead = np.array([np.sin(np.radians(heading)), np.cos(np.radians(heading)), 0.0])
            aside = np.array([ahead[1], -ahead[0], 0.0])
            position = at - R.apply(ARM_M) - (3.0 + number) * aside - random.normal(0, 0.3, (400, 1)) * ahead
            position[:, 2] = random.normal(0, 0.02, 400)
            own = R.inv().apply(at - position) - ARM_M  # body axes, as the true mount has it
            seen = wrong.inv().apply(own)
            places.append(position + R.apply(seen + ARM_M))
            from_head.append(R.apply(seen))
            turns.append(R.as_matrix())
        pieces.append(PieceSoundings(*map(np.concatenate, (places, from_head, turns))))
    return pieces


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("size_deg", [0.05, -0.05])
def test_each_angle_comes_back_with_its_sign(axis: int, size_deg: float) -> None:
    wrong = np.zeros(3)
    wrong[axis] = np.radians(size_deg)
    step = patch_step(soundings(Rotation.from_rotvec(wrong), SLOPES, [10.0, 190.0, 100.0]), *BEFOREHAND)
    np.testing.assert_allclose(np.degrees(step), np.degrees(wrong), atol=0.002)


def test_a_level_bottom_tells_nothing_of_yaw() -> None:
    wrong = Rotation.from_rotvec(np.radians([0.05, -0.04, 0.5]))
    step = np.degrees(patch_step(soundings(wrong, [SLOPES[0]] * 3, [10.0, 190.0], 0.0), *BEFOREHAND))
    np.testing.assert_allclose(step[:2], [0.05, -0.04], atol=0.02)
    assert abs(step[2]) < 0.1


def test_soundings_far_off_do_not_count() -> None:
    wrong = Rotation.from_rotvec(np.radians([0.05, -0.05, 0.05]))
    pieces = soundings(wrong, SLOPES, [10.0, 190.0, 100.0])
    for piece in pieces:
        piece.places_m[::40, 2] += 2.0
    step = patch_step(pieces, *BEFOREHAND)
    np.testing.assert_allclose(np.degrees(step), [0.05, -0.05, 0.05], atol=0.01)


def test_what_is_known_beforehand_holds_what_no_sounding_tells_of() -> None:
    """Turned by 0.3° about the vertical over a level bottom, the mount goes back to what was known."""
    level = soundings(Rotation.identity(), [SLOPES[0]] * 3, [10.0, 190.0], 0.0)
    step = patch_step(level, 1e-3, np.radians(3.0), np.radians([0.0, 0.0, 0.3]))
    np.testing.assert_allclose(np.degrees(step), [0.0, 0.0, -0.3], atol=0.02)
