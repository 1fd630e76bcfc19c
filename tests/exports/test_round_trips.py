"""Every form, read by a reader of its own: the same rotation and lever arm, for 200 mounts and every frame offered."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.errors import ConfigError
from pipeline.exports.mounting import Mounting, VesselFrame
from pipeline.exports.orders import ORDERS
from pipeline.exports.registry import TARGETS
from pipeline.exports.target import Options
from pipeline.exports.writing import export_text, mount_in
from pipeline.mount import Mounted
from tests.support.mountings import FRAMES, in_vessel, mounted, mounting, random_mounts
from tests.support.programs import READERS, SHEETS

OF_FILES, OF_SHEETS = 1e-9, (3 * np.radians(0.00005), np.sqrt(3) * 0.0000501)  # element of the matrix, m
NO_COMMENTS = ("kluster",)


def options_for(name: str, place: int) -> Options:
    target = TARGETS[name]
    return Options(
        order=ORDERS[place % 6] if target.convention.order is None else None,
        serial="200123" if "serial" in target.uses else None,
        ins_height_m=0.9 if name == "hypack" else None,
    )


def frame_for(name: str, place: int) -> VesselFrame:
    return FRAMES[0] if TARGETS[name].counts_from == "ins" else FRAMES[place % len(FRAMES)]


def same(found: tuple[np.ndarray, np.ndarray], true: Mounted, name: str) -> None:
    angle, length = OF_SHEETS if name in SHEETS else (OF_FILES, OF_FILES)
    assert np.abs(found[0] - true.R_body_from_sensor).max() < angle
    assert np.linalg.norm(found[1] - true.lever_arm_body_m) < length


def test_every_target_has_a_reader_of_its_own() -> None:
    assert set(READERS) == set(TARGETS)


@pytest.mark.parametrize("name", sorted(READERS))
def test_the_program_finds_the_mount_and_so_does_poolcal(name: str) -> None:
    target = TARGETS[name]
    for place, body in enumerate(random_mounts()):
        options, frame = options_for(name, place), frame_for(name, place)
        sensor = target.sensor or ("mbes", "laser")[place % 2]
        text = export_text(target, mounting(body, frame=frame, sensor=sensor), options)
        order = options.order or "YPR"
        of_program = frame
        if options.ins_height_m is not None:
            of_program = replace(frame, ins_point_m=(*frame.ins_point_m[:2], options.ins_height_m))
        same(READERS[name](text, order), in_vessel(body, of_program), name)
        told = frame if name in NO_COMMENTS else None
        read = replace(options, ins_height_m=None)
        found = mount_in(target, text, "file", told, read)
        same((found.R_body_from_sensor, found.lever_arm_body_m), body, name)


def test_forms_of_other_programs_need_the_options_that_the_form_does_not_tell() -> None:
    body, frame = mounted(-48.8, 1.2, -2.0, 0.3, 0.2, -2.01), VesselFrame((0.5, 1.0, 2.0), (0.0, 0.0, 90.0))
    line = "OF2 1 3 0.3 0.2 1.11 2.0 -48.8 1.2 0.0\n"
    target = TARGETS["hypack"]
    found = mount_in(target, line, "hsx", None, Options(order="YPR", ins_height_m=0.9))
    same((found.R_body_from_sensor, found.lever_arm_body_m), body, "hypack")
    with pytest.raises(ConfigError, match="--ins-height: is needed"):
        mount_in(target, line, "hsx", None, Options(order="YPR"))
    with pytest.raises(ConfigError, match="--order: is needed"):
        mount_in(target, line, "hsx", None, Options(ins_height_m=0.9))
    text = export_text(TARGETS["qinsy"], mounting(body, frame=frame), Options())
    with pytest.raises(ConfigError, match="states another place or turn of the INS"):
        mount_in(TARGETS["qinsy"], text, "sheet", VesselFrame(), Options())


def test_transmitter_and_receiver_apart() -> None:
    """The transmitter 0.119 m below the receiver and 0.05 m ahead, on a head rolled by 90°: below is port of it."""
    body = mounted(90.0, 0.0, 0.0, 1.0, 2.0, -3.0)
    apart = mounting(body, projector_offset_m=(0.0, 0.05, -0.119))
    text = export_text(TARGETS["mbsystem"], apart, Options())
    rows = {tuple(words[1:3]): np.array(words[3:6], float) for line in text.splitlines()
            if (words := line.split()) and words[0] == "OFFSET_POSITION"}  # fmt: skip
    np.testing.assert_allclose(rows["1", "1"], [1.0, 2.0, -3.0], atol=1e-9)
    np.testing.assert_allclose(rows["1", "0"], [0.881, 2.05, -3.0], atol=1e-9)
    split = replace(apart, split=True)  # Kongsberg's files: x and z of the receiver, y of the transmitter
    transmitter, receiver = split.arrays()
    np.testing.assert_allclose(receiver.lever_arm_body_m, [1.0, 1.95, -3.0], atol=1e-12)
    np.testing.assert_allclose(transmitter.lever_arm_body_m, [0.881, 2.0, -3.0], atol=1e-12)


@pytest.mark.parametrize("name", ["kluster", "kongsberg", "mbsystem", "xsf"])
def test_arrays_whose_places_only_the_files_know_are_asked_for(name: str) -> None:
    unknown: Mounting = mounting(mounted(0.0, 0.0, 0.0), split=True)
    with pytest.raises(ConfigError, match="--projector-offset: is needed"):
        export_text(TARGETS[name], unknown, options_for(name, 0))
