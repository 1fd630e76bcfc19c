"""MBES-lib's program ``georeference``: options of its command line.

Its matrix is Rz(h) · Ry(p) · Rx(r) in forward, starboard, down, and the lever arm is x, y, z in the same axes.
"""

import re
import shlex

from pipeline.errors import ConfigError
from pipeline.exports.convention import FRD, Convention
from pipeline.exports.explanation import explanation, heading
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of, one, whole_lines, written
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted

LETTERS = {"x": "x", "y": "y", "z": "z", "roll": "r", "pitch": "p", "yaw": "h"}
DECIMALS = 9


def _write(target: Target, mounting: Mounting, options: Options) -> str:
    values = target.convention.numbers(mounting.vessel).by_role()
    words = " ".join(f"-{letter} {written(values[role], DECIMALS)}" for role, letter in LETTERS.items())
    comments = [*heading(target, mounting), *explanation(target, mounting, options)]
    comments += ["Put the names of the SBET and of the sonar's file in place of SBET and FILE."]
    return "\n".join([*(f"# {line}" for line in comments), f"georeference {words} -b SBET FILE"]) + "\n"


def _read(target: Target, text: str, where: str, _: Options) -> Mounted:
    lines = [line for line in whole_lines(text, where) if re.match(r"(?:\S*/)?georeference\s", line)]
    (line,) = one(lines, "line that calls georeference", where)
    try:
        words = shlex.split(line)
    except ValueError as error:
        raise _fault(where, str(error)) from error
    values = {}
    for role, letter in LETTERS.items():
        places = [place for place, word in enumerate(words[:-1]) if word == f"-{letter}"]
        if len(places) != 1:
            raise _fault(where, f"-{letter} is there {len(places)} times")
        values[role] = number(words[places[0] + 1], f"-{letter}", where)
    return target.convention.mounted(numbers_of(values))


def _fault(where: str, reason: str) -> ConfigError:
    return ConfigError(f"{where}: georeference: {reason}; correct the line")


TARGET = Target(
    name="mbes-lib",
    title="CIDCO MBES-lib georeference",
    writes="command line",
    suffix=".txt",
    convention=Convention(
        FRD,
        (1, 1, -1),
        "YPR",
        "code",
        "MBES-lib, src/math/Boresight.hpp, CoordinateTransform.hpp, examples/georeference.cpp",
    ),
    write=_write,
    read=_read,
    sensor="mbes",
    counts_from="ins",
)
