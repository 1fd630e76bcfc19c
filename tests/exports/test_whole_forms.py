"""Numbers of a form beside those that are read back: the transmitter, the INS, the mount on the body; real files."""

import csv
import io
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

from pipeline.errors import ConfigError
from pipeline.exports.mounting import VesselFrame
from pipeline.exports.registry import TARGETS
from pipeline.exports.target import Options
from pipeline.exports.writing import export_text, mount_in
from tests.support.mountings import FRAMES, in_vessel, mounted, mounting, random_mounts
from tests.support.programs import by_frd, by_quaternion, frd, platform_offset, sfu_rotation

OFFSET = (0.25, 0.05, -0.119)  # transmitter from receiver: starboard, forward, up of the head
TOLD = {"kluster": Options(serial="7")}
EM_2042 = """SYSTEM:EM 2042 - Single Tx single Rx,TRAI_TX1:N=5001;X=-0.512;Y=-0.055;Z=1.714;R=0.017;P=0.430;H=178.080;\
S=0.7;IPX=0.0000;IPY=-0.04887;IPZ=-0.01156,TRAI_RX1:N=5003;V=110-0062678;W=EM 2042-MRU-60_SV;X=-0.270;Y=0.055;Z=1.700;\
R=-0.017;P=-0.430;H=358.080;G=0.00;IX=-0.01000;IY=0.00000;IZ=-0.00600,POSI_1:X=0.000;Y=0.000;Z=0.000,
"""  # as in a file of the maker's sonar
DUAL = """<HIPSVesselConfig Version="2.0"><SVPSensor><TimeStamp value="2016-001 00:00:00"><DualHead value="Yes"/>
<Offsets X="-0.3" Y="4.76" Z="0" X2="0.4" Y2="4.77" Z2="0"/>
<MountAngle Pitch="1.07" Roll="24.23" Azimuth="358.96" Pitch2="1.07" Roll2="-23.23" Azimuth2="359.78"/></TimeStamp>
</SVPSensor><DepthSensor><TimeStamp value="2016-001 00:00:00"><TransducerEntries>
<Transducer Number="1" StartBeam="1"><Offsets X="-0.3" Y="4.76" Z="0"/>
<MountAngle Pitch="0" Roll="0" Azimuth="-7.5"/></Transducer>
</TransducerEntries></TimeStamp></DepthSensor></HIPSVesselConfig>
"""


