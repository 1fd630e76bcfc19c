"""Whether the fans of a GSF file are fixed to the boat, by where it says that its soundings lie.

GSF tells along-track and across-track distances and depths of beams, level and along the boat's heading, and the boat's
roll (starboard down +) and pitch (bow up +). A fan fixed to the boat is one plane of the body's frame,

    y = y_0 + p x + q z     (x starboard, y forward, z down),

in all pings; a fan stabilised in pitch is one of the level frame instead, one stabilised in yaw or of tilted sectors
none of either. Both planes are fitted in least squares, residuals divided by the distance: they are angles.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.maths.geometry.rotations import rotation_x, rotation_y

Array = NDArray[np.float64]
LEAST_PINGS, LEAST_BEAMS = 3, 5  # of a ping
NEAREST_M = 0.1
UNSTEADY_DEG = 0.2  # residuals of no plane
STABILISED_DEG, TIMES = 0.1, 2.0  # residuals of the body's plane: that large, and so many times those of the level one
ADVICE = "give the sonar's own files (.kmall and .all tell how each ping was sent), or sail again without stabilisation"


@dataclass
class Plane:
    """Sums of one least-squares fit."""

    normal: Array = field(default_factory=lambda: np.zeros((3, 3)))
    right: Array = field(default_factory=lambda: np.zeros(3))
    squares: float = 0.0

    def add(self, places_m: Array, weight: Array) -> None:
        """Forward, starboard, down (3, n)."""
        forward, starboard, down = places_m
        rows = np.stack([np.ones_like(starboard), starboard, down]) * weight
        self.normal += rows @ rows.T
        self.right += rows @ (forward * weight)
        self.squares += float((forward * weight) @ (forward * weight))

    def rms_deg(self, count: int) -> float:
        found = np.linalg.lstsq(self.normal, self.right, rcond=1e-12)[0]
        return float(np.degrees(np.sqrt(np.maximum(self.squares - found @ self.right, 0.0) / count)))


@dataclass
class Fans:
    """What a file's pings tell so far."""

    body: Plane = field(default_factory=Plane)
    level: Plane = field(default_factory=Plane)
    pings: int = 0
    beams: int = 0

    @np.errstate(all="ignore")  # damaged numbers are left out
    def add(self, along_m: Array, across_m: Array, depth_m: Array, roll_deg: float, pitch_deg: float) -> None:
        """One ping's usable beams; nothing is learnt of one without distances along track."""
        places = np.stack([along_m, across_m, depth_m])
        distance = np.linalg.norm(places, axis=0)
        good = np.isfinite(distance) & (distance > NEAREST_M)
        if np.count_nonzero(good) < LEAST_BEAMS or not np.any(along_m[good]):
            return
        places, weight = places[:, good], 1 / distance[good]
        R_body_from_level = (rotation_y(np.radians(pitch_deg)) @ rotation_x(np.radians(roll_deg))).T
        self.level.add(places, weight)
        self.body.add(R_body_from_level @ places, weight)
        self.pings += 1
        self.beams += len(weight)

    def refuse(self, name: str) -> None:
        """RawDataError where they are not fixed to the boat."""
        if self.pings < LEAST_PINGS:
            return
        body, level = self.body.rms_deg(self.beams), self.level.rms_deg(self.beams)
        if body > STABILISED_DEG and body > TIMES * level:
            raise RawDataError(
                f"{name}: its fans stand level while the boat pitches, to {level:.2f} degrees (in the boat to "
                f"{body:.2f}): they are stabilised; {ADVICE}"
            )
        if body > UNSTEADY_DEG:
            raise RawDataError(
                f"{name}: its fans are not fixed to the boat: its distances along track leave one plane by "
                f"{body:.2f} degrees; {ADVICE}"
            )
