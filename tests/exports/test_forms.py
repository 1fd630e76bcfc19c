"""What a form says beside its numbers: marks of a rejected run, latency, uncertainties, certainty; other parsers."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import yaml
from KMALL import kmall

from pipeline.errors import ConfigError
from pipeline.exports.mounting import VesselFrame
from pipeline.exports.registry import TARGETS, list_text
from pipeline.exports.target import Options
from pipeline.exports.writing import export_text
from tests.support.mountings import ORIGIN, mounted, mounting
from tests.support.programs import READERS

BODY = mounted(-48.8, 1.2, -2.0, 0.30, 0.20, -2.01)
COVARIANCE = np.diag(np.r_[np.radians([0.01, 0.02, 0.03]), 0.001, 0.002, 0.003] ** 2)
TOLD = Options(order="YPR", serial="7", ins_height_m=0.9)


def options_of(name: str) -> Options:
    target = TARGETS[name]
    return Options(
        order="YPR" if target.convention.order is None else None,
        serial="7" if "serial" in target.uses else None,
        ins_height_m=0.9 if "ins_height" in target.uses else None,
    )


def text_of(name: str, **more: object) -> str:
    return export_text(TARGETS[name], mounting(BODY, **more), options_of(name))


@pytest.mark.parametrize("name", sorted(TARGETS))
def test_a_rejected_run_is_marked_or_refused(name: str) -> None:
    rejected = replace(ORIGIN, rejected=("roll is too uncertain --> <b>", "x & y"))
    if name == "kluster":
        with pytest.raises(ConfigError, match="has no place that says that the run was rejected"):
            text_of(name, origin=rejected)
        return
    text = text_of(name, origin=rejected)
    assert "REJECTED: this run was rejected. Do not survey with these values." in " ".join(text.split())
    assert "REJECTED" not in text_of(name)
    found = READERS[name](text, "YPR")  # and the form is still whole
    assert np.abs(found[0] - BODY.R_body_from_sensor).max() < 3e-6
    if name in ("json", "yaml"):
        assert yaml.safe_load(text)["rejected"] is True


@pytest.mark.parametrize("name", sorted(set(TARGETS) - {"kluster"}))
def test_each_form_says_how_sure_it_is_and_that_totals_replace(name: str) -> None:
    words = " ".join(text_of(name, covariance=COVARIANCE).split())
    convention = TARGETS[name].convention
    assert f"Certainty: {convention.certainty}" in words
    assert "These are totals: they replace what stands there. Do not add them" in words
    assert "one standard deviation (68 %)" in words
    assert convention.certainty in ("code", "official", "secondary")


def test_the_list_has_every_target_and_its_certainty() -> None:
    rows = {line.split()[0]: line for line in list_text().splitlines()[1:]}
    assert set(rows) == {*TARGETS, "las", "laz"}
    for name, target in TARGETS.items():
        assert target.convention.certainty in rows[name]
        assert ("order not stated" in rows[name]) == (name in ("caris", "caris-hvf", "hypack"))


def test_latency_has_the_programs_sign() -> None:
    """The sonar's times 12 ms late: Kluster looks attitude up at time + latency, so -0.012; PDAL adds too."""
    late = {"latency_s": 0.012}
    block = json.loads(text_of("kluster", **late))["7"]
    assert float(*block["latency"].values()) == -0.012
    (stage,) = json.loads(text_of("pdal", **late, sensor="laser"))["pipeline"]
    assert stage["time_offset"] == -0.012
    assert json.loads(text_of("json", **late))["latency_s"] == 0.012
    assert "0.012000 s late" in text_of("qinsy", **late)
    assert "Latency:" not in text_of("qinsy")


def test_klusters_waterline_and_patch_errors() -> None:
    """The water is 0.9 m below the INS, which is 0.5 m above the reference point: 0.4 m below that, + down."""
    frame = VesselFrame((0.0, 0.0, 0.5))
    block = json.loads(text_of("kluster", covariance=COVARIANCE, frame=frame))["7"]
    assert float(*block["waterline"].values()) == pytest.approx(0.4)
    names = ("pitch_patch_error", "roll_patch_error", "heading_patch_error")
    found = [float(*block[name].values()) for name in names]
    assert found == pytest.approx([0.01, 0.02, 0.03], rel=0.05)  # nearly about body x, y, z


