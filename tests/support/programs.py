"""What other programs make of the numbers that they are given: readers of their forms, apart from pipeline/exports.

Each reader parses a form and returns rotation and position in axes starboard, forward, up. Rotations are built here
from what the program's documents say that an angle does ("the bow goes to starboard"), or from the elements in its
source.
"""

import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from math import cos, radians, sin

import numpy as np
import yaml

Array = np.ndarray
Read = tuple[Array, Array]
STARBOARD, FORWARD, UP = np.eye(3)


def moving(start: Array, end: Array, angle_deg: float) -> Array:
    """The rotation by which the direction ``start`` goes toward ``end``, at a right angle to it."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    across = np.outer(start, start) + np.outer(end, end)
    return np.eye(3) + (c - 1) * across + s * (np.outer(end, start) - np.outer(start, end))


def sfu_rotation(order: str, roll: float, pitch: float, yaw: float) -> Array:
    """Roll: starboard goes down; pitch: the bow goes up; yaw: the bow goes to port. Leftmost is outermost."""
    turns = {
        "R": moving(STARBOARD, -UP, roll),
        "P": moving(FORWARD, UP, pitch),
        "Y": moving(FORWARD, -STARBOARD, yaw),
    }
    first, second, third = (turns[letter] for letter in order)
    return np.asarray(first @ second @ third)


def frd(roll: float, pitch: float, heading: float) -> Array:
    """Elements as in mb_platform_math_rph2rot (MB-System 59becf9), which build_rot_mat of Kluster (b6667cb) equals."""
    sr, sp, sh = (sin(radians(angle)) for angle in (roll, pitch, heading))
    cr, cp, ch = (cos(radians(angle)) for angle in (roll, pitch, heading))
    return np.array(
        [
            [ch * cp, -sh * cr + ch * sp * sr, sh * sr + ch * sp * cr],
            [sh * cp, ch * cr + sh * sp * sr, -ch * sr + sh * sp * cr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def from_frd(R: Array, position: Array) -> Read:
    """Forward, starboard, down into starboard, forward, up: the first two exchanged, the third turned round."""
    swapped = R[np.ix_([1, 0, 2], [1, 0, 2])] * np.outer([1, 1, -1], [1, 1, -1])
    return swapped, np.array([position[1], position[0], -position[2]])


def by_frd(x: float, y: float, z: float, roll: float, pitch: float, heading: float) -> Read:
    return from_frd(frd(roll, pitch, heading), np.array([x, y, z]))


def fields(text: str) -> dict[str, float]:
    """Numbers of a sheet by the field's name."""
    rows = re.findall(r"^  ([^(:\n]*?(?: \([XYZRPH]\))?) \([^:\n]*\): +(-?[0-9.]+) ", text, re.MULTILINE)
    assert len(rows) == len({name for name, _ in rows})
    return {name: float(value) for name, value in rows}


def qps(text: str, _: str) -> Read:
    """x' = H · P · R · x; heading to starboard, bow up, heeling to starboard; X starboard, Y bow, Z up (Q1, Q2, Q4)."""
    f = fields(text)
    heading, pitch = moving(FORWARD, STARBOARD, f["Heading"]), moving(FORWARD, UP, f["Pitch"])
    return heading @ pitch @ moving(STARBOARD, -UP, f["Roll"]), np.array([f["X"], f["Y"], f["Z"]])


def posmv(text: str, _: str) -> Read:
    """Turns about z, once turned y, twice turned x, in forward, starboard, down (P1, P2)."""
    f = fields(text)
    x, y, z = np.eye(3)
    about_z, about_y = moving(x, y, f["Angle Z"]), moving(z, x, f["Angle Y"])
    R = about_z @ about_y @ moving(y, z, f["Angle X"])
    return from_frd(R, np.array([f[f"Lever arm {axis}"] for axis in "XYZ"]))


def caris(text: str, order: str) -> Read:
    """By words: pitch bow up, roll starboard down, yaw clockwise; X starboard, Y bow, Z down (C1)."""
    f = fields(text)
    return sfu_rotation(order, f["Roll"], f["Pitch"], -f["Yaw"]), np.array([f["X"], f["Y"], -f["Z"]])


