"""How Kongsberg's transmitter lies against its receiver, from the installation that .kmall and .all files begin with.

Kongsberg's axes are forward, starboard, down; an array with the installation angles R, P, H [degrees] is turned by
Rz(H) Ry(P) Rx(R). Beam angles refer to the receiving array, tilts of sectors to the transmitting one, which may look
the other way (H near 180 degrees): then a tilt forward of its own is one aft in the receiver's frame ``mbes``. Ranges
run from the sector's part of the transmitter to the target and back to the receiver.

An installation is a text of KEY:VALUE or KEY=VALUE, parted by commas. .kmall: TRAI_TX1 and TRAI_RX1, or for one head
TRAI_HD1, with X, Y, Z [m], R, P, H, and the parts of the array IPX, IPY, IPZ (port), IC. (centre), IS. (starboard), and
the receiver's I. (of a head IR.); .all: S1X to S1H of the transmitter or head, S2 and S3 of receivers.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import rotation_x, rotation_y, rotation_z
from pipeline.maths.sonar.crossed_arrays import tilt_in_mbes

Array = NDArray[np.float64]
P_MBES = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # starboard, forward, up
ONE_HEAD = -1
PARTS = ("P", "C", "S")  # of a transmitter, in the order of their numbers
HEADS = frozenset({1002, 2000, *range(3000, 3009), 3020})  # models of one head of both arrays; S2: of another head
LEAST_ALONG = 0.9  # of the transmitter's axis along the receiver's y: else they are no crossed arrays
INSIDE: dict[tuple[int, bool], dict[str, float]] = {  # [m], by model, and whether it is the portable head
    (2040, False): {
        "IPY": -0.0554, "IPZ": -0.012, "ICY": 0.0131, "ICZ": -0.006, "ISY": 0.0554, "ISZ": -0.012,
        "IRX": 0.011, "IRZ": -0.006,
    },
    (2040, True): {
        "IPX": 0.002, "IPY": -0.10421, "IPZ": -0.01494, "ICX": 0.002, "ICZ": -0.006,
        "ISX": 0.002, "ISY": 0.10421, "ISZ": -0.01494, "IRX": 0.204, "IRZ": -0.0315,
    },
}  # fmt: skip
NEAR = 3.0  # times the transmitter's distance: no shorter path is possible
ROUNDS = 4  # of the iteration: the error falls by (distance of the arrays / range)² with each
NUMBER = re.compile(r"[-+]?([0-9]{1,6}(\.[0-9]{0,15})?|\.[0-9]{1,15})")
SIX = "XYZRPH"  # what is told of an array
PLACED = re.compile(rf"[{SIX}]|I[PCSR]?[XYZ]")


@dataclass(frozen=True)
class Arrays:
    """A transmitter as its receiver's frame ``mbes`` has it: its own forward axis, and its centre and the parts of it
    from its centre [m], by number."""

    axis: Array
    centre_m: Array
    parts_m: Mapping[int, Array] = field(default_factory=dict)

    def of_part(self, part: int, centre_m: Sequence[float] | None) -> Array:
        """Rows (3, 3): the axis, where the part is and where the centre is; ``centre_m``: as session.yaml gives it."""
        centre = self.centre_m if centre_m is None else np.array(centre_m)
        return np.array([self.axis, centre + self.parts_m.get(part, np.zeros(3)), centre])


SAME = Arrays(np.array([0.0, 1.0, 0.0]), np.zeros(3))  # nothing is known, or nothing to be known


@dataclass(frozen=True)
class Fan:
    """Soundings (n,), angles starboard + and the sectors' own tilts; their transmitters' axes, and places of the parts
    that sent and of the transmitter's centre (n, 3)."""

    angle_rad: Array
    tilt_rad: Array
    axis: Array
    part_m: Array
    centre_m: Array
    two_way_time_s: Array
    sound_speed_m_s: Array

    def in_mbes(self, projector_offset_m: Sequence[float] | None) -> tuple[Array, Array, Array]:
        """Angles, tilts and two-way times as one head in one place would have told them.

        That place is M, starboard and up the receiver's centre, forward the transmitter's. From there the part that
        sent lies at t and the receiver at q, and a target at x = r (s, p, -c) is where beam and fan meet on the path:

            x_1 = |x - q| sin θ,   (x - t) · axis = |x - t| sin τ,   |x - t| + |x - q| = L = speed · time,

        by iteration from the parallel fan. Told are arcsin s, arcsin p and 2 r / speed; where session.yaml gives
        ``projector_offset_m`` o, (|x| + |x - o|) / speed, from which the range is then taken. NaN is the time of a
        path that is too short for it; 0 stays 0, which is no detection.
        """
        if not self.part_m.any() and not self.centre_m.any():
            return self.angle_rad, tilt_in_mbes(self.angle_rad, self.tilt_rad, self.axis), self.two_way_time_s
        t, q = self.part_m.copy(), np.zeros_like(self.part_m)
        t[:, 1] -= self.centre_m[:, 1]
        q[:, 1] = -self.centre_m[:, 1]
        path = self.two_way_time_s * self.sound_speed_m_s
        side = np.where(np.abs(self.angle_rad) > np.pi / 2, 1.0, -1.0)
        r, s = path / 2, np.sin(self.angle_rad)
        p = np.sin(tilt_in_mbes(self.angle_rad, self.tilt_rad, self.axis))
        for _ in range(ROUNDS):
            x = r[:, None] * np.column_stack([s, p, side * np.sqrt(np.maximum(1 - s**2 - p**2, 0.0))])
            sent, heard = np.linalg.norm(x - t, axis=1), np.linalg.norm(x - q, axis=1)
            angle = _on_side(np.arcsin((x - t)[:, 0] / sent), side)
            along = sent * np.sin(tilt_in_mbes(angle, self.tilt_rad, self.axis)) + t[:, 1]
            s, p = heard * np.sin(self.angle_rad) / r, along / r
            r = r + (path - sent - heard) / 2
        from_m = np.array(projector_offset_m or (0.0, 0.0, 0.0))
        told = (r + np.linalg.norm(x - from_m, axis=1)) / self.sound_speed_m_s
        told[path < NEAR * (np.linalg.norm(t, axis=1) + np.linalg.norm(q, axis=1))] = np.nan
        heard_s = np.where(self.two_way_time_s == 0, 0.0, told)
        found = np.isfinite(heard_s) & (heard_s > 0)
        return (
            np.where(found, _on_side(np.arcsin(s), side), self.angle_rad),
            np.where(found, np.arcsin(p), self.tilt_rad),
            heard_s,
        )