@pytest.mark.parametrize("name", ["qinsy", "posmv", "caris"])
def test_sigmas_of_a_turned_vessel(name: str) -> None:
    """The INS turned by 90° to starboard: the body's x is the vessel's -y, so sigmas of x and y change places.

    Roll and pitch are about axes that the heading of -90° has turned along with the body, so theirs stay.
    """
    frame = VesselFrame(ins_turn_deg=(0.0, 0.0, -90.0))
    text = export_text(
        TARGETS[name], mounting(mounted(0.0, 0.0, 0.0), frame=frame, covariance=COVARIANCE),
        replace(options_of(name), order="YPR") if TARGETS[name].convention.order is None else options_of(name),
    )  # fmt: skip
    rows = {line.split(" (")[0].strip(): float(line.split("sigma ")[1].split()[0]) for line in text.splitlines()
            if line.startswith("  ") and "sigma " in line}  # fmt: skip
    starboard, forward = ("Lever arm Y", "Lever arm X") if name == "posmv" else ("X", "Y")
    roll, pitch = ("Angle X", "Angle Y") if name == "posmv" else ("Roll", "Pitch")
    assert (rows[starboard], rows[forward]) == (0.002, 0.001)
    assert (rows[pitch], rows[roll]) == (0.01, 0.02)


def test_pykmall_reads_the_installation_text() -> None:
    lines = [line for line in text_of("kongsberg").splitlines() if line.startswith("TRAI_")]
    found = kmall("").translate_installation_parameters_todict("\n".join(lines))
    for array in ("TRAI_TX1", "TRAI_RX1"):
        of = {key.removeprefix(array): float(value) for key, value in found.items() if key.startswith(array)}
        assert (of["_along_location"], of["_athwart_location"], of["_vertical_location"]) == (0.2, 0.3, 2.01)
        assert (of["_roll_angle"], of["_pitch_angle"], of["_heading_angle"]) == (-48.8, 1.2, 2.0)


def test_the_programs_own_code_makes_the_mount_of_the_numbers() -> None:
    """What two programs' own functions returned for the numbers of BODY's forms, roll -48.8, pitch 1.2, heading 2.0.

    mb_platform_math_rph2rot of MB-System (59becf9), compiled, and build_rot_mat of Kluster (b6667cb) agree. Axes
    are forward, starboard, down.
    """
    theirs = np.array(
        [
            [0.999171644096, -0.038735720614, -0.012472753653],
            [0.034891842666, 0.657738279353, 0.752437980959],
            [-0.020942419883, -0.752249891872, 0.658544998635],
        ]
    )
    exchange = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    np.testing.assert_allclose(exchange @ theirs @ exchange, BODY.R_body_from_sensor, atol=1e-11)
    block = json.loads(text_of("kluster"))["7"]
    assert [float(*block[f"rx_{key}"].values()) for key in "rph"] == [-48.8, 1.2, 2.0]
    assert "OFFSET_ATTITUDE  1 1  2.000000000 -48.800000000 1.200000000 ##" in text_of("mbsystem")


@pytest.mark.parametrize(("roll", "place"), [(4.9, "DepthSensor"), (-5.1, "SVPSensor")])
def test_hvf_has_the_angles_in_one_place_and_the_time_of_the_first_pass(roll: float, place: str) -> None:
    text = export_text(TARGETS["caris-hvf"], mounting(mounted(roll, 0.0, 0.0)), Options())
    root = ET.fromstring(text)
    holders = [sensor.tag for sensor in root if any(float(angle.attrib["Roll"]) for angle in sensor.iter("MountAngle"))]
    assert holders == [place]
    assert {stamp.get("value") for stamp in root.iter("TimeStamp")} == {"2026-132 08:00:03"}


def test_hypack_without_a_height_guesses_nothing() -> None:
    text = export_text(TARGETS["hypack"], mounting(BODY), Options(order="YPR"))
    assert "Vertical (down +):" in text
    assert "2.0100 m less the height of the INS above the water" in text
    assert not any(line.startswith("OF2") for line in text.splitlines())