def caris_hvf(text: str, order: str) -> Read:
    root = ET.fromstring(text)
    paths = ("SVPSensor/TimeStamp", "DepthSensor/TimeStamp/TransducerEntries/Transducer")
    offsets, angles = [], []
    for path in paths:
        (of,) = root.findall(f"{path}/Offsets")
        (turn,) = root.findall(f"{path}/MountAngle")
        offsets.append([float(of.attrib[axis]) for axis in "XYZ"])
        angles.append(np.array([float(turn.attrib[name]) for name in ("Roll", "Pitch", "Azimuth")]))
    assert offsets[0] == offsets[1]
    assert not angles[0].any() or not angles[1].any()
    roll, pitch, yaw = angles[0] + angles[1]
    x, y, z = offsets[0]
    return sfu_rotation(order, roll, pitch, -yaw), np.array([x, y, -z])


def as_typed_in(text: str, names: tuple[str, ...], numbers: tuple[float, ...]) -> None:
    """The fields that a person types in are the numbers of the line, to the four decimals that they show."""
    typed = fields(text)
    assert set(typed) == set(names)
    np.testing.assert_allclose([typed[name] for name in names], numbers, atol=0.0000501)


def hypack(text: str, order: str) -> Read:
    """n1 … n7 as mbsys_hysweep.h of MB-System names them; vertical is down from the waterline."""
    (line,) = re.findall(r"^OF2 1 3 (.*)$", text, re.MULTILINE)
    starboard, forward, vertical, yaw, port_up, bow_up, _ = map(float, line.split())
    names = ("Starboard", "Forward", "Vertical", "Yaw", "Roll", "Pitch")
    as_typed_in(text, names, (starboard, forward, vertical, yaw, port_up, bow_up))
    R = sfu_rotation(order, port_up, bow_up, -yaw)
    return R, np.array([starboard, forward, -vertical])


def kluster(text: str, _: str) -> Read:
    ((_, block),) = json.loads(text).items()
    times = {time for entry in block.values() for time in entry}
    assert times == {"1778572803"}  # 2026-05-12 08:00:03 UTC
    of = {key: float(*entry.values()) for key, entry in block.items()}
    assert [of[f"tx_{k}"] for k in "rph"] == [of[f"rx_{k}"] for k in "rph"]
    return by_frd(*(of[f"rx_{key}"] for key in "xyzrph"))


def kongsberg(text: str, _: str) -> Read:
    """#IIP's group of the receiver; the order is that of Kluster's reader."""
    ((group,)) = re.findall(r"TRAI_RX1:([^,]*),", text)
    of = dict(part.split("=") for part in group.split(";"))
    flat = dict(re.findall(r"S2([XYZRPH])=([^,]*),", text))
    assert flat == {key: of[key] for key in "XYZRPH"}
    numbers = tuple(float(of[key]) for key in "XYZRPH")
    names = ("Forward (X)", "Starboard (Y)", "Downward (Z)", "Roll (R)", "Pitch (P)", "Heading (H)")
    as_typed_in(text, names, numbers)
    assert 0 <= numbers[5] < 360
    return by_frd(*numbers)


def platform_offset(text: str, sensor: int, place: int) -> Read:
    """One offset of a platform file: starboard, forward, up; heading, roll, pitch."""
    lines = [line.split("##")[0].split() for line in text.splitlines()]
    words = [str(sensor), str(place)]
    (position,) = [line[3:] for line in lines if line[:3] == ["OFFSET_POSITION", *words]]
    (attitude,) = [line[3:] for line in lines if line[:3] == ["OFFSET_ATTITUDE", *words]]
    heading, roll, pitch = map(float, attitude)
    R, _zero = from_frd(frd(roll, pitch, heading), np.zeros(3))
    return R, np.array(position, dtype=float)


def mbsystem(text: str, _: str) -> Read:
    return platform_offset(text, 1, 1)


def novatel(text: str, _: str) -> Read:
    """About Z, X, Y, right-handed; x starboard, y forward, z up (N1)."""
    words = {line.split()[0]: line.split() for line in text.splitlines() if not line.startswith("#")}
    x, y, z = map(float, words["SETINSROTATION"][2:5])
    about_z, about_x = moving(STARBOARD, FORWARD, z), moving(FORWARD, UP, x)
    R = about_z @ about_x @ moving(UP, STARBOARD, y)
    assert words["SETINSTRANSLATION"][8] == "VEHICLE"
    return R, np.array(words["SETINSTRANSLATION"][2:5], dtype=float)


