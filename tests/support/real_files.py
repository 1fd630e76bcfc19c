"""Settings of real files, read as a session would."""

from typing import Any

from pipeline.config.instruments import Sensor
from pipeline.config.mount import Mount
from pipeline.config.session import Ins, Laser, Mbes
from tests.support.roots import ROOT

DEFAULT = ROOT.parent / "shared" / "data"


MOUNT = Mount(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, x_m=0.0, y_m=0.0, z_m=0.0)


def settings_of(sensor: Sensor, name: str, kind: Any, **more: Any) -> Ins | Laser | Mbes:
    if sensor == "ins":
        return Ins(files=[name], format=kind, **more)
    if sensor == "laser":
        return Laser(files=[name], format=kind, mount=MOUNT, **more)
    return Mbes(files=[name], format=kind, mount=MOUNT, **more)
