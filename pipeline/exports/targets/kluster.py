"""Kluster's vessel file (.kfc): JSON, serial number of the sonar, then key, then UTC second, then value as text.

Kluster's build_rot_mat is Rz(h) · Ry(p) · Rx(r) in forward, starboard, down, for transmitter (tx) and receiver (rx)
apart. All keys of a sonar need the same seconds. ``latency`` is added to the times of pings when attitude and positions
are looked up, so it has the sign opposite to ours (true time = recorded time - latency_s). ``waterline`` is how far the
water lies below the reference point; it is written if the height of the INS above the water is told. The errors are one
sigma.
"""

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from pipeline.errors import ConfigError
from pipeline.exports.convention import FRD, Convention
from pipeline.exports.explanation import sigmas_of
from pipeline.exports.json_text import json_of
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of, one, written
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted

DECIMALS = 9
LETTERS = {"x": "x", "y": "y", "z": "z", "roll": "r", "pitch": "p", "yaw": "h"}
PATCH_ERRORS = {"roll": "roll_patch_error", "pitch": "pitch_patch_error", "yaw": "heading_patch_error"}


def _write(target: Target, mounting: Mounting, options: Options) -> str:
    if options.serial is None:
        raise ConfigError("--serial: is needed: the sonar's serial number, under which Kluster keeps its mount")
    if mounting.origin.start_utc is None:
        raise ConfigError("kluster: the run has no pass, and Kluster wants a time from which the mount holds")
    keys: dict[str, float | str] = {}
    for prefix, mounted in zip(("tx", "rx"), mounting.arrays(), strict=True):
        values = target.convention.numbers(mounted).by_role()
        keys |= {f"{prefix}_{letter}": written(values[role], DECIMALS) for role, letter in LETTERS.items()}
    keys |= {"latency": written(-mounting.latency_s, DECIMALS)}
    if options.ins_height_m is not None:
        keys |= {"waterline": written(options.ins_height_m - mounting.frame.ins_point_m[2], DECIMALS)}
    sigmas = sigmas_of(target, mounting, options)
    if sigmas is not None:
        keys |= {name: round(sigmas[role], 6) for role, name in PATCH_ERRORS.items()}
    second = str(utc_second(mounting.origin.start_utc))
    return json.dumps({options.serial: {key: {second: value} for key, value in keys.items()}}, indent=4) + "\n"


def utc_second(start_utc: str) -> int:
    """Return the UTC second of a time as calibration.json writes it."""
    try:
        return int(datetime.strptime(start_utc, "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=UTC).timestamp())
    except ValueError as error:
        raise ConfigError(f"{start_utc!r}: is no time of a pass; run poolcal run again") from error


def _read(target: Target, text: str, where: str, options: Options) -> Mounted:
    content = json_of(text, where)
    serial = options.serial
    if serial is None:
        (serial,) = one(list(content), "sonars (give --serial)", where)
    block = content.get(serial)
    if not isinstance(block, dict):
        raise ConfigError(f"{where}: has no sonar {serial}; its sonars are {', '.join(content)}")
    mounts = {prefix: _newest(block, prefix, where) for prefix in ("tx", "rx")}
    return target.convention.mounted(numbers_of(mounts["rx"]))


def _newest(block: Mapping[str, Any], prefix: str, where: str) -> dict[str, float]:
    """Return the newest values of an array by role."""
    values = {}
    for role, letter in LETTERS.items():
        name = f"{prefix}_{letter}"
        entry = block.get(name)
        if not (isinstance(entry, dict) and entry and all(key.isdecimal() for key in entry)):
            raise ConfigError(
                f"{where}: {name}: is missing, or without a UTC second; poolcal reads one head, tx_ and rx_"
            )
        values[role] = number(entry[max(entry, key=int)], name, where)
    return values


TARGET = Target(
    name="kluster",
    title="NOAA Kluster",
    writes="vessel file (.kfc)",
    suffix=".kfc",
    convention=Convention(
        FRD,
        (1, 1, -1),
        "YPR",
        "code",
        "Kluster, HSTB/kluster/rotations.py, fqpr_vessel.py, fqpr_generation.py (latency)",
    ),
    write=_write,
    read=_read,
    sensor="mbes",
    uses=frozenset({"serial", "ins_height"}),
    has_marks=False,
)