def ros(text: str, _: str) -> Read:
    """rpy about the fixed x (forward), then y (left), then z (up), rad."""
    origin = ET.fromstring(text).find("joint/origin")
    assert origin is not None
    roll, pitch, yaw = np.degrees([float(word) for word in origin.get("rpy", "").split()])
    left = -STARBOARD
    about_x, about_y, about_z = moving(left, UP, roll), moving(UP, FORWARD, pitch), moving(FORWARD, left, yaw)
    forward, to_left, up = (float(word) for word in origin.get("xyz", "").split())
    R = about_z @ about_y @ about_x
    found = re.search(r"translation (\S+ \S+ \S+), quaternion x y z w (\S+ \S+ \S+ \S+)\.$", text, re.MULTILINE)
    assert found is not None
    assert found[1] == origin.get("xyz")
    x, y, z, w = map(float, found[2].split())
    of_static_transform = by_quaternion(w, x, y, z)  # on forward, left, up
    from_flu = np.column_stack([FORWARD, left, UP])
    np.testing.assert_allclose(from_flu @ of_static_transform @ from_flu.T, R, atol=1e-11)
    return R, np.array([-to_left, forward, up])


def pdal(text: str, _: str) -> Read:
    """Rows of scan2imu: forward, starboard, down of the IMU; columns: the scanner's own axes."""
    (stage,) = json.loads(text)["pipeline"]
    assert (stage["type"], stage["coordinate_system"]) == ("filters.georeference", "NED")
    matrix = np.array(stage["scan2imu"].split(), dtype=float).reshape(4, 4)
    rows = np.array([matrix[1], matrix[0], -matrix[2]])
    return rows[:, :3], rows[:, 3]


def mbes_lib(text: str, _: str) -> Read:
    (line,) = [line for line in text.splitlines() if not line.startswith("#")]
    words = line.split()
    of = {key: float(words[words.index(f"-{key}") + 1]) for key in "xyzrph"}
    return by_frd(*(of[key] for key in "xyzrph"))


def xsf(text: str, _: str) -> Read:
    """byte enum transducer_type_t {receive_only = 0, transmit_only = 1, monostatic = 3} (X1)."""
    platform = json.loads(text)["Platform"]
    assert sorted(platform["transducer_function"]) == [0, 1]
    place = platform["transducer_function"].index(0)
    names = (*(f"transducer_offset_{axis}" for axis in "xyz"), *(f"transducer_rotation_{axis}" for axis in "xyz"))
    return by_frd(*(platform[name][place] for name in names))


def by_quaternion(w: float, x: float, y: float, z: float) -> Array:
    """Each axis v turned by the quaternion: v + 2 w (q × v) + 2 q × (q × v)."""
    q = np.array([x, y, z])
    return np.array([v + 2 * w * np.cross(q, v) + 2 * np.cross(q, np.cross(q, v)) for v in np.eye(3)]).T


def tree(content: dict[str, dict[str, list[float]]]) -> Read:
    vessel = content["vessel"]
    return by_quaternion(*vessel["quaternion_wxyz"]), np.array(vessel["position_m"])


def of_json(text: str, _: str) -> Read:
    return tree(json.loads(text))


def of_yaml(text: str, _: str) -> Read:
    return tree(yaml.safe_load(text))


def of_csv(text: str, _: str) -> Read:
    cells = dict(csv.reader(io.StringIO(text)))
    names = ("quaternion_wxyz", "position_m")
    return tree({"vessel": {name: [float(word) for word in cells[f"vessel.{name}"].split()] for name in names}})


READERS: dict[str, Callable[[str, str], Read]] = {
    "qinsy": qps, "qimera": qps, "kluster": kluster, "kongsberg": kongsberg, "posmv": posmv, "caris": caris,
    "caris-hvf": caris_hvf, "hypack": hypack, "mbsystem": mbsystem, "novatel": novatel, "ros": ros, "pdal": pdal,
    "mbes-lib": mbes_lib, "xsf": xsf, "json": of_json, "yaml": of_yaml, "csv": of_csv,
}  # fmt: skip
SHEETS = ("qinsy", "qimera", "posmv", "caris")  # for people: four decimals
