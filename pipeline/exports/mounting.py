"""The mount to be written: a sensor's rotation, lever arm and covariance, and the vessel's frame for it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.config.session import Calibrated
from pipeline.errors import ConfigError
from pipeline.maths.geometry.rotations import rotation_from_mount
from pipeline.mount import Mounted

Array = NDArray[np.float64]
SENSOR_WORDS = {"mbes": "sonar", "laser": "laser"}
OF_INS = "Positions count from the point whose positions the INS's files hold, angles from the INS's axes."
_THREE = r"(\S+) (\S+) (\S+)"
_STATED = re.compile(rf"the INS stands at {_THREE} m \(starboard, forward, up\), turned by {_THREE} degrees")


@dataclass(frozen=True)
class VesselFrame:
    """The INS in the frame of the program: where its point is, and how its body is turned against the vessel.

    The program's reference point is the origin; axes are starboard, forward, up. ``ins_turn_deg``: roll, pitch, yaw of
    the INS's body in the vessel, signs and order as those of a mount. Zero: the program takes the INS's attitude for
    the vessel's, which is usual.
    """

    ins_point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ins_turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def is_ins(self) -> bool:
        """Whether the frame is the INS's own."""
        return not any((*self.ins_point_m, *self.ins_turn_deg))

    @property
    def R_vessel_from_body(self) -> Array:
        """The turn of the INS, (3, 3)."""
        return rotation_from_mount(*map(float, np.radians(self.ins_turn_deg)))

    def from_body(self, body: Mounted) -> Mounted:
        """Return a mount in the vessel's frame.

        R_vessel_from_sensor = R_vessel_from_body · R_body_from_sensor; t = p_ins + R_vessel_from_body · lever arm.
        """
        R = self.R_vessel_from_body
        return Mounted(R @ body.R_body_from_sensor, np.array(self.ins_point_m) + R @ body.lever_arm_body_m)

    def to_body(self, vessel: Mounted) -> Mounted:
        """Return a mount in the INS's body frame: inverse of :meth:`from_body`."""
        R = self.R_vessel_from_body.T
        return Mounted(R @ vessel.R_body_from_sensor, R @ (vessel.lever_arm_body_m - np.array(self.ins_point_m)))

    def sentence(self) -> str:
        """Return a sentence that says what positions and angles count from."""
        if self.is_ins:
            return (
                f"{OF_INS} If the program counts from another point, or turns the INS itself, export again with "
                "--ins-point, "
                "--ins-turn."
            )
        point, turn = (
            " ".join(f"{value:.10g}" for value in values) for values in (self.ins_point_m, self.ins_turn_deg)
        )
        return (
            f"Positions count from the vessel's reference point, from which the INS stands at {point} m (starboard, "
            f"forward, up), turned by {turn} degrees (roll, pitch, yaw): as told by the options of poolcal export. "
            "Their "
            "errors are in no sigma here."
        )

    @classmethod
    def stated_in(cls, text: str, where: str) -> "VesselFrame | None":
        """Return the frame that a text states in the words of :meth:`sentence`; None if it states none."""
        words = " ".join(text.split())  # sheets break their lines
        found = set(_STATED.findall(words))
        if not found:
            return cls() if OF_INS in words else None
        if len(found) > 1:
            raise ConfigError(f"{where}: states two places of the INS; export the file again")
        try:
            point, turn = np.array(found.pop(), dtype=np.float64).reshape(2, 3).tolist()
        except ValueError as error:
            raise ConfigError(f"{where}: the place of the INS is no number; export the file again") from error
        return cls(vector(point, "the INS's place", 1000.0), vector(turn, "the INS's turn", 360.0))


@dataclass(frozen=True)
class Origin:
    """Where a mount comes from.

    rejected: reasons of a rejected run, None if it was accepted; held: values that the run does not call good enough;
    free: what else was estimated with the mount, in words; start_utc: begin of the first pass; digest: SHA-256 of
    calibration.json; kind: what the mount is, in words; purpose: the only survey that it is good for, if there is one.
    """

    session: str
    run: str
    kind: str
    rejected: tuple[str, ...] | None = None
    held: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    start_utc: str | None = None
    digest: str | None = None
    purpose: str = ""


@dataclass(frozen=True)
class Mounting:
    """The mount of a sensor.

    Attributes
    ----------
    sensor
        The sensor.
    body
        Its mount on the INS's body.
    covariance
        Total covariance (6, 6) of (ε about body x, y, z; lever arm x, y, z), rad and m; None: not known.
    frame
        The vessel's frame.
    latency_s
        What is to be subtracted from the sensor's recorded times so that they agree with the INS's recorded times.
    projector_offset_m
        Transmitter from receiver (3,), in the sonar's frame; None: not given.
    split
        True: the lever arm has x and z of the receiver and y of the transmitter, as from Kongsberg's files.
    """

    sensor: Calibrated
    body: Mounted
    covariance: Array | None
    origin: Origin
    frame: VesselFrame = field(default_factory=VesselFrame)
    latency_s: float = 0.0
    projector_offset_m: tuple[float, float, float] | None = None
    split: bool = False

    @property
    def vessel(self) -> Mounted:
        """The mount in the vessel's frame."""
        return self.frame.from_body(self.body)

    @property
    def covariance_vessel(self) -> Array | None:
        """The covariance in the vessel's axes: ε and lever arm turn like vectors."""
        if self.covariance is None:
            return None
        R = np.kron(np.eye(2), self.frame.R_vessel_from_body)
        return np.asarray(R @ self.covariance @ R.T)

    def arrays(self) -> tuple[Mounted, Mounted]:
        """Return the mounts of transmitter and receiver in the vessel's frame; both have the same rotation.

        With the offset o of the transmitter from the receiver, in the sonar's frame, the receiver is at the lever arm
        t and the transmitter at t + R o. If the lever arm has y of the transmitter (``split``), the receiver is at
        t - R (0, o_y, 0) and the transmitter at t + R (o_x, 0, o_z). Without an offset both are at t.

        Raises
        ------
        ConfigError
            The sonar's files tell the places of both, so that they are not one, and no offset is given.
        """
        if self.projector_offset_m is None and self.split:
            raise ConfigError(
                "--projector-offset: is needed: this sonar's files have transmitter and receiver apart, and the lever "
                "arm "
                "found has x and z of the receiver, y of the transmitter; give the transmitter's place from the "
                "receiver "
                "(starboard, forward, up, m), such as 0 0 0"
            )
        offset = np.array(self.projector_offset_m or (0.0, 0.0, 0.0))
        along = offset * [0.0, 1.0, 0.0] if self.split else np.zeros(3)
        vessel, R = self.vessel, self.vessel.R_body_from_sensor
        receiver = vessel.lever_arm_body_m - R @ along
        return Mounted(R, receiver + R @ offset), Mounted(R, receiver)


def vector(values: Sequence[float] | None, option: str, most: float) -> tuple[float, float, float]:
    """Return an option's three numbers, zero if it is not given; raise ConfigError if one is larger than ``most``."""
    if values is None:
        return (0.0, 0.0, 0.0)
    for value in values:
        if not abs(value) <= most:
            raise ConfigError(f"{option} {value:g}: must be within ±{most:g}")
    x, y, z = map(float, values)
    return x, y, z


def sigma_text(sigmas: Mapping[str, float] | None, role: str) -> str:
    """Return a number's standard deviation as text; empty if it is not known."""
    if sigmas is None:
        return ""
    return f"sigma {sigmas[role]:.4f} {'m' if role in ('x', 'y', 'z') else '°'}"
