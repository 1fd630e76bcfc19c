"""SONAR-netCDF4 (XSF): variables of group Platform, as JSON.

R_platform_from_transducer = Rz(rotation_z) · Ry(rotation_y) · Rx(rotation_x), right-handed, degrees, the results of a
calibration included; both frames are forward, starboard, down. ``transducer_function`` is receive_only 0, transmit_only
1, monostatic 3.
"""

import json

from pipeline.errors import ConfigError
from pipeline.exports.convention import FRD, Convention
from pipeline.exports.explanation import explanation, heading
from pipeline.exports.json_text import json_of
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted

NAMES = {
    "x": "transducer_offset_x",
    "y": "transducer_offset_y",
    "z": "transducer_offset_z",
    "roll": "transducer_rotation_x",
    "pitch": "transducer_rotation_y",
    "yaw": "transducer_rotation_z",
}
RECEIVER, TRANSMITTER, BOTH = 0, 1, 3  # transducer_type_t: receive_only, transmit_only, monostatic


def _write(target: Target, mounting: Mounting, options: Options) -> str:
    values = [target.convention.numbers(mounted).by_role() for mounted in mounting.arrays()]
    variables: dict[str, object] = {"transducer_function": [TRANSMITTER, RECEIVER]}
    variables |= {name: [of[role] for of in values] for role, name in NAMES.items()}
    content = {
        "Platform": variables,
        "comment": [
            *heading(target, mounting),
            *explanation(target, mounting, options),
            "Transducers: transmitter, receiver. MRU_rotation_x, _y, _z stay as they are.",
        ],
    }
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _read(target: Target, text: str, where: str, _: Options) -> Mounted:
    platform = json_of(text, where).get("Platform")
    if not isinstance(platform, dict):
        raise ConfigError(f"{where}: has no group Platform; write its variables as JSON")
    functions = platform.get("transducer_function")
    receivers = (
        [place for place, value in enumerate(functions) if value in (RECEIVER, BOTH)]
        if isinstance(functions, list)
        else []
    )
    if len(receivers) != 1:
        raise ConfigError(
            f"{where}: transducer_function has {len(receivers)} receivers; poolcal reads one head at a time"
        )
    numbers = {}
    for role, name in NAMES.items():
        entries = platform.get(name)
        if not isinstance(entries, list) or len(entries) <= receivers[0]:
            raise ConfigError(f"{where}: {name} is missing, or too short; is the file whole?")
        numbers[role] = number(entries[receivers[0]], name, where)
    return target.convention.mounted(numbers_of(numbers))


TARGET = Target(
    name="xsf",
    title="SONAR-netCDF4 (XSF) group Platform",
    writes="JSON of the variables",
    suffix=".json",
    convention=Convention(
        FRD,
        (1, 1, -1),
        "YPR",
        "official",
        "ICES SONAR-netCDF4 2, docs/crr341.adoc (axes, signs, order), docs/tablePlatform.adoc (names, functions)",
    ),
    write=_write,
    read=_read,
    sensor="mbes",
)