def transmitter_of(name: str, text: str) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and place of the transmitter in starboard, forward, up, as the program finds them."""
    if name == "mbsystem":
        return platform_offset(text, 1, 0)
    if name == "kluster":
        ((_, block),) = json.loads(text).items()
        return by_frd(*(float(*block[f"tx_{key}"].values()) for key in "xyzrph"))
    if name == "kongsberg":
        (group,) = re.findall(r"TRAI_TX1:([^,]*),", text)
        of = dict(part.split("=") for part in group.split(";"))
        assert {key: of[key] for key in "XYZRPH"} == dict(re.findall(r"S1([XYZRPH])=([^,]*),", text))
        return by_frd(*(float(of[key]) for key in "XYZRPH"))
    platform = json.loads(text)["Platform"]
    place = platform["transducer_function"].index(1)  # transmit_only
    names = [f"transducer_{kind}_{axis}" for kind in ("offset", "rotation") for axis in "xyz"]
    return by_frd(*(platform[name][place] for name in names))


@pytest.mark.parametrize("name", ["kluster", "kongsberg", "mbsystem", "xsf"])
def test_the_transmitter_stands_where_it_is(name: str) -> None:
    target = TARGETS[name]
    for place, body in enumerate(random_mounts(40)):
        frame = FRAMES[place % len(FRAMES)]
        text = export_text(
            target, mounting(body, frame=frame, projector_offset_m=OFFSET), TOLD.get(name, Options())
        )  # fmt: skip
        true = in_vessel(body, frame)
        R, position = transmitter_of(name, text)
        np.testing.assert_allclose(R, true.R_body_from_sensor, atol=1e-9)
        apart = position - true.lever_arm_body_m
        np.testing.assert_allclose(true.R_body_from_sensor.T @ apart, OFFSET, atol=3e-9)


def test_the_ins_of_a_platform_file_takes_its_turn_back() -> None:
    """mb_platform_math_attitude_offset: the transpose of the source's rotation (the INS) times the sonar's."""
    for place, body in enumerate(random_mounts(40)):
        text = export_text(TARGETS["mbsystem"], mounting(body, frame=FRAMES[place % len(FRAMES)]), Options())
        (R_ins, ins), (R, position) = platform_offset(text, 0, 0), platform_offset(text, 1, 1)
        np.testing.assert_allclose(R_ins.T @ R, body.R_body_from_sensor, atol=1e-9)
        np.testing.assert_allclose(R_ins.T @ (position - ins), body.lever_arm_body_m, atol=3e-9)


@pytest.mark.parametrize("name", ["json", "yaml", "csv"])
def test_the_mount_on_the_body_stands_in_settings_matrix_and_quaternion(name: str) -> None:
    for place, body in enumerate(random_mounts(40)):
        text = export_text(TARGETS[name], mounting(body, frame=FRAMES[place % len(FRAMES)]), Options())
        if name == "csv":
            cells = dict(csv.reader(io.StringIO(text)))
            mount = {key: float(cells[f"mount.{key}"]) for key in ("roll_deg", "pitch_deg", "yaw_deg")}
            position, quaternion = (
                [float(word) for word in cells[key].split()] for key in ("position_m", "quaternion_wxyz")
            )
            matrix = [[float(word) for word in cells[f"R_body_from_mbes.{row}"].split()] for row in range(3)]
        else:
            content = json.loads(text) if name == "json" else yaml.safe_load(text)
            mount, position, quaternion = content["mount"], content["position_m"], content["quaternion_wxyz"]
            matrix = content["R_body_from_mbes"]
        of_settings = sfu_rotation("YPR", mount["roll_deg"], mount["pitch_deg"], mount["yaw_deg"])
        for R in (of_settings, np.array(matrix), by_quaternion(*quaternion)):
            np.testing.assert_allclose(R, body.R_body_from_sensor, atol=1e-12)
        np.testing.assert_allclose(position, body.lever_arm_body_m, atol=1e-12)


def test_pdal_puts_a_return_where_the_boat_has_it() -> None:
    """GeoreferenceFilter.cpp with NED: x and y of attitude · scan2imu · point exchanged, z turned round."""
    roll, pitch, azimuth = 4.1, -2.3, 213.0
    attitude = sfu_rotation("YPR", roll, pitch, -azimuth)
    for body in random_mounts(40):
        (stage,) = json.loads(export_text(TARGETS["pdal"], mounting(body, sensor="laser"), Options()))["pipeline"]
        scan2imu = np.array(stage["scan2imu"].split(), dtype=float).reshape(4, 4)
        point = np.array([3.0, -7.0, 11.0])
        north, east, down = frd(roll, pitch, azimuth) @ (scan2imu @ [*point, 1.0])[:3]
        true = attitude @ (body.R_body_from_sensor @ point + body.lever_arm_body_m)
        np.testing.assert_allclose([east, north, -down], true, atol=1e-9)


def test_a_real_installation_text_gives_its_receiver() -> None:
    found = mount_in(TARGETS["kongsberg"], EM_2042, "iip", None, Options())
    R, position = by_frd(-0.270, 0.055, 1.700, -0.017, -0.430, 358.080)
    np.testing.assert_allclose(found.R_body_from_sensor, R, atol=1e-12)
    np.testing.assert_allclose(found.lever_arm_body_m, position, atol=1e-12)
    aft, _ = by_frd(-0.512, -0.055, 1.714, 0.017, 0.430, 178.080)
    np.testing.assert_allclose(aft @ np.diag([-1.0, -1.0, 1.0]), R, atol=1e-9)  # its transmitter looks aft


def test_a_real_vessel_file_of_two_heads_is_refused() -> None:
    with pytest.raises(ConfigError, match="has two heads"):
        mount_in(TARGETS["caris-hvf"], DUAL, "SAMPLE.hvf", None, Options(order="YPR"))


def test_one_transducer_that_sends_and_receives_is_read() -> None:
    platform = {"transducer_function": [3], "transducer_offset_x": [0.2], "transducer_offset_y": [0.3]}
    platform |= {"transducer_offset_z": [2.01], "transducer_rotation_x": [-48.8], "transducer_rotation_y": [1.2]}
    text = json.dumps({"Platform": platform | {"transducer_rotation_z": [2.0]}})
    found = mount_in(TARGETS["xsf"], text, "platform.json", None, Options())
    np.testing.assert_allclose(found.R_body_from_sensor, sfu_rotation("YPR", -48.8, 1.2, -2.0), atol=1e-12)
    np.testing.assert_allclose(found.lever_arm_body_m, [0.3, 0.2, -2.01], atol=1e-12)


@pytest.mark.parametrize("yaw", [0.00004, 4e-10, 0.0])
def test_a_heading_that_rounds_to_360_is_0(yaw: float) -> None:
    text = export_text(TARGETS["kongsberg"], mounting(mounted(1.0, 0.0, yaw)), Options())
    assert "360.0" not in text
    (typed,) = re.findall(r"Heading \(H\) .*: +(\S+) °", text)
    assert typed == "0.0000"


def test_a_frame_beside_the_file_is_taken_where_it_states_none() -> None:
    body, frame = mounted(-48.8, 1.2, -2.0, 0.3, 0.2, -2.01), VesselFrame((0.5, 1.0, 2.0), (2.0, -3.0, 90.0))
    text = export_text(TARGETS["kluster"], mounting(body, frame=frame), Options(serial="7"))
    found = mount_in(TARGETS["kluster"], text, "kfc", frame, Options())
    np.testing.assert_allclose(found.R_body_from_sensor, body.R_body_from_sensor, atol=1e-9)
    other = mount_in(TARGETS["kluster"], text, "kfc", replace(frame, ins_turn_deg=(2.0, -3.0, 91.0)), Options())
    assert np.abs(other.R_body_from_sensor - body.R_body_from_sensor).max() > 0.01