def _on_side(angle_rad: Array, side: Array) -> Array:
    """Angles of beams below (-1) or above (1) the array's plane, from those below."""
    return np.where(side > 0, np.copysign(np.pi, angle_rad) - angle_rad, angle_rad)


def of_kmall(text: str) -> dict[tuple[int, int], Arrays]:
    """Those that #IIP tells, by the numbers of transmitter and receiver from 0; of one head (ONE_HEAD, number)."""
    given = {name: _numbers(values) for name, values in re.findall(r"TRAI_((?:TX|RX|HD)\d):([^,]*)", text)}
    told = {name: numbers for name, numbers in given.items() if numbers.keys() >= set(SIX)}
    found = {}
    for sender, tx in told.items():
        for receiver, rx in told.items():
            head = sender == receiver and sender.startswith("HD")
            if not (head or (sender.startswith("TX") and receiver.startswith("RX"))):
                continue
            crossed = _crossed(tx, rx, _place(rx, "IR" if head else "I"))
            if crossed is not None:
                found[ONE_HEAD if head else int(sender[2]) - 1, int(receiver[2]) - 1] = crossed
    return found


def _numbers(values: str) -> dict[str, float]:
    """Nothing where one of them that is needed cannot be read: it is not 0."""
    pairs = [(key.strip(), value.strip()) for key, _, value in (pair.partition("=") for pair in values.split(";"))]
    if any(PLACED.fullmatch(key) and not NUMBER.fullmatch(value) for key, value in pairs):
        return {}
    return {key: float(value) for key, value in pairs if NUMBER.fullmatch(value)}


@lru_cache(maxsize=16)  # asked for with each ping
def of_all(text: str, serial: int, model: int) -> Arrays | None:
    """Those of the receiver of this serial number; None where the installation does not tell.

    STC is 0 for one transmitter and one receiver, 1, 2 and 5 for heads of both arrays, 3 for one transmitter and two
    receivers, whose serial numbers are then R1S and R2S; older sonars do not say it (HEADS). Where the parts of an
    array lie is told by .kmall files of the same sonars alone: of the EM 2040, whose parts send different sectors.
    """
    pairs = (pair.partition("=") for pair in text.split(","))
    told = {key.strip("\0 \r\n"): float(value) for key, _, value in pairs if NUMBER.fullmatch(value.strip())}
    system = told.get("STC", 1.0 if "S2X" not in told or model in HEADS else 0.0)
    if "S1X" not in told or system not in (0, 1, 2, 3, 5):
        return None
    inside = INSIDE.get((model, system == 5), {}) if system in (0, 3, 5) else {}
    if system in (1, 2, 5):
        return _crossed(inside, inside, _place(inside, "IR"))
    serials = [number for number in (2, 3) if told.get(f"R{number - 1}S") == serial] if system == 3 else [2]
    if len(serials) != 1 or any(f"S{number}{axis}" not in told for number in (1, serials[0]) for axis in SIX):
        return None
    tx, rx = ({axis: told[f"S{number}{axis}"] for axis in SIX} for number in (1, serials[0]))
    return _crossed(tx | inside, rx, _place(inside, "IR"))


def _place(told: Mapping[str, float], name: str) -> Array:
    return np.array([told.get(f"{name}{axis}", 0.0) for axis in "XYZ"])


def _crossed(tx: Mapping[str, float], rx: Mapping[str, float], inside_m: Array) -> Arrays | None:
    """``inside_m``: the receiver's acoustic centre from its X, Y, Z, in its own axes."""
    R_mbes_from_vessel = P_MBES @ _turned(rx).T
    R_mbes_from_tx = R_mbes_from_vessel @ _turned(tx)
    centre = R_mbes_from_vessel @ (_place(tx, "") - _place(rx, ""))
    parts = {number: R_mbes_from_tx @ _place(tx, f"I{part}") for number, part in enumerate(PARTS)}
    axis = R_mbes_from_tx[:, 0]
    return Arrays(axis, centre - P_MBES @ inside_m, parts) if abs(axis[1]) >= LEAST_ALONG else None


def _turned(array: Mapping[str, float]) -> Array:
    roll, pitch, heading = (np.radians(array.get(axis, 0.0)) for axis in "RPH")
    return rotation_z(heading) @ rotation_y(pitch) @ rotation_x(roll)
