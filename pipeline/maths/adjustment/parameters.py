"""The parameters of the adjustment, in one order: mount, instruments, surfaces, and the surfaces' parts under water.

* the sonar's: rotation ε and lever arm λ (the six mount parameters, body axes); latency τ (s, added to the recorded
  latency); range (m, added to every range); sound speed (relative increase), its gradient ((m/s)/m, downward), and
  steering speed (a further relative increase of the speed at the arrays, which steers the beams, alone); projector
  x, y, z (m, added to the place of the transmitter, frame mbes); incidence (m, added to ranges by the law of
  :mod:`~pipeline.maths.adjustment.design_matrix`, its size at 45°); level range (m, added to ranges of horizontal
  faces alone);
* the laser's: ε, λ, latency, range and incidence, with the same meaning;
* those of each further head of the sonar, after all others: the same as the first head's, but for the sound speed and
  its gradient, which are the water's, and so the first head's count for all. Each head steers its beams by the speed
  at its own arrays;
* each surface's: two turns of the normal (rad) and a shift (m), shared by all sensors;
* each surface's part under water: two further turns and a shift, by which the wet faces as built differ from the dry
  ones, and a bow (m along the normal, a parabola in height: the most at half depth, nothing at the water and at the
  lower end), as the load of the water bends walls; horizontal faces have no bow.

A run that calibrates the laser has no sonar: the mount parameters are the laser's, and no face is wet.

The mount parameters and the surfaces are estimated. The others are fixed at zero, or estimated if the config names
them. All fixed parameters are *consider* parameters: their sigmas enter the total covariance.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.geometry.rotations import exp_so3, log_so3
from pipeline.maths.mount_parameters import MOUNT_NAMES, N_MOUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Sensor = Literal["mbes", "laser"]

PROJECTOR_PARAMETERS = ("projector_x", "projector_y", "projector_z")
OF_WATER = ("sound_speed", "sound_speed_gradient", "steering_speed")
MBES_FEATURES = ("mbes_range", *OF_WATER, *PROJECTOR_PARAMETERS, "mbes_incidence")
LASER_FEATURES = ("laser_range", "laser_incidence")  # as MBES_FEATURES: those whose derivative is a feature of its own
FEATURES: dict[str, tuple[str, ...]] = {"mbes": MBES_FEATURES, "laser": LASER_FEATURES}
MBES_PARAMETERS = (*MOUNT_NAMES, "mbes_latency", *MBES_FEATURES, "mbes_level_range")
OF_ALL_HEADS = ("sound_speed", "sound_speed_gradient")  # of the water; all others of MBES_PARAMETERS each head has
OF_ONE_HEAD = tuple(name for name in MBES_PARAMETERS if name not in OF_ALL_HEADS)
OF_LASER = ("laser_latency", *LASER_FEATURES)
LASER_PARAMETERS = (*(f"laser_{name}" for name in MOUNT_NAMES), *OF_LASER)
CALIBRATED_LASER_PARAMETERS = (*MOUNT_NAMES, *OF_LASER)
SURFACE_PARAMETERS = ("turn_1", "turn_2", "shift")
N_SURFACE = len(SURFACE_PARAMETERS)
WET_PARAMETERS = (*SURFACE_PARAMETERS, "bow")
N_WET = len(WET_PARAMETERS)


def kind_of(sensor: str) -> Sensor:
    """Return which kind of sensor it is: the laser, or a head of the sonar.

    >>> kind_of("mbes_2"), kind_of("laser")
    ('mbes', 'laser')
    """
    return "laser" if sensor == "laser" else "mbes"


def names_of_head(head: str) -> tuple[str, ...]:
    """Return the names of a further head's parameters, by the name of the head.

    >>> names_of_head("mbes_2")[5:8]
    ('mbes_2_lever_arm_z', 'mbes_2_latency', 'mbes_2_range')
    """
    return tuple(f"{head}_{name.removeprefix('mbes_')}" for name in OF_ONE_HEAD)


def of_head(name: str) -> tuple[str, str]:
    """Return the further head to which a parameter belongs, empty if to none, and its name if it were the first's.

    >>> of_head("mbes_2_range"), of_head("mbes_2_projector_x"), of_head("mbes_range")
    (('mbes_2', 'mbes_range'), ('mbes_2', 'projector_x'), ('', 'mbes_range'))
    """
    found = re.fullmatch(r"(mbes_[0-9]+)_(.+)", name)
    if found is None:
        return "", name
    head, own = found.groups()
    return head, own if own in MBES_PARAMETERS else f"mbes_{own}"


@dataclass(frozen=True)
class FurtherHead:
    """A head of the sonar beside the first: its name, and its mount R_body_from_sensor (3, 3), lever_arm_m (3,)."""

    name: str
    R_body_from_sensor: Array
    lever_arm_m: Array


@dataclass(frozen=True)
class State:
    """Current values of all parameters.

    R_body_from_sensor (3, 3) and lever_arm_m (3,) are the mount of the calibrated sensor, of several heads the first;
    ``additional`` (u - 6 h - 3 s,) are the values of all parameters of :attr:`names` beside the h mounts and the
    surfaces, in order; ``further``: the mounts of the other heads.
    """

    R_body_from_sensor: Array
    lever_arm_m: Array
    surfaces: tuple[ObservedSurface, ...]
    additional: Array
    calibrated: Sensor = "mbes"
    further: tuple[FurtherHead, ...] = ()

    @classmethod
    def at(
        cls,
        R_body_from_sensor: Array,
        lever_arm_m: Array,
        surfaces: Sequence[ObservedSurface],
        calibrated: Sensor = "mbes",
        further: Sequence[FurtherHead] = (),
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
        further : sequence of FurtherHead
            The other heads of the sonar.
        """
        mounted = cls(R_body_from_sensor, lever_arm_m, tuple(surfaces), np.empty(0), calibrated, tuple(further))
        return replace(mounted, additional=np.zeros(int(mounted._is_additional.sum())))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters, in their order."""
        families = [surface.family for surface in self.surfaces]
        of_surfaces = [f"{family}_{name}" for family in families for name in SURFACE_PARAMETERS]
        of_wet = [f"wet_{family}_{name}" for family in families for name in WET_PARAMETERS]
        if self.calibrated == "laser":
            return (*CALIBRATED_LASER_PARAMETERS, *of_surfaces)
        of_heads = [name for head in self.further for name in names_of_head(head.name)]
        return (*MBES_PARAMETERS, *LASER_PARAMETERS, *of_surfaces, *of_wet, *of_heads)

    @property
    def heads(self) -> tuple[str, ...]:
        """Names of the sensors that are calibrated: of one, or of all heads of the sonar."""
        return (self.calibrated, *(head.name for head in self.further))

    def mount_of(self, sensor: str) -> tuple[Array, Array]:
        """Return R_body_from_sensor (3, 3) and the lever arm (3,) m of a sensor that is calibrated."""
        number = self.heads.index(sensor)
        head = self if number == 0 else self.further[number - 1]
        return head.R_body_from_sensor, head.lever_arm_m

    def mount_columns(self, sensor: str) -> Integers:
        """Return the places (6,) of a calibrated sensor's mount parameters among all."""
        return self._first_of(sensor) + np.arange(N_MOUNT)

    @property
    def mounts(self) -> Integers:
        """Places (6 h,) of the mount parameters of all calibrated sensors, ascending."""
        return np.concatenate([self.mount_columns(sensor) for sensor in self.heads])

    def _first_of(self, sensor: str) -> int:
        """Return the place of the first parameter of a calibrated sensor."""
        number = self.heads.index(sensor)
        behind = len(OF_ONE_HEAD) * (len(self.further) - number + 1)
        return self.size - behind if number else 0

    @property
    def _is_additional(self) -> NDArray[np.bool_]:
        """Which (u,) of the parameters belong neither to a mount nor to a surface."""
        additional = np.ones(self.size, dtype=bool)
        additional[self.mounts] = False
        additional[self.surface_slice] = False
        return additional

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
        if sensor not in self.heads:
            return np.concatenate([on_surface, np.arange(own, both)])
        first = self.surface_slice.stop + N_WET * surface
        wet = np.arange(first, first + N_WET if kind_of(sensor) == "mbes" else first)
        return np.concatenate([on_surface, self._own_columns(sensor, own), wet])

    def _own_columns(self, sensor: str, count: int) -> Integers:
        """Return the places (count,) of a calibrated sensor's parameters; the water's are the first head's for all."""
        if sensor == self.calibrated:
            return np.arange(count)
        places = np.arange(count)
        is_own = ~np.isin(MBES_PARAMETERS, OF_ALL_HEADS)
        places[is_own] = self._first_of(sensor) + np.arange(len(OF_ONE_HEAD))
        return places

    def additional_values(self) -> Array:
        """Return the additional values in a vector of all parameters (u,), zero for the mounts and the surfaces."""
        values = np.zeros(self.size)
        values[self._is_additional] = self.additional
        return values

    def deviation_from(self, other: "State") -> Array:
        """Return the deviation (u,) of all parameters but the turns from those of another state.

        R = Exp(deviation) R_other; the shift of a surface counts from its centre, and its turns are zero.
        """
        values = self.additional_values() - other.additional_values()
        for sensor in self.heads:
            (R, lever_arm_m), (R_other, other_m) = self.mount_of(sensor), other.mount_of(sensor)
            values[self.mount_columns(sensor)] = [*log_so3(R @ R_other.T), *(lever_arm_m - other_m)]
        values[self.surface_slice][2::N_SURFACE] = [surface.shift_m for surface in self.surfaces]
        return values

    def updated(self, step: Array) -> "State":
        """Return the state after a step (u,) of all parameters; rotations are composed, Exp(step) · R."""
        on_surfaces = step[self.surface_slice].reshape(-1, N_SURFACE)
        return replace(
            self._with_mount_steps(step),
            surfaces=tuple(surface.updated(*part) for surface, part in zip(self.surfaces, on_surfaces, strict=True)),
            additional=self.additional + step[self._is_additional],
        )

    def _with_mount_steps(self, step: Array) -> "State":
        """Return the state with the mounts after a step (u,) of all parameters."""
        R, lever_arm_m = self._stepped_mount(self.calibrated, step)
        further = tuple(FurtherHead(head.name, *self._stepped_mount(head.name, step)) for head in self.further)
        return replace(self, R_body_from_sensor=R, lever_arm_m=lever_arm_m, further=further)

    def _stepped_mount(self, sensor: str, step: Array) -> tuple[Array, Array]:
        (R, lever_arm_m), of_sensor = self.mount_of(sensor), step[self.mount_columns(sensor)]
        return exp_so3(of_sensor[:3]) @ R, lever_arm_m + of_sensor[3:]
