"""Position and angles of Kongsberg's transmitter relative to its receiver, from the installation in .kmall and .all.

Kongsberg's axes are forward, starboard, down. An array with the installation angles R, P, H [degrees] is turned by
Rz(H) Ry(P) Rx(R). A transmitter with H near 180 degrees is mounted the other way round.

An installation is a text of entries KEY:VALUE or KEY=VALUE, separated by commas. In .kmall TRAI_TX1 and TRAI_RX1, or
TRAI_HD1 for a head with both arrays, have X, Y, Z [m], R, P, H. They also have the positions of the acoustic centres in
the array's axes: IPX, IPY, IPZ (port part of the transmitter), ICX and so on (centre part), ISX (starboard part), IX
(receiver), IRX (receiver of a head). In .all S1X to S1H are those of the transmitter or head, S2X and S3X those of
receivers.
"""

import re
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from pipeline.maths.geometry.rotations import rotation_x, rotation_y, rotation_z
from pipeline.readers.kongsberg_arrays import Array, Transmitter

R_MBES_FROM_ARRAY = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # starboard, forward, up
SINGLE_HEAD = -1  # transmitter number of a head with both arrays
PARTS = ("P", "C", "S")  # port, centre and starboard part of a transmitter, in the order of their numbers
# models with both arrays in one head; S2 belongs to a second head
SINGLE_HEAD_MODELS = frozenset({1002, 2000, *range(3000, 3009), 3020})
MIN_ALIGNMENT = 0.9  # least component of the transmitter's axis along y of mbes; with less the arrays are not crossed
INNER_OFFSETS_M: dict[tuple[int, bool], dict[str, float]] = {  # [m], by model, and true for the portable head
    (2040, False): {
        "IPY": -0.0554, "IPZ": -0.012, "ICY": 0.0131, "ICZ": -0.006, "ISY": 0.0554, "ISZ": -0.012,
        "IRX": 0.011, "IRZ": -0.006,
    },
    (2040, True): {
        "IPX": 0.002, "IPY": -0.10421, "IPZ": -0.01494, "ICX": 0.002, "ICZ": -0.006,
        "ISX": 0.002, "ISY": 0.10421, "ISZ": -0.01494, "IRX": 0.204, "IRZ": -0.0315,
    },
}  # fmt: skip
_NUMBER = re.compile(r"[-+]?([0-9]{1,6}(\.[0-9]{0,15})?|\.[0-9]{1,15})")
PLACEMENT = "XYZRPH"  # keys of an array's position and angles
_PLACEMENT_KEY = re.compile(rf"[{PLACEMENT}]|I[PCSR]?[XYZ]")


def transmitters_of_kmall(text: str) -> dict[tuple[int, int], Transmitter]:
    """Return the transmitters that #IIP describes, by the numbers of transmitter and receiver, both from 0.

    A head with both arrays has the key (SINGLE_HEAD, its number).
    """
    entries = {name: _numbers(values) for name, values in re.findall(r"TRAI_((?:TX|RX|HD)\d):([^,]*)", text)}
    arrays = {name: numbers for name, numbers in entries.items() if numbers.keys() >= set(PLACEMENT)}
    transmitters = {}
    for sender, tx in arrays.items():
        for receiver, rx in arrays.items():
            is_head = sender == receiver and sender.startswith("HD")
            if not (is_head or (sender.startswith("TX") and receiver.startswith("RX"))):
                continue
            transmitter = _transmitter(tx, rx, _position(rx, "IR" if is_head else "I"))
            if transmitter is not None:
                transmitters[SINGLE_HEAD if is_head else int(sender[2]) - 1, int(receiver[2]) - 1] = transmitter
    return transmitters


def _numbers(values: str) -> dict[str, float]:
    """Return an array's numbers by key; empty if a needed one cannot be read, because it must not count as 0."""
    pairs = [(key.strip(), value.strip()) for key, _, value in (pair.partition("=") for pair in values.split(";"))]
    if any(_PLACEMENT_KEY.fullmatch(key) and not _NUMBER.fullmatch(value) for key, value in pairs):
        return {}
    return {key: float(value) for key, value in pairs if _NUMBER.fullmatch(value)}


@lru_cache(maxsize=16)  # called for each ping
def transmitter_of_all(text: str, serial: int, model: int) -> Transmitter | None:
    """Return the transmitter of a receiver in a .all file; None if the installation does not describe it.

    The system type STC is 0 for one transmitter and one receiver, 1, 2 or 5 for heads with both arrays, and 3 for one
    transmitter and two receivers with the serial numbers R1S and R2S. Older sonars do not write STC; then the key S2X
    and the model decide (SINGLE_HEAD_MODELS). The parts of the EM 2040's transmitter send different sectors. .kmall
    files hold the positions of these parts, but .all files do not; for them INNER_OFFSETS_M has the positions.

    Parameters
    ----------
    text
        The installation.
    serial
        Serial number of the receiver.
    model
        The sonar's model number.
    """
    pairs = (pair.partition("=") for pair in text.split(","))
    values = {key.strip("\0 \r\n"): float(value) for key, _, value in pairs if _NUMBER.fullmatch(value.strip())}
    system = values.get("STC", 1.0 if "S2X" not in values or model in SINGLE_HEAD_MODELS else 0.0)
    if "S1X" not in values or system not in (0, 1, 2, 3, 5):
        return None
    offsets_m = INNER_OFFSETS_M.get((model, system == 5), {}) if system in (0, 3, 5) else {}
    if system in (1, 2, 5):
        return _transmitter(offsets_m, offsets_m, _position(offsets_m, "IR"))
    arrays = [number for number in (2, 3) if values.get(f"R{number - 1}S") == serial] if system == 3 else [2]
    if len(arrays) != 1 or any(f"S{number}{key}" not in values for number in (1, arrays[0]) for key in PLACEMENT):
        return None
    tx, rx = ({key: values[f"S{number}{key}"] for key in PLACEMENT} for number in (1, arrays[0]))
    return _transmitter(tx | offsets_m, rx, _position(offsets_m, "IR"))


def _position(values: Mapping[str, float], prefix: str) -> Array:
    return np.array([values.get(f"{prefix}{axis}", 0.0) for axis in "XYZ"])


def _transmitter(tx: Mapping[str, float], rx: Mapping[str, float], acoustic_centre_m: Array) -> Transmitter | None:
    """Return a transmitter in its receiver's frame; None if the arrays are not crossed.

    ``acoustic_centre_m`` is the position of the receiver's acoustic centre from its X, Y, Z, in the receiver's axes.
    """
    R_mbes_from_vessel = R_MBES_FROM_ARRAY @ _rotation(rx).T
    R_mbes_from_tx = R_mbes_from_vessel @ _rotation(tx)
    centre = R_mbes_from_vessel @ (_position(tx, "") - _position(rx, ""))
    parts = {number: R_mbes_from_tx @ _position(tx, f"I{part}") for number, part in enumerate(PARTS)}
    axis = R_mbes_from_tx[:, 0]
    if not abs(axis[1]) >= MIN_ALIGNMENT:
        return None
    return Transmitter(axis, centre - R_MBES_FROM_ARRAY @ acoustic_centre_m, parts)


def _rotation(array: Mapping[str, float]) -> Array:
    """Return R_vessel_from_array."""
    roll, pitch, heading = (np.radians(array.get(key, 0.0)) for key in "RPH")
    return rotation_z(heading) @ rotation_y(pitch) @ rotation_x(roll)
