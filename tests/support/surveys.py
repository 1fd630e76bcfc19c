"""Surveys of marks by a forward model of its own: scipy's rotations, signs as CONVENTIONS.md has them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.support.mount_errors import rotation_error

Array = np.ndarray


def mount_rotation(roll: float, pitch: float, yaw: float) -> Rotation:
    """R_body_from_sensor = Rz(yaw) · Rx(pitch) · Ry(roll), degrees."""
    return Rotation.from_euler("ZXY", [yaw, pitch, roll], degrees=True)


def attitude_rotation(roll: float, pitch: float, azimuth: float) -> Rotation:
    """R_level_from_body = Rz(-azimuth) · Rx(pitch) · Ry(roll), degrees."""
    return Rotation.from_euler("ZXY", [-azimuth, pitch, roll], degrees=True)


MOUNTS = {"laser": (0.35, -0.22, 40.4, 0.21, 0.48, 1.10), "mbes": (-48.8, 1.2, -2.0, 0.30, 0.20, -0.91)}
ATTITUDE = (1.7, -2.3, 143.0)  # of the boat on its stand
PLACE = np.array([4123.0, 977.0, 12.0])
ON_BODY = {  # marks by the body frame: the INS's own, and two of the bracket
    "I1": (0.08, 0.10, 0.06), "I2": (-0.08, 0.10, 0.07), "I3": (0.08, -0.11, 0.06), "I4": (-0.09, -0.12, -0.05),
    "B1": (0.35, 0.75, 0.20), "B2": (-0.40, 0.30, -0.35),
}  # fmt: skip
ON_LASER = {"L1": (0.15, 0.02, 0.10), "L2": (-0.14, 0.05, 0.12), "L3": (0.01, 0.16, -0.08), "L4": (0.03, -0.15, -0.10)}
ON_MBES = {"M1": (0.22, 0.05, 0.08), "M2": (-0.20, 0.06, 0.10), "M3": (0.02, 0.19, 0.00), "M4": (0.05, -0.16, 0.12)}
ALONG = {"A1": (0.0, -0.40, 0.0), "A2": (0.0, 0.60, 0.0), "S1": (-0.45, 0.0, 0.0), "S2": (0.40, 0.0, 0.0)}


@dataclass
class World:
    """What is true: marks by frame, mounts, the boat's attitude; and with which sigmas it is measured."""

    frames: dict[str, Mapping[str, Any]] = field(
        default_factory=lambda: {"body": ON_BODY, "laser": ON_LASER, "mbes": ON_MBES}
    )
    mounts: dict[str, tuple[float, ...]] = field(default_factory=lambda: dict(MOUNTS))
    attitude: tuple[float, float, float] = ATTITUDE
    place: Array = field(default_factory=lambda: PLACE)
    shared: tuple[tuple[str, str, str], ...] = ()  # mark, frame that has it, frame that has it as well

    def rotation(self, sensor: str) -> Rotation:
        return Rotation.identity() if sensor == "body" else mount_rotation(*self.mounts[sensor][:3])

    def lever_arm(self, sensor: str) -> Array:
        return np.zeros(3) if sensor == "body" else np.array(self.mounts[sensor][3:])

    def in_body(self) -> dict[str, Array]:
        """Every mark in the body frame."""
        found = {}
        for frame, marks in self.frames.items():
            for name, at in marks.items():
                found[name] = self.rotation(frame).apply(at) + self.lever_arm(frame)
        return found

    def drawings(self) -> dict[str, dict[str, Array]]:
        """Every frame's marks in its own axes, shared ones in both."""
        found = {frame: {k: np.array(v) for k, v in marks.items()} for frame, marks in self.frames.items()}
        in_body = self.in_body()
        for mark, _, frame in self.shared:
            found[frame][mark] = self.rotation(frame).inv().apply(in_body[mark] - self.lever_arm(frame))
        return found

    def survey(self) -> dict[str, Array]:
        """Total-station coordinates without error."""
        level = attitude_rotation(*self.attitude)
        return {name: level.apply(at) + self.place for name, at in self.in_body().items()}


def error(world: World, sensor: str, R_found: Array, lever_arm_m: Array) -> Array:
    """(ε, δl): R_true = Exp(ε) R_found; true minus found."""
    turn = rotation_error(world.rotation(sensor).as_matrix(), R_found)
    return np.concatenate([turn, world.lever_arm(sensor) - lever_arm_m])


SHARED = World(shared=(("B1", "body", "laser"), ("B2", "body", "mbes")))
BY_AXES = World(frames={"body": {"O": (0.0, 0.0, 0.0)} | ALONG, "laser": ON_LASER, "mbes": ON_MBES})
