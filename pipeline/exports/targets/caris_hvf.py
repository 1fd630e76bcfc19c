"""CARIS HIPS: the two sensors of a vessel file (.hvf, XML) that hold the mount, as a fragment to copy from.

``SVPSensor`` has angles "only for large transducer mounting offsets"; a tilted head belongs there, with zero in the
``DepthSensor``. A head near level belongs in the ``DepthSensor``. The maker gives no limit between the two; here it is
TILTED_DEG of roll or pitch. The offsets stand in both.
"""

import xml.etree.ElementTree as ET
from datetime import UTC, datetime
from xml.sax.saxutils import quoteattr

from pipeline.errors import ConfigError
from pipeline.exports.explanation import explanation, heading
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of, written
from pipeline.exports.target import Options, Target
from pipeline.exports.targets import caris
from pipeline.exports.targets.kluster import utc_second
from pipeline.exports.xml_text import comment, root_of
from pipeline.mount import Mounted

DECIMALS = 9
TILTED_DEG = 5.0
ATTRIBUTES = {"pitch": "Pitch", "roll": "Roll", "yaw": "Azimuth"}
PLACES = {"SVPSensor": "SVPSensor/TimeStamp", "DepthSensor": "DepthSensor/TimeStamp/TransducerEntries/Transducer"}


def _write(target: Target, mounting: Mounting, options: Options) -> str:
    values = target.convention.numbers(mounting.vessel, options.order).by_role()
    tilted = max(abs(values["roll"]), abs(values["pitch"])) > TILTED_DEG
    offsets = _attributes({role.upper(): values[role] for role in "xyz"})
    angles = _attributes({name: values[role] for role, name in ATTRIBUTES.items()})
    none = _attributes(dict.fromkeys(ATTRIBUTES.values(), 0.0))
    second = (
        _attributes(dict.fromkeys(("X2", "Y2", "Z2"), 0.0)),
        _attributes({f"{name}2": 0.0 for name in ATTRIBUTES.values()}),
    )
    where = "SVPSensor, for this head is tilted" if tilted else "DepthSensor, for this head is near level"
    about = [
        *heading(target, mounting),
        "A fragment, no whole vessel file: copy the two sensors' values into your vessel file by its editor.",
        f"The angles stand in {where} (limit here: {TILTED_DEG:g} degrees of roll or pitch); the other place has "
        "zeros. How "
        "HIPS puts the two together is not documented in what was found: check a line of known depth.",
        "Latency is written as zero: its sign in HIPS was not found.",
        "Elements and attributes are those of a real vessel file (Version 2.0) in the public repository "
        "pktrigg/pyAll2VesselConfig; the maker's own description of the XML was not found.",
        *explanation(target, mounting, options, "Must be zero: the 'Error' of the sensors Gyro, Pitch and Roll."),
    ]
    time = quoteattr(_time_stamp(mounting.origin.start_utc))
    latency = '<Latency value="0.000000"/>'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
{comment(about)}
<HIPSVesselConfig Version="2.0">
  <SVPSensor><TimeStamp value={time}>{latency}<DualHead value="No"/>
    <Offsets {offsets} {second[0]}/>
    <MountAngle {angles if tilted else none} {second[1]}/>
  </TimeStamp></SVPSensor>
  <DepthSensor><TimeStamp value={time}>{latency}<SensorClass value="Swath"/>
    <TransducerEntries><Transducer Number="1" StartBeam="1">
      <Offsets {offsets} Latency="0.000000"/>
      <MountAngle {none if tilted else angles}/>
    </Transducer></TransducerEntries>
  </TimeStamp></DepthSensor>
</HIPSVesselConfig>
"""


def _attributes(values: dict[str, float]) -> str:
    return " ".join(f'{name}="{written(value, DECIMALS)}"' for name, value in values.items())


def _time_stamp(start_utc: str | None) -> str:
    """Return a time as HIPS writes it, YYYY-DDD HH:MM:SS."""
    if start_utc is None:
        raise ConfigError("caris-hvf: the run has no pass, and HIPS wants a time from which the mount holds")
    return datetime.fromtimestamp(utc_second(start_utc), UTC).strftime("%Y-%j %H:%M:%S")


def _read(target: Target, text: str, where: str, options: Options) -> Mounted:
    root = root_of(text, where)
    if root.tag != "HIPSVesselConfig":
        raise ConfigError(f"{where}: begins with <{root.tag}>, no <HIPSVesselConfig>; name a vessel file of HIPS")
    angles, offsets = {}, {}
    for name, place in PLACES.items():
        found = root.findall(place)
        if len(found) != 1:
            raise ConfigError(
                f"{where}: {place} is there {len(found)} times: poolcal reads one head with one time stamp; leave one"
            )
        angles[name] = _values(found[0], "MountAngle", ATTRIBUTES, where)
        offsets[name] = _values(found[0], "Offsets", {role: role.upper() for role in "xyz"}, where)
        _refuse_second_head(found[0], where)
    held = [name for name, values in angles.items() if any(values.values())] or ["DepthSensor"]
    if len(held) > 1:
        raise ConfigError(
            f"{where}: both SVPSensor and DepthSensor have mounting angles, and how HIPS puts them together is not "
            "known: "
            "enter the mount by hand"
        )
    values = offsets["DepthSensor"] | angles[held[0]]
    return target.convention.mounted(numbers_of(values), options.order)


def _values(place: ET.Element, tag: str, names: dict[str, str], where: str) -> dict[str, float]:
    element = place.find(tag)
    if element is None:
        raise ConfigError(f"{where}: {place.tag} has no {tag}; is the file whole?")
    return {role: number(element.get(name, ""), f"{tag} {name}", where) for role, name in names.items()}


def _refuse_second_head(place: ET.Element, where: str) -> None:
    dual = place.find("DualHead")
    if dual is not None and dual.get("value", "No").lower() != "no":
        raise ConfigError(f"{where}: has two heads (DualHead); poolcal reads one: enter the mount by hand")


TARGET = Target(
    name="caris-hvf",
    title="CARIS HIPS vessel file, fragment",
    writes="XML fragment",
    suffix=".xml",
    convention=caris.CONVENTION,
    write=_write,
    read=_read,
    sensor="mbes",
)
