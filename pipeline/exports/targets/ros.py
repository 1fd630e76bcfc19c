"""ROS: a URDF of a fixed joint from the INS to the sensor.

REP 103: x forward, y left, z up, for parent and child alike; rpy in rad is about the parent's fixed x, y, z: R =
Rz(yaw) · Ry(pitch) · Rx(roll). With Q = [[0,1,0],[-1,0,0],[0,0,1]] the rotation is Q R Qᵀ, whose angles are our roll,
minus our pitch, our yaw.
"""

import numpy as np

from pipeline.errors import ConfigError
from pipeline.exports.convention import FLU, Convention
from pipeline.exports.explanation import explanation, heading
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of, written
from pipeline.exports.target import Options, Target
from pipeline.exports.xml_text import comment, root_of
from pipeline.maths.geometry.rotations import quaternion_from_rotation
from pipeline.mount import Mounted

DECIMALS = 12
ANGLES = ("roll", "pitch", "yaw")


def _write(target: Target, mounting: Mounting, options: Options) -> str:
    values = target.convention.numbers(mounting.vessel).by_role()
    xyz = " ".join(written(values[role], DECIMALS) for role in "xyz")
    rpy = " ".join(written(float(np.radians(values[role])), DECIMALS) for role in ANGLES)
    axes = np.array(target.convention.axes)
    w, x, y, z = quaternion_from_rotation(axes @ mounting.vessel.R_body_from_sensor @ axes.T)
    quaternion = " ".join(written(float(value), DECIMALS) for value in (x, y, z, w))
    child = "mbes" if mounting.sensor == "mbes" else "laser"
    parent = "ins" if mounting.frame.is_ins else "vessel"
    about = [
        *heading(target, mounting),
        *explanation(target, mounting, options),
        f"Links: {parent} and {child}, both x forward, y left, z up (REP 103); rpy in rad. A driver that publishes the "
        "sensor's "
        "own axes (x starboard, y forward, z up) needs a further joint.",
        f"Static transform, parent {parent}, child {child}: translation {xyz}, quaternion x y z w {quaternion}.",
        "Use the quaternion: the order of angles of static_transform_publisher has changed between versions.",
    ]
    return f"""<?xml version="1.0" encoding="UTF-8"?>
{comment(about)}
<robot name="boat">
  <link name="{parent}"/>
  <link name="{child}"/>
  <joint name="{child}_mount" type="fixed">
    <parent link="{parent}"/>
    <child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/>
  </joint>
</robot>
"""


def _read(target: Target, text: str, where: str, _: Options) -> Mounted:
    joints = [joint for joint in root_of(text, where).iter("joint") if joint.get("type") == "fixed"]
    if len(joints) != 1:
        raise ConfigError(f"{where}: has {len(joints)} fixed joints; leave the sensor's alone")
    origin = joints[0].find("origin")
    if origin is None:
        raise ConfigError(f"{where}: the joint has no origin; add it")
    values: dict[str, float] = {}
    for name, roles in (("xyz", ("x", "y", "z")), ("rpy", ANGLES)):
        words = origin.get(name, "").split()
        if len(words) != len(roles):
            raise ConfigError(f"{where}: origin {name} has {len(words)} numbers, not 3; correct it")
        values |= {role: number(word, f"origin {name}", where) for role, word in zip(roles, words, strict=True)}
    return target.convention.mounted(numbers_of(values | {role: float(np.degrees(values[role])) for role in ANGLES}))


TARGET = Target(
    name="ros",
    title="ROS URDF and tf2",
    writes="URDF, static transform",
    suffix=".urdf",
    convention=Convention(FLU, (1, -1, 1), "YPR", "official", "REP 103; the URDF specification of origin"),
    write=_write,
    read=_read,
)
