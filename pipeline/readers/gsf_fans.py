"""Test whether the fans of a GSF file are fixed to the boat, by the positions of its soundings.

GSF records the along-track distance, the across-track distance and the depth of each beam. Their axes are level and
follow the boat's heading. GSF also records roll (starboard down +) and pitch (bow up +). If the fan is fixed to the
boat, the soundings of all pings lie in one plane of the body axes,

    y = y_0 + p x + q z     (x starboard, y forward, z down).

If it is stabilised in pitch, they lie in one plane of the level axes instead. If it is stabilised in yaw, or has tilted
sectors, they lie in neither. Least squares fit both planes. Residuals are divided by the distance: they are angles.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.maths.geometry.rotations import rotation_x, rotation_y

Array = NDArray[np.float64]
MIN_PINGS, MIN_BEAMS = 3, 5  # needed pings of a file, needed beams of a ping
NEAREST_M = 0.1
UNSTEADY_DEG = 0.2  # larger residuals of the body's plane: the fan is not fixed
STABILISED_DEG = 0.1  # larger residuals of the body's plane show stabilisation,
STABILISED_RATIO = 2.0  # if they are more than this number of times those of the level plane
_ADVICE = (
    "give the sonar's own files (.kmall and .all tell how each ping was sent), or sail again without stabilisation"
)


@dataclass(frozen=True)
class BeamPositions:
    """One ping's soundings (n,) [m] in level axes along the heading, and the boat's roll and pitch [degrees]."""

    along_m: Array
    across_m: Array
    depth_m: Array
    roll_deg: float
    pitch_deg: float


@dataclass
class FanPlaneFit:
    """Sums of the least-squares fit of one plane to the fans of all pings."""

    normal_matrix: Array = field(default_factory=lambda: np.zeros((3, 3)))
    right_side: Array = field(default_factory=lambda: np.zeros(3))
    sum_of_squares: float = 0.0

    def add(self, positions_m: Array, weight: Array) -> None:
        """Add soundings (3, n): forward, starboard, down, m; ``weight`` (n,): square roots of their weights."""
        forward, starboard, down = positions_m
        design = np.stack([np.ones_like(starboard), starboard, down]) * weight
        self.normal_matrix += design @ design.T
        self.right_side += design @ (forward * weight)
        self.sum_of_squares += float((forward * weight) @ (forward * weight))

    def rms_deg(self, count: int) -> float:
        """Return the root mean square residual of ``count`` soundings [degrees]."""
        parameters = np.linalg.lstsq(self.normal_matrix, self.right_side, rcond=1e-12)[0]
        residuals_squared = np.maximum(self.sum_of_squares - parameters @ self.right_side, 0.0)
        return float(np.degrees(np.sqrt(residuals_squared / count)))


@dataclass
class StabilisationTest:
    """The two planes through the fans of a file's pings."""

    body: FanPlaneFit = field(default_factory=FanPlaneFit)
    level: FanPlaneFit = field(default_factory=FanPlaneFit)
    pings: int = 0
    beams: int = 0

    @np.errstate(all="ignore")  # damaged numbers are left out
    def add(self, positions: BeamPositions, usable: NDArray[np.bool_]) -> None:
        """Add one ping's usable beams; ignore a ping with too few of them, or without along-track distances."""
        positions_m = np.stack([positions.along_m[usable], positions.across_m[usable], positions.depth_m[usable]])
        distance = np.linalg.norm(positions_m, axis=0)
        good = np.isfinite(distance) & (distance > NEAREST_M)
        if np.count_nonzero(good) < MIN_BEAMS or not np.any(positions_m[0, good]):
            return
        positions_m, weight = positions_m[:, good], 1 / distance[good]
        R_level_from_body = rotation_y(np.radians(positions.pitch_deg)) @ rotation_x(np.radians(positions.roll_deg))
        self.level.add(positions_m, weight)
        self.body.add(R_level_from_body.T @ positions_m, weight)
        self.pings += 1
        self.beams += len(weight)

    def refuse_stabilised(self, name: str) -> None:
        """Raise RawDataError if the fans are not fixed to the boat; fewer than MIN_PINGS pings cannot show it."""
        if self.pings < MIN_PINGS:
            return
        body_deg, level_deg = self.body.rms_deg(self.beams), self.level.rms_deg(self.beams)
        if body_deg > STABILISED_DEG and body_deg > STABILISED_RATIO * level_deg:
            raise RawDataError(
                f"{name}: its fans stand level while the boat pitches, to {level_deg:.2f} degrees (in the boat to "
                f"{body_deg:.2f}): they are stabilised; {_ADVICE}"
            )
        if body_deg > UNSTEADY_DEG:
            raise RawDataError(
                f"{name}: its fans are not fixed to the boat: its distances along track leave one plane by "
                f"{body_deg:.2f} degrees; {_ADVICE}"
            )
