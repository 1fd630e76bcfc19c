"""What may have been entered in place of the calibrated mount: rotations and lever arms, each with its mistake.

Angles are settings (roll, pitch, yaw) of R = Rz(yaw) Rx(pitch) Ry(roll). A survey software with the axes forward,
starboard, down composes the same angles about its own axes; the step between both turns every elementary rotation into
one about the same physical axis (CONVENTIONS.md, exports' P), so another order there is another order here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.run_soundings import EntrySource
from pipeline.maths.geometry.rotations import exp_so3, mount_from_rotation, rotation_x, rotation_y, rotation_z
from pipeline.mount import Mounted

Array = NDArray[np.float64]
ANGLES, AXES = ("roll", "pitch", "yaw"), ("x", "y", "z")
RIGHT = "right"
FOOT_M = 0.3048
NEAR_RAD, NEAR_M = np.radians(0.025), 0.01  # 4 mm of a sounding at 10 m; about what a search by places bridges


@dataclass(frozen=True)
class Entered:
    """One way to enter a rotation or a lever arm.

    Attributes
    ----------
    key
        The mistake's code; the same for the rotation and the lever arm if one mistake spoils both.
    words
        The mistake in words.
    mistakes
        Number of mistakes in it: 0 is right.
    value
        Rotation (3, 3) or lever arm (3,).
    """

    key: str
    words: str
    mistakes: int
    value: Array


COMMON = {  # mistakes that may spoil the angles, the lever arm, or both
    "not_entered": "the coarse mount still stands there: the calibrated one was not entered",
    "twice": "the correction was entered twice",
    "minus": "the correction was entered with the opposite sign",
    "correction_alone": "the correction was entered in place of the total",
    "added": "the total was entered as a correction: it was added to the coarse mount",
    "doubled": "the mount was applied twice, as if the data had not been turned by it yet",
    "zero": "zeros stand there: no mount was entered",
    "backwards": "the way back was entered, from the body to the sonar: inverse rotation, opposite lever arm",
}

GRID_NORTH = "headings were taken from grid north in place of true north, or the other way (meridian convergence)"


def composed(angles_rad: Array, order: str = "yaw pitch roll") -> Array:
    """Return the product (3, 3) of the rotations by roll, pitch, yaw; ``order``: theirs, from left to right."""
    by_name = dict(zip(ANGLES, (rotation_y(angles_rad[0]), rotation_x(angles_rad[1]), rotation_z(angles_rad[2])),
                       strict=True))  # fmt: skip
    first, second, third = (by_name[name] for name in order.split())
    return np.asarray(first @ second @ third)


def rotations(source: EntrySource) -> Iterator[Entered]:
    """Yield the rotations that may have been entered, the right one first."""
    R, R_coarse = source.total.R_body_from_sensor, source.coarse.R_body_from_sensor
    total, coarse = np.array(mount_from_rotation(R)), np.array(mount_from_rotation(R_coarse))
    change, R_change = total - coarse, R @ R_coarse.T
    yield Entered(RIGHT, "the angles are right", 0, R)
    for key, value in {
        "not_entered": R_coarse, "twice": R_change @ R, "minus": R_change.T @ R_coarse, "correction_alone": R_change,
        "added": R @ R_coarse, "doubled": R @ R, "zero": np.eye(3), "backwards": R.T,
    }.items():  # fmt: skip
        yield Entered(key, COMMON[key], 1, value)
    for key, angles in {
        "twice": total + change, "minus": coarse - change, "correction_alone": change, "added": total + coarse,
        "doubled": 2 * total, "backwards": -total,
    }.items():  # fmt: skip
        yield Entered(key, COMMON[key], 1, composed(angles))
    yield Entered("radians", "degrees were taken for radians", 1, composed(np.degrees(total)))
    yield Entered(
        "degrees", "the angles were entered in radians, and taken for degrees", 1, composed(np.radians(total))
    )
    yield Entered("roll_for_pitch", "roll and pitch are exchanged", 1, composed(total[[1, 0, 2]]))
    for place, name in enumerate(ANGLES):
        for key, words, other in (("coarse", "still has its coarse value", coarse), ("zero", "is zero", 0 * total)):
            angles = np.where(np.arange(3) == place, other, total)
            yield Entered(f"{key}_{name}", f"{name} {words}", 1, composed(angles))
    for turn in _grid_turns(source):
        yield Entered("grid_north", GRID_NORTH, 1, turn @ R)
    yield from _orders_and_signs(total)


def _grid_turns(source: EntrySource) -> tuple[Array, Array]:
    """Return the turns (3, 3) of a boat whose heading is wrong by the meridian convergence, to either side."""
    return rotation_z(source.convergence_rad), rotation_z(-source.convergence_rad)


def _orders_and_signs(total: Array) -> Iterator[Entered]:
    for order, signs in product(permutations(("yaw", "pitch", "roll")), product((1.0, -1.0), repeat=3)):
        turned = [name for name, sign in zip(ANGLES, signs, strict=True) if sign < 0]
        other = order != ("yaw", "pitch", "roll")
        if turned or other:
            words = [f"{' and '.join(turned)} {'has' if len(turned) == 1 else 'have'} the opposite sign"] * bool(turned)
            words += [
                f"the software turns in another order: {' · '.join(order)} in place of yaw · pitch · roll"
            ] * other
            key = "_".join([*(f"sign_{name}" for name in turned), *(["order", *order] if other else [])])
            value = composed(total * signs, " ".join(order))
            yield Entered(key, ", and ".join(words), len(turned) + other, value)


def lever_arms(source: EntrySource) -> Iterator[Entered]:
    """Yield the lever arms that may have been entered, the right one first."""
    R, t, t_coarse = source.total.R_body_from_sensor, source.total.lever_arm_body_m, source.coarse.lever_arm_body_m
    change = t - t_coarse
    yield Entered(RIGHT, "the lever arm is right", 0, t)
    for key, value in {
        "not_entered": t_coarse, "twice": t + change, "minus": t_coarse - change, "correction_alone": change,
        "added": t + t_coarse, "zero": np.zeros(3), "backwards": -t,
    }.items():  # fmt: skip
        yield Entered(key, COMMON[key], 1, value)
    yield Entered("doubled", COMMON["doubled"], 1, 2 * t)
    yield Entered("doubled", COMMON["doubled"], 1, R @ t + t)
    yield Entered("backwards", COMMON["backwards"], 1, -R.T @ t)
    yield Entered("from_laser", "the lever arm is counted from the laser", 1, t - source.laser.lever_arm_body_m)
    yield Entered("laser", "the laser's lever arm stands there", 1, source.laser.lever_arm_body_m)
    yield Entered("sonar_axes", "the lever arm is given in the sonar's axes", 1, R.T @ t)
    yield Entered("turned", "the lever arm was turned by the mount's angles", 1, R @ t)
    yield Entered("feet", "metres were taken for feet", 1, t * FOOT_M)
    yield Entered("metres", "the lever arm was entered in feet, and taken for metres", 1, t / FOOT_M)
    for place, name in enumerate(AXES):
        for key, words, other in (("coarse", "still has its coarse value", t_coarse), ("zero", "is zero", 0 * t)):
            yield Entered(f"{key}_{name}", f"{name} {words}", 1, np.where(np.arange(3) == place, other, t))
    for turn in _grid_turns(source):
        yield Entered("grid_north", GRID_NORTH, 1, turn @ t)
    yield from _axes_and_signs(t)


def _axes_and_signs(t: Array) -> Iterator[Entered]:
    for axes, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        exchanged = "".join(AXES[axis] for axis in axes)
        turned = [name for name, sign in zip(AXES, signs, strict=True) if sign < 0]
        moved = [name for name, other in zip(AXES, exchanged, strict=True) if name != other]
        if turned or moved:
            words = [f"{' and '.join(moved)} are exchanged ({exchanged} in place of xyz)"] * bool(moved)
            words += [f"{' and '.join(turned)} {'has' if len(turned) == 1 else 'have'} the opposite sign"] * bool(
                turned
            )
            key = "_".join([*(["axes", exchanged] if moved else []), *(f"sign_{name}" for name in turned)])
            mistakes = len(turned) + (0, 0, 1, 2)[len(moved)]
            yield Entered(key, ", and ".join(words), mistakes, np.array(signs) * t[list(axes)])


def _near(total: Mounted) -> Iterator[Mounted]:
    """Yield mounts that are a little off the right one in one parameter: more than a search by places would bridge."""
    for sign, step, axis in product((1.0, -1.0), (1.0, 2.0), np.eye(3)):
        R = exp_so3(sign * step * NEAR_RAD * axis) @ total.R_body_from_sensor
        yield Mounted(R, total.lever_arm_body_m)
        yield Mounted(total.R_body_from_sensor, total.lever_arm_body_m + sign * step * NEAR_M * axis)


def starts(source: EntrySource) -> list[Mounted]:
    """Return mounts from which the search for the file's soundings begins: the right one, others near it, mistakes.

    Of the mistakes those of either part alone come first.
    """
    angles, arms = list(rotations(source)), list(lever_arms(source))
    joint = [(a, b) for a, b in product(angles, arms) if RIGHT in (a.key, b.key) or a.key == b.key]
    rest = [(a, b) for a, b in product(angles, arms) if a.key != b.key and a.mistakes == b.mistakes == 1]
    first, *others = (Mounted(a.value, b.value) for a, b in [*joint, *rest])
    return [first, *_near(first), *others]
