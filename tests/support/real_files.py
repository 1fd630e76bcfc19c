"""Real files by name, their settings as a session would have them, and errors in one line."""

from typing import Any

import pytest

from pipeline.config.instruments import Sensor
from pipeline.config.mount import Mount
from pipeline.config.session import Ins, Laser, Mbes
from tests.support.roots import ROOT

DEFAULT = ROOT.parent / "shared" / "data"
XTF = "mbes/r2sonic2026_qinsy.xtf"
PPP, PPP_ASCII = "ins/propak6-ins-ppp_payload.gps", "ins/propak6-ins-ppp_INSPVAXA.asc"
ATLANS = "ins/sbet_ATLANS-20181023.out"
INS = ("t_ns", "latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")
HE = "mbes/kongsberg/all_he_-3092155654265012286.all"
TURBEAMS = "mbes/kongsberg/all_turbeams_6641182978793103390.all"
GSF = "mbes/GSF3_08_test_file.gsf"
KMALL = "mbes/kongsberg_OS03_4033476991022010987.kmall"
BUNNY, MOVED = "laser/bunnyInt32.e57", "laser/translationWithoutRotation.e57"
MOUNT = Mount(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, x_m=0.0, y_m=0.0, z_m=0.0)


def settings_of(sensor: Sensor, name: str, kind: Any, **more: Any) -> Ins | Laser | Mbes:
    if sensor == "ins":
        return Ins(files=[name], format=kind, **more)
    if sensor == "laser":
        return Laser(files=[name], format=kind, mount=MOUNT, **more)
    return Mbes(files=[name], format=kind, mount=MOUNT, **more)


def one_line(error: pytest.ExceptionInfo[Any], *words: str) -> None:
    message = str(error.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message
