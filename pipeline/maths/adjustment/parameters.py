"""What the adjustment can determine, in one order: the six, the sensors' other parameters, the surfaces, wet faces.

* the sonar's: rotation ε and lever arm λ (body axes: the six of the contract), latency τ (s, added to the recorded
  one), range (m, added to every range), sound speed (share by which it is higher), its gradient ((m/s)/m, downward);
* the laser's: ε, λ, latency, range, alike;
* of each surface family two turns of the normal (rad) and a shift (m), shared by both sensors;
* of each family's wet faces a further two turns and a shift: how they stand off from the dry ones, as built.

Where the laser itself is calibrated there is no sonar: the six are the laser's, and nothing is wet.

The six and the surfaces are estimated. The others are held at zero, estimated where the config frees them, and in any
case *considered*: an error of theirs within its sigma is carried into the total covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.planes import tangents_of
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.target.face import HORIZONTAL_COSINE

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Sensor = Literal["mbes", "laser"]

NAMES = ("rotation_x", "rotation_y", "rotation_z", "lever_arm_x", "lever_arm_y", "lever_arm_z")
SIX = len(NAMES)
OF_MBES = (*NAMES, "mbes_latency", "mbes_range", "sound_speed", "sound_speed_gradient")
OF_LASER = (*(f"laser_{name}" for name in NAMES), "laser_latency", "laser_range")
LASER_ALONE = (*NAMES, "laser_latency", "laser_range")
OF_SURFACE = ("turn_1", "turn_2", "shift")


@dataclass(frozen=True)
class Surface:
    """normal (3,), centre c (3,), shift: normal · (X - c) = shift on it; tangents t1, t2 (2, 3) with t1 x t2 = normal.

    The tangents are carried along as the surface turns: sums are kept in them, and a fresh choice may be another.
    """

    family: str
    normal: Array
    tangents: Array
    centre_m: Array
    shift_m: float

    @classmethod
    def at(cls, family: str, normal: Array, centre_m: Array, shift_m: float = 0.0) -> "Surface":
        return cls(family, normal, tangents_of(normal), centre_m, shift_m)

    @property
    def level(self) -> bool:
        """Whether it is horizontal."""
        return bool(abs(self.normal[2]) > HORIZONTAL_COSINE)

    @property
    def distance_m(self) -> float:
        """normal · X on it."""
        return float(self.normal @ self.centre_m + self.shift_m)

    def moved(self, turn_1: float, turn_2: float, shift_m: float) -> "Surface":
        normal = self.normal + turn_1 * self.tangents[0] + turn_2 * self.tangents[1]
        normal /= np.linalg.norm(normal)
        first = self.tangents[0] - (self.tangents[0] @ normal) * normal
        first /= np.linalg.norm(first)
        tangents = np.stack([first, np.cross(normal, first)])
        return replace(self, normal=normal, tangents=tangents, shift_m=self.shift_m + shift_m)


@dataclass(frozen=True)
class State:
    """Current values: the mount of the sensor that is calibrated, the surfaces, and ``other`` (u - 6 - 3 s,), the rest
    of :meth:`names`, in order."""

    R_body_from_sensor: Array
    lever_arm_m: Array
    surfaces: tuple[Surface, ...]
    other: Array
    calibrated: Sensor = "mbes"

    @classmethod
    def at(
        cls, R_body_from_sensor: Array, lever_arm_m: Array, surfaces: Sequence[Surface], calibrated: Sensor = "mbes"
    ) -> "State":
        first = cls(R_body_from_sensor, lever_arm_m, tuple(surfaces), np.empty(0), calibrated)
        return replace(first, other=np.zeros(first.size - SIX - len(OF_SURFACE) * len(surfaces)))

    @property
    def names(self) -> tuple[str, ...]:
        """Of all unknowns, in their order."""
        families = [surface.family for surface in self.surfaces]
        shared = [f"{family}_{name}" for family in families for name in OF_SURFACE]
        if self.calibrated == "laser":
            return (*LASER_ALONE, *shared)
        return (*OF_MBES, *OF_LASER, *shared, *(f"wet_{name}" for name in shared))

    @property
    def _of_sensors(self) -> tuple[int, int]:
        """How many unknowns are those of the calibrated sensor, and of it and the other."""
        own = len(LASER_ALONE if self.calibrated == "laser" else OF_MBES)
        return own, own + (0 if self.calibrated == "laser" else len(OF_LASER))

    @property
    def size(self) -> int:
        return len(self.names)

    @property
    def shared(self) -> slice:
        """Where the surfaces shared by both sensors stand."""
        _, first = self._of_sensors
        return slice(first, first + len(OF_SURFACE) * len(self.surfaces))

    def columns(self, sensor: str, surface: int) -> Integers:
        """The unknowns that one sensor's observations of one surface depend on, in the order of the design."""
        own, both = self._of_sensors
        first = both + len(OF_SURFACE) * surface
        shared = np.arange(first, first + len(OF_SURFACE))
        if sensor != self.calibrated:
            return np.concatenate([shared, np.arange(own, both)])
        wet = shared + len(OF_SURFACE) * len(self.surfaces) if sensor == "mbes" else shared[:0]
        return np.concatenate([shared, np.arange(own), wet])

    def values_of_other(self) -> Array:
        """``other`` in the places of all unknowns (u,), zero elsewhere."""
        return np.concatenate([np.zeros(SIX), self.other[: self.shared.start - SIX], np.zeros(self._shared_size),
                               self.other[self.shared.start - SIX :]])

    @property
    def _shared_size(self) -> int:
        return len(OF_SURFACE) * len(self.surfaces)

    def moved(self, step: Array) -> "State":
        """By a step of all unknowns (u,)."""
        shared = step[self.shared].reshape(-1, len(OF_SURFACE))
        return replace(
            self,
            R_body_from_sensor=exp_so3(step[:3]) @ self.R_body_from_sensor,
            lever_arm_m=self.lever_arm_m + step[3:SIX],
            surfaces=tuple(surface.moved(*turns) for surface, turns in zip(self.surfaces, shared, strict=True)),
            other=self.other + np.concatenate([step[SIX : self.shared.start], step[self.shared.stop :]]),
        )
