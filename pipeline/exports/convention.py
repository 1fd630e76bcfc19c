"""Axes, signs, order and units with which another program takes a mount, and the numbers of a mount in them.

Why one form covers all: every program here composes elementary rotations about its own axes, which are ours (x
starboard, y forward, z up), exchanged or turned round. Let the rows of P be the program's axes in ours: x' = P x. Then
a rotation R is P R Pᵀ for the program, a product of elementary rotations becomes the product of the turned ones in the
same order, and a turn about one of our axes is a turn about ± one of the program's. So a program that composes Rz·Ry·Rx
in forward, starboard, down (P = [[0,1,0],[1,0,0],[0,0,-1]]) has

    P · Rz(yaw) Rx(pitch) Ry(roll) · Pᵀ = Rz(-yaw) · Ry(pitch) · Rx(roll)

exactly, at any tilt: our order, with the sign of yaw turned. What remains of a convention is thus P, three signs, the
order by the letters of :mod:`pipeline.exports.orders`, and units. (CARIS's axes starboard, forward, down are
left-handed: there the angles are defined by words, not by a hand, and P serves the positions alone.)
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.exports.orders import OURS, composed, decomposed, partials
from pipeline.mount import Mounted

Array = NDArray[np.float64]
Rows = tuple[tuple[int, int, int], tuple[int, int, int], tuple[int, int, int]]
Certainty = Literal["code", "official", "secondary"]

SFU: Rows = ((1, 0, 0), (0, 1, 0), (0, 0, 1))  # starboard, forward, up: ours
FRD: Rows = ((0, 1, 0), (1, 0, 0), (0, 0, -1))  # forward, starboard, down
SFD: Rows = ((1, 0, 0), (0, 1, 0), (0, 0, -1))  # starboard, forward, down
FLU: Rows = ((0, 1, 0), (-1, 0, 0), (0, 0, 1))  # forward, left, up
AXIS_WORDS = {
    SFU: ("starboard +", "toward the bow +", "up +"),
    FRD: ("toward the bow +", "starboard +", "down +"),
    SFD: ("starboard +", "toward the bow +", "down +"),
    FLU: ("toward the bow +", "port +", "up +"),
}
ROLL_WORDS = {1: "starboard side down +", -1: "starboard side up +"}
PITCH_WORDS = {1: "bow up +", -1: "bow down +"}
YAW_WORDS = {1: "bow to port +, counter-clockwise from above", -1: "bow to starboard +, clockwise from above"}
CERTAINTY_WORDS = {
    "code": "read in the program's own source",
    "official": "by the maker's own text",
    "secondary": "by another maker's manual or by a third party's code: check with a patch test before you rely on it",
}


@dataclass(frozen=True)
class Numbers:
    """A mount in a program's own terms: position (3,) in its axes, m; angles in its signs, degrees."""

    position_m: Array
    roll_deg: float
    pitch_deg: float
    yaw_deg: float

    def by_role(self) -> dict[str, float]:
        """Return the six numbers by role: x, y, z (m), roll, pitch, yaw (degrees)."""
        position = dict(zip(("x", "y", "z"), map(float, self.position_m), strict=True))
        return position | {"roll": self.roll_deg, "pitch": self.pitch_deg, "yaw": self.yaw_deg}


@dataclass(frozen=True)
class Convention:
    """A program's convention.

    Attributes
    ----------
    axes
        Rows of P: the program's x, y, z in starboard, forward, up.
    signs
        Signs of the program's roll, pitch and yaw (heading) against ours.
    order
        Order of rotations, as in :mod:`pipeline.exports.orders`; None: not known.
    certainty, source
        How sure the least sure of axes, signs and order is, and where they stand. (An unknown order is told apart.)
    zero_to_360
        True: the heading is written from 0 to 360 degrees.
    """

    axes: Rows
    signs: tuple[int, int, int]
    order: str | None
    certainty: Certainty
    source: str
    zero_to_360: bool = False

    def words(self) -> dict[str, str]:
        """Return the words for the positive sense of each number, by role."""
        position = dict(zip(("x", "y", "z"), AXIS_WORDS[self.axes], strict=True))
        roll, pitch, yaw = self.signs
        return position | {"roll": ROLL_WORDS[roll], "pitch": PITCH_WORDS[pitch], "yaw": YAW_WORDS[yaw]}

    def order_used(self, told: str | None) -> str:
        """Return the order in which angles are written: the program's; if it is not known, the one told, or ours."""
        return self.order or told or OURS

    def numbers(self, mounted: Mounted, told: str | None = None) -> Numbers:
        """Return a mount in the program's terms.

        Parameters
        ----------
        mounted
            The mount in the frame that the program measures in, axes starboard, forward, up.
        told
            The order of rotations that the user has told; counts only where the program's is not known.
        """
        angles = np.degrees([decomposed(mounted.R_body_from_sensor, self.order_used(told))[letter] for letter in "RPY"])
        roll, pitch, yaw = (float(sign * angle) for sign, angle in zip(self.signs, angles, strict=True))
        return Numbers(self.position(mounted.lever_arm_body_m), roll, pitch, yaw % 360.0 if self.zero_to_360 else yaw)

    def position(self, position_m: Array) -> Array:
        """Return a position (3,) in the program's axes."""
        return np.array(self.axes, dtype=np.float64) @ position_m

    def mounted(self, numbers: Numbers, told: str | None = None) -> Mounted:
        """Return the mount of numbers in the program's terms: inverse of :meth:`numbers`."""
        given = (numbers.roll_deg, numbers.pitch_deg, numbers.yaw_deg)
        angles = {
            letter: float(np.radians(sign * angle))
            for letter, sign, angle in zip("RPY", self.signs, given, strict=True)
        }
        return Mounted(composed(angles, self.order_used(told)), np.array(self.axes).T @ numbers.position_m)

    def sigmas(self, mounted: Mounted, covariance: Array, told: str | None = None) -> dict[str, float]:
        """Return the standard deviations of the six numbers by role, m and degrees.

        Parameters
        ----------
        mounted
            As in :meth:`numbers`.
        covariance
            Covariance (6, 6) of (ε, lever arm), rad and m, in the axes of ``mounted``.
        told
            As in :meth:`numbers`.
        """
        order = self.order_used(told)
        rows = partials(decomposed(mounted.R_body_from_sensor, order), order)
        turns, shifts = covariance[:3, :3], self.position(self.position(covariance[3:, 3:]).T)
        angles = {name: float(np.degrees(np.sqrt(rows[letter] @ turns @ rows[letter]))) for name, letter in
                  (("roll", "R"), ("pitch", "P"), ("yaw", "Y"))}  # fmt: skip
        return dict(zip(("x", "y", "z"), map(float, np.sqrt(np.diag(shifts))), strict=True)) | angles
