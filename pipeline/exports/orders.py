"""The six orders in which a program may compose roll, pitch and yaw, and the angles of one rotation in each of them.

An order is a word of three letters, from the outermost (leftmost) factor to the innermost: ``YPR`` is Rz(yaw) ·
Rx(pitch) · Ry(roll), the order of this project (CONVENTIONS.md). Axes are starboard, forward, up; all angles are
right-handed.
"""

import warnings
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.maths.geometry.rotations import log_so3, rotation_x, rotation_y, rotation_z

Array = NDArray[np.float64]
Angles = dict[str, float]  # by letter (R, P, Y), rad

OURS = "YPR"
ORDERS = tuple("".join(letters) for letters in permutations(OURS))
_TURNS = {"R": rotation_y, "P": rotation_x, "Y": rotation_z}
_AXES = {"R": "Y", "P": "X", "Y": "Z"}  # letters of scipy; capitals: about turned axes
_UNITS = {"R": (0.0, 1.0, 0.0), "P": (1.0, 0.0, 0.0), "Y": (0.0, 0.0, 1.0)}


def composed(angles: Angles, order: str) -> Array:
    """Return the rotation (3, 3) of roll, pitch and yaw (rad, by letter) composed in an order.

    >>> composed({"R": 0.0, "P": np.pi / 2, "Y": np.pi / 2}, "YPR").round(12) @ [0, 1, 0]  # bow up, then round upright
    array([0., 0., 1.])
    """
    first, second, third = (_TURNS[letter](angles[letter]) for letter in order)
    return np.asarray(first @ second @ third)


def decomposed(R: Array, order: str) -> Angles:
    """Return the angles (rad, by letter) of a rotation (3, 3) that :func:`composed` in this order gives it back.

    The middle angle is within ±90°. At exactly ±90° the first and the third turn about one axis, and the third is 0.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # scipy's warning of that case
        angles = Rotation.from_matrix(R).as_euler("".join(_AXES[letter] for letter in order))
    return {letter: float(angle) for letter, angle in zip(order, angles, strict=True)}


def partials(angles: Angles, order: str) -> dict[str, Array]:
    """Return by letter the derivatives ∂angle/∂ε (3,) of R' = Exp(ε) · R, ε about the fixed axes.

    In R = R1(a1) R2(a2) R3(a3) each angle turns about its own axis as the factors before it turned it: ε = e1 da1 +
    R1 e2 da2 + R1 R2 e3 da3. With these axes as columns of A, the partials are the rows of A⁻¹. (Where the middle
    angle is ±90° A has none; its pseudo-inverse is taken.)
    """
    turned, axes = np.eye(3), []
    for letter in order:
        axes.append(turned @ np.array(_UNITS[letter]))
        turned = turned @ _TURNS[letter](angles[letter])
    rows = np.linalg.pinv(np.column_stack(axes))
    return {letter: rows[place] for place, letter in enumerate(order)}


def errors_by_order(R: Array, printed: str) -> dict[str, float]:
    """Return by order the angle (degrees) between R and what a program makes of the numbers printed for it.

    The numbers are the roll, pitch and yaw of R (3, 3) in the order ``printed``; the program composes them in each of
    the six orders. In the order printed the error is zero.
    """
    angles = decomposed(R, printed)
    return {order: float(np.degrees(np.linalg.norm(log_so3(composed(angles, order) @ R.T)))) for order in ORDERS}