@pytest.mark.parametrize("name", ["novatel", "pdal", "mbes-lib"])
def test_programs_that_count_from_the_ins_take_no_other_frame(name: str) -> None:
    for frame in (VesselFrame((0.0, 0.0, 0.1)), VesselFrame(ins_turn_deg=(0.0, 0.0, 90.0))):
        with pytest.raises(ConfigError, match="counts from the INS itself"):
            text_of(name, frame=frame)


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("qinsy", Options(serial="7"), "--serial: qinsy has no place for it"),
        ("kluster", Options(), "--serial: is needed"),
        ("kluster", Options(serial='7"'), '--serial 7": must be letters'),
        ("qinsy", Options(ins_height_m=1.0), "--ins-height: qinsy has no place"),
        ("hypack", Options(order="YPR", ins_height_m=float("nan")), "--ins-height nan: must be within"),
    ],
)
def test_options_that_cannot_be_are_refused(name: str, options: Options, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        export_text(TARGETS[name], mounting(BODY), options)


def test_qimeras_sheet_tells_the_transmitters_place_or_that_it_is_not_known() -> None:
    """Rz(yaw) of a level head: an offset forward goes to port for a bow to port."""
    level = mounted(0.0, 0.0, 30.0, 0.1, 0.2, -1.0)
    sheet = export_text(TARGETS["qimera"], mounting(level, projector_offset_m=(0.0, 0.2, 0.0)), Options())
    x, y = 0.1 - 0.2 * np.sin(np.radians(30.0)), 0.2 + 0.2 * np.cos(np.radians(30.0))
    assert f"Transmitter, m: X {x:.4f}, Y {y:.4f}, Z -1.0000. Receiver, m: X 0.1000, Y 0.2000, Z -1.0000." in sheet
    assert "--projector-offset" in export_text(TARGETS["qimera"], mounting(level), Options())


def test_qimeras_sheet_wants_the_ins_where_the_values_count_it() -> None:
    """With the INS apart from the reference point, its sensors at 0, 0, 0 would count its place twice."""
    own = text_of("qimera")
    assert "position and motion sensor stand at 0, 0, 0 there, without angles" in own
    for frame in (VesselFrame((0.0, 0.0, 0.4)), VesselFrame(ins_turn_deg=(0.0, 0.0, 5.0))):
        sheet = text_of("qimera", frame=frame)
        assert "0, 0, 0" not in sheet
        assert "motion sensor stand there as the INS does by --ins-point and --ins-turn" in sheet


def test_qimeras_sheet_takes_kongsbergs_lever_arm_for_neither_array() -> None:
    """It has x and z of the receiver, y of the transmitter: with the transmitter 0.2 m ahead the receiver is aft."""
    level = mounted(0.0, 0.0, 0.0, 0.1, 0.2, -1.0)
    apart = mounting(level, split=True, projector_offset_m=(0.05, 0.2, -0.1))
    sheet = export_text(TARGETS["qimera"], apart, Options())
    assert "Transmitter, m: X 0.1500, Y 0.2000, Z -1.1000. Receiver, m: X 0.1000, Y 0.0000, Z -1.0000." in sheet
    unknown = export_text(TARGETS["qimera"], mounting(level, split=True), Options())
    assert "the position above is of neither" in unknown
    assert "receiver's" not in unknown


@pytest.mark.parametrize("name", sorted(set(TARGETS) - {"kluster"}))
def test_a_form_tells_what_was_estimated_with_the_mount(name: str) -> None:
    """A mount found beside a latency is wrong without it."""
    words = " ".join(text_of(name, origin=replace(ORIGIN, free=("its latency is 12 ms more",))).split())
    assert "Estimated with the mount: its latency is 12 ms more. The values hold with that alone" in words
    assert "Estimated with the mount" not in text_of(name)


@pytest.mark.parametrize("name", sorted(set(TARGETS) - {"kluster"}))
def test_a_form_tells_which_run_it_is_of(name: str) -> None:
    words = " ".join(text_of(name, origin=replace(ORIGIN, digest="ab" * 32)).split())
    assert f"Verdict: accepted. First pass: {ORIGIN.start_utc}." in words
    assert f"SHA-256 of calibration.json: {'ab' * 32}" in words


@pytest.mark.parametrize("name", sorted(set(TARGETS) - {"kluster"}))
def test_a_form_tells_for_which_survey_the_values_are(name: str) -> None:
    words = " ".join(text_of(name, origin=replace(ORIGIN, purpose="Order 1a (IHO S-44) down to 12 m")).split())
    assert "Verdict: accepted for Order 1a (IHO S-44) down to 12 m. Do not use the values for other surveys." in words
