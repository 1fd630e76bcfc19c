"""Files to read a mount from: cut anywhere, with a field missing, with numbers that are none, with two heads."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipeline.errors import ConfigError
from pipeline.exports.registry import TARGETS
from pipeline.exports.target import Options
from pipeline.exports.writing import export_text, mount_in
from tests.support.mountings import mounted, mounting

BODY = mounted(-48.8125, 1.25, -2.0625, 0.3, 0.2, -2.01)


def options_of(name: str) -> Options:
    target = TARGETS[name]
    return Options(
        order="YPR" if target.convention.order is None else None,
        serial="7" if "serial" in target.uses else None,
        ins_height_m=0.9 if name == "hypack" else None,
    )


def text_of(name: str) -> str:
    return export_text(TARGETS[name], mounting(BODY), options_of(name))


def refused(name: str, text: str, said: str | None = None, **more: object) -> None:
    with pytest.raises(ConfigError, match=said):
        mount_in(TARGETS[name], text, "file", None, replace(options_of(name), **more))


@pytest.mark.parametrize("name", sorted(TARGETS))
def test_cut_anywhere_it_is_refused_or_the_same(name: str) -> None:
    """Every position near the end and in the lines with numbers; every seventh elsewhere."""
    text, options = text_of(name), options_of(name)
    whole = mount_in(TARGETS[name], text, "file", None, options)
    places = {*range(0, len(text), 7 if len(text) < 6000 else 29), *range(len(text) - 40, len(text))}
    for match in list(re.finditer(r"48\.8125|2\.0625", text))[:6]:
        places |= set(range(match.start(), match.end() + 2))
    for place in sorted(places):
        try:
            found = mount_in(TARGETS[name], text[:place], "file", None, options)
        except ConfigError as error:
            assert "\n" not in str(error)
            continue
        np.testing.assert_array_equal(found.R_body_from_sensor, whole.R_body_from_sensor, err_msg=text[:place][-60:])
        np.testing.assert_array_equal(found.lever_arm_body_m, whole.lever_arm_body_m)


@pytest.mark.parametrize("word", ["nan", "inf", "-Infinity", "1e999", "zwei", "true", "null", ""])
@pytest.mark.parametrize("name", sorted(set(TARGETS) - {"pdal"}))
def test_numbers_that_are_none(name: str, word: str) -> None:
    """In place of the roll, wherever it stands."""
    text = text_of(name)
    roll = {"ros": "-0.851938", "json": "-48.8125", "yaml": "-48.8125"}.get(name, "-48.8125")
    spoilt = re.sub(rf"{re.escape(roll)}\d*", word, text)
    assert spoilt != text
    refused(name, spoilt)


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("qinsy", "  Heading (", "  Course (", "Heading: is missing"),
        ("qinsy", "(qinsy)", "(qimera)", "is no sheet of poolcal export --to qinsy"),
        ("kluster", '"rx_r"', '"rx_port_r"', "rx_r: is missing"),
        ("kongsberg", "R=", "Q=", "R of the receiver is there 0 times"),
        ("mbsystem", "OFFSET_ATTITUDE  1", "OFFSET_ATTITUDE  4", "sensor 1 has 0 lines OFFSET_ATTITUDE"),
        ("novatel", "SETINSROTATION USER 1", "SETINSROTATION ANT1 1", "has no commands SETINSROTATION USER"),
        ("novatel", "VEHICLE", "IMUBODY", "is in frame IMUBODY"),
        ("caris-hvf", "<DualHead value=\"No\"/>", "<DualHead value=\"Yes\"/>", "has two heads"),
        ("caris-hvf", 'Azimuth="0.000000000"', 'Azimuth="7.5"', "both SVPSensor and DepthSensor"),
        ("caris-hvf", "HIPSVesselConfig", "Vessel", "begins with <Vessel>"),
        ("ros", "<origin", "<place", "the joint has no origin"),
        ("pdal", '"NED"', '"ENU"', "coordinate_system is 'ENU'"),
        ("pdal", '"scan2imu": "', '"scan2imu": "1 ', "has 17 numbers, not 16"),
        ("pdal", "-0.040", "-0.940", "is no rotation"),
        ("mbes-lib", " -b ", " -r 3 -b ", "-r is there 2 times"),
        ("xsf", "1,\n      0\n", "0,\n      0\n", "has 2 receivers"),
        ("xsf", "1,\n      0\n", "1,\n      1\n", "has 0 receivers"),
        ("json", '"version": 1', '"version": 2', "is no 'poolcal mount' of version 1"),
        ("json", '"sensor": "mbes"', '"sensor": "mbes", "sensor": "laser"', "a key is there twice"),
        ("yaml", "complete: true", "complete: false", "it was cut off"),
        ("csv", "vessel.mount.roll_deg", "vessel.mount.roll", "vessel.mount must have"),
    ],
)  # fmt: skip
def test_what_is_missing_or_twice_is_named(name: str, old: str, new: str, said: str) -> None:
    text = text_of(name)
    assert old in text
    refused(name, text.replace(old, new), said)


@pytest.mark.parametrize(
    ("name", "more", "said"),
    [
        ("kongsberg", "TRAI_RX2:X=0;Y=0;Z=0;R=0;P=0;H=0,\n", "two heads or receivers"),
        ("hypack", "OF2 1 4 0 0 1 0 0 0 0\n", "has 2 different lines OF2"),
        ("mbsystem", "SENSOR_TYPE 2 30\n", r"has 2 different multibeams"),
        ("novatel", "SETINSROTATION USER 0 0 0\n", "different commands SETINSROTATION USER"),
        ("novatel", "SETINSROTATION RBV 180 0 90\n", "RBV is not zero"),
        ("mbes-lib", "georeference -x 1\n", "2 different line"),
    ],
)
def test_two_heads_are_refused(name: str, more: str, said: str) -> None:
    refused(name, text_of(name) + more, said)


def test_two_sonars_of_kluster_need_a_serial_number() -> None:
    text = text_of("kluster").rstrip().removesuffix("}") + ', "8": {}}\n'
    refused("kluster", text, "give --serial", serial=None)
    refused("kluster", text, "rx_x: is missing|tx_x: is missing", serial="8")
    found = mount_in(TARGETS["kluster"], text, "file", None, Options(serial="7"))
    np.testing.assert_allclose(found.R_body_from_sensor, BODY.R_body_from_sensor, atol=1e-9)


@pytest.mark.parametrize("name", ["caris-hvf", "ros"])
def test_xml_with_a_document_type_is_not_parsed(name: str) -> None:
    bomb = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;">]><a>&c;</a>'
    refused(name, bomb, "has a DOCTYPE")


def test_a_mount_beyond_any_boat_is_refused() -> None:
    text = text_of("kongsberg").replace("X=0.2", "X=2000.2")
    refused("kongsberg", text, "y_m = 2000")
