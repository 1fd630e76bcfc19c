"""HYPACK HYSWEEP: a sheet, and the line OF2 of an HSX file.

``OF2 device offset n1 … n7``: starboard, forward, vertical (down from the waterline), yaw (clockwise +), roll (port
side up +, which is starboard side down +), pitch (bow up +), latency in seconds. Offset 3 is the sonar's head 1. With
the INS's height h above the water, and z the sensor's height above the INS in vessel axes, vertical = -(h + z).
The order of rotations is not stated in what was found.
"""

import re

from pipeline.errors import ConfigError
from pipeline.exports.convention import SFD, Convention
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of, one, whole_lines, written
from pipeline.exports.sheet import Sheet
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted

DECIMALS = 9
FIELDS = ("x", "y", "z", "yaw", "roll", "pitch")  # in the order of the line
DEVICE, HEAD_1 = 1, 3


def _height_in_words(mounting: Mounting, options: Options) -> str | None:
    """Return what the vertical offset is made of, if the INS's height above the water is not told."""
    if options.ins_height_m is not None:
        return None
    above_ins = mounting.vessel.lever_arm_body_m[2] - mounting.frame.ins_point_m[2]
    return f"{written(-above_ins, 4)} m less the height of the INS above the water (give --ins-height)"


def _extra(target: Target, mounting: Mounting, options: Options) -> list[str]:
    if options.ins_height_m is None:
        return ["No line OF2, for the height of the INS above the water is not known: give --ins-height."]
    values = target.convention.numbers(mounting.vessel, options.order).by_role()
    numbers = " ".join(written(values[role], DECIMALS) for role in FIELDS)
    return [
        "The same as a line of an HSX file (head 1; the device's number and the latency as in your file):",
        f"OF2 {DEVICE} {HEAD_1} {numbers} 0.000",
    ]


def _read(target: Target, text: str, where: str, options: Options) -> Mounted:
    if options.ins_height_m is None and not mounting_stated(text):
        raise ConfigError(
            "--ins-height: is needed: HYPACK counts from the waterline, so give the INS's height above it, m"
        )
    found = [tuple(line.split()[1:]) for line in whole_lines(text, where) if re.match(r"\s*OF2\s", line)]
    heads = [words for words in found if len(words) > 1 and words[1].isdecimal() and int(words[1]) >= HEAD_1]
    words = one([words[1:] for words in heads], "lines OF2 of a sonar's head", where)
    if len(words) != 8:
        raise ConfigError(f"{where}: OF2 has {len(words) + 1} numbers, not 9; correct the line")
    values = {role: number(word, f"OF2 {role}", where) for role, word in zip(FIELDS, words[1:7], strict=True)}
    return target.convention.mounted(numbers_of(values), options.order)


def mounting_stated(text: str) -> bool:
    """Return whether a text is a sheet of poolcal's, which states the place of the INS."""
    return text.startswith("poolcal export: ")


_SHEET = Sheet(
    groups=(
        (
            "HYSWEEP Hardware, sonar head 1: offsets",
            {"x": "Starboard", "y": "Forward", "z": "Vertical"},
        ),
        ("HYSWEEP Hardware, sonar head 1: rotation", {"yaw": "Yaw", "roll": "Roll", "pitch": "Pitch"}),
    ),
    zeros="Must be zero: patch-test corrections of the same sonar that MBMAX or HYSWEEP keep elsewhere.",
    notes=(
        "Vertical counts from the waterline, down +; a dynamic draft or another waterline goes where HYPACK has a "
        "place for it.",
        "In HYSWEEP the INS's own vertical offset is also + down from the waterline.",
    ),
    extra=_extra,
    not_known={"z": _height_in_words},
)
CONVENTION = Convention(
    SFD,
    (1, 1, -1),
    None,
    "secondary",
    "the maker's words as quoted in MB-System, src/mbio/mbsys_hysweep.h, and by USGS Open-File Report 2000-005 (OFF)",
)
TARGET = _SHEET.target(
    "hypack",
    "HYPACK HYSWEEP",
    CONVENTION,
    writes="entry sheet, HSX line OF2",
    read=_read,
    counts_from="water",
    uses=frozenset({"ins_height"}),
)
