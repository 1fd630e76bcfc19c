"""The parameters of the adjustment, in one order: mount, instruments, surfaces, and the surfaces' parts under water.

* the sonar's: rotation ε and lever arm λ (the six mount parameters, body axes); latency τ (s, added to the recorded
  latency); range (m, added to every range); sound speed (relative increase), its gradient ((m/s)/m, downward), and
  steering speed (a further relative increase of the speed at the arrays, which steers the beams, alone); projector
  x, y, z (m, added to the place of the transmitter, frame mbes); incidence (m, added to ranges by the law of
  :mod:`~pipeline.maths.adjustment.design_matrix`, its size at 45°); level range (m, added to ranges of horizontal
  faces alone);
* the laser's: ε, λ, latency, range and incidence, with the same meaning;
* each surface's: two turns of the normal (rad) and a shift (m), shared by both sensors;
* each surface's part under water: two further turns and a shift, by which the wet faces as built differ from the dry
  ones, and a bow (m along the normal, a parabola in height: the most at half depth, nothing at the water and at the
  lower end), as the load of the water bends walls; horizontal faces have no bow.

A run that calibrates the laser has no sonar: the mount parameters are the laser's, and no face is wet.

The mount parameters and the surfaces are estimated. The others are fixed at zero, or estimated if the config names
them. All fixed parameters are *consider* parameters: their sigmas enter the total covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.planes import tangents_of
from pipeline.maths.geometry.rotations import exp_so3, log_so3
from pipeline.maths.mount_parameters import MOUNT_NAMES, N_MOUNT
from pipeline.maths.target.face import HORIZONTAL_COSINE

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Sensor = Literal["mbes", "laser"]

PROJECTOR_PARAMETERS = ("projector_x", "projector_y", "projector_z")
OF_WATER = ("sound_speed", "sound_speed_gradient", "steering_speed")
MBES_FEATURES = ("mbes_range", *OF_WATER, *PROJECTOR_PARAMETERS, "mbes_incidence")
LASER_FEATURES = ("laser_range", "laser_incidence")  # as MBES_FEATURES: those whose derivative is a feature of its own
FEATURES: dict[str, tuple[str, ...]] = {"mbes": MBES_FEATURES, "laser": LASER_FEATURES}
MBES_PARAMETERS = (*MOUNT_NAMES, "mbes_latency", *MBES_FEATURES, "mbes_level_range")
OF_LASER = ("laser_latency", *LASER_FEATURES)
LASER_PARAMETERS = (*(f"laser_{name}" for name in MOUNT_NAMES), *OF_LASER)
CALIBRATED_LASER_PARAMETERS = (*MOUNT_NAMES, *OF_LASER)
SURFACE_PARAMETERS = ("turn_1", "turn_2", "shift")
N_SURFACE = len(SURFACE_PARAMETERS)
WET_PARAMETERS = (*SURFACE_PARAMETERS, "bow")
N_WET = len(WET_PARAMETERS)


@dataclass(frozen=True)
class ObservedSurface:
    """The plane of one family of faces: normal · (X - centre) = shift, target frame.

    The tangents (2, 3) satisfy t1 × t2 = normal. They turn with the surface. A new choice after each step could differ,
    but the interval sums refer to these tangents.
    """

    family: str
    normal: Array
    tangents: Array
    centre_m: Array
    shift_m: float

    @classmethod
    def at(cls, family: str, normal: Array, centre_m: Array, shift_m: float = 0.0) -> "ObservedSurface":
        """Return the surface with tangents chosen from its normal.

        Parameters
        ----------
        family : str
            Name of the family of faces.
        normal : (3,) array
            Unit normal, target frame.
        centre_m : (3,) array
            Fixed point near the surface, target frame.
        shift_m : float
            Distance of the surface from the centre, along the normal.
        """
        return cls(family, normal, tangents_of(normal), centre_m, shift_m)

    @property
    def level(self) -> bool:
        """Return whether the surface is horizontal."""
        return bool(abs(self.normal[2]) > HORIZONTAL_COSINE)

    @property
    def distance_m(self) -> float:
        """Return the value of normal · X on the surface."""
        return float(self.normal @ self.centre_m + self.shift_m)

    def updated(self, turn_1: float, turn_2: float, shift_m: float) -> "ObservedSurface":
        """Return the surface after a step of its three parameters.

        Parameters
        ----------
        turn_1, turn_2 : float
            Changes of the normal along the tangents, rad.
        shift_m : float
            Change of the shift.
        """
        normal = self.normal + turn_1 * self.tangents[0] + turn_2 * self.tangents[1]
        normal /= np.linalg.norm(normal)
        first = self.tangents[0] - (self.tangents[0] @ normal) * normal
        first /= np.linalg.norm(first)
        tangents = np.stack([first, np.cross(normal, first)])
        return replace(self, normal=normal, tangents=tangents, shift_m=self.shift_m + shift_m)


@dataclass(frozen=True)
class State:
    """Current values of all parameters.

    R_body_from_sensor (3, 3) and lever_arm_m (3,) are the mount of the calibrated sensor; ``additional``
    (u - 6 - 3 s,) are the values of all parameters of :attr:`names` beside the mount and the surfaces, in order.
    """

    R_body_from_sensor: Array
    lever_arm_m: Array
    surfaces: tuple[ObservedSurface, ...]
    additional: Array
    calibrated: Sensor = "mbes"

    @classmethod
    def at(
        cls,
        R_body_from_sensor: Array,
        lever_arm_m: Array,
        surfaces: Sequence[ObservedSurface],
        calibrated: Sensor = "mbes",
    ) -> "State":
        """Return the state with zero for every additional parameter.

        Parameters
        ----------
        R_body_from_sensor : (3, 3) array
            Mount of the calibrated sensor.
        lever_arm_m : (3,) array
            Lever arm of the calibrated sensor, body axes.
        surfaces : sequence of ObservedSurface
            The surfaces that the sensors observe.
        calibrated : {"mbes", "laser"}
            The sensor that is calibrated.
        """
        mounted = cls(R_body_from_sensor, lever_arm_m, tuple(surfaces), np.empty(0), calibrated)
        return replace(mounted, additional=np.zeros(mounted.size - N_MOUNT - N_SURFACE * len(surfaces)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters, in their order."""
        families = [surface.family for surface in self.surfaces]
        of_surfaces = [f"{family}_{name}" for family in families for name in SURFACE_PARAMETERS]
        of_wet = [f"wet_{family}_{name}" for family in families for name in WET_PARAMETERS]
        if self.calibrated == "laser":
            return (*CALIBRATED_LASER_PARAMETERS, *of_surfaces)
        return (*MBES_PARAMETERS, *LASER_PARAMETERS, *of_surfaces, *of_wet)

    @property
    def _n_sensor_parameters(self) -> tuple[int, int]:
        """Number of parameters of the calibrated sensor, and of both sensors."""
        if self.calibrated == "laser":
            return len(CALIBRATED_LASER_PARAMETERS), len(CALIBRATED_LASER_PARAMETERS)
        return len(MBES_PARAMETERS), len(MBES_PARAMETERS) + len(LASER_PARAMETERS)

    @property
    def size(self) -> int:
        """Number of parameters u."""
        return len(self.names)

    @property
    def surface_slice(self) -> slice:
        """Places of the surfaces' parameters among all."""
        _, first = self._n_sensor_parameters
        return slice(first, first + N_SURFACE * len(self.surfaces))

    def surface_columns(self, surface: int) -> Integers:
        """Return the places (3,) of one surface's parameters among all."""
        return np.asarray(self.surface_slice.start + N_SURFACE * surface + np.arange(N_SURFACE))

    def columns(self, sensor: str, surface: int) -> Integers:
        """Return the places (m,) of the parameters of a sensor's observations of one surface, in the design's order."""
        own, both = self._n_sensor_parameters
        on_surface = self.surface_columns(surface)
        if sensor != self.calibrated:
            return np.concatenate([on_surface, np.arange(own, both)])
        first = self.surface_slice.stop + N_WET * surface
        wet = np.arange(first, first + N_WET if sensor == "mbes" else first)
        return np.concatenate([on_surface, np.arange(own), wet])

    def additional_values(self) -> Array:
        """Return the additional values in a vector of all parameters (u,), zero for the mount and the surfaces."""
        values = np.zeros(self.size)
        split = self.surface_slice.start - N_MOUNT
        values[N_MOUNT : self.surface_slice.start] = self.additional[:split]
        values[self.surface_slice.stop :] = self.additional[split:]
        return values

    def deviation_from(self, other: "State") -> Array:
        """Return the deviation (u,) of all parameters but the turns from those of another state.

        R = Exp(deviation) R_other; the shift of a surface counts from its centre, and its turns are zero.
        """
        values = self.additional_values() - other.additional_values()
        values[:3] = log_so3(self.R_body_from_sensor @ other.R_body_from_sensor.T)
        values[3:N_MOUNT] = self.lever_arm_m - other.lever_arm_m
        values[self.surface_slice][2::N_SURFACE] = [surface.shift_m for surface in self.surfaces]
        return values

    def updated(self, step: Array) -> "State":
        """Return the state after a step (u,) of all parameters; rotations are composed, Exp(step) · R."""
        on_surfaces = step[self.surface_slice].reshape(-1, N_SURFACE)
        others = np.concatenate([step[N_MOUNT : self.surface_slice.start], step[self.surface_slice.stop :]])
        return replace(
            self,
            R_body_from_sensor=exp_so3(step[:3]) @ self.R_body_from_sensor,
            lever_arm_m=self.lever_arm_m + step[3:N_MOUNT],
            surfaces=tuple(surface.updated(*part) for surface, part in zip(self.surfaces, on_surfaces, strict=True)),
            additional=self.additional + others,
        )
