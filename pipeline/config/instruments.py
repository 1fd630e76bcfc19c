"""Presets of instruments: what is published of one, under the session's own keys.

session.yaml names one by ``instrument: r2sonic_2024`` in the sensor's block. The file is SESSION/instruments/NAME.yaml,
else configs/instruments/NAME.yaml. Precedence: session, preset, default; nested blocks key by key. What was taken from
where stays with the sensor's block as :class:`InstrumentUsed`, so that run.yaml is read again without presets.
"""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from re import fullmatch
from typing import Any, Literal

from pydantic import BaseModel, Field, create_model

from pipeline import CONFIGS
from pipeline.config.plan import LaserFigures, MbesFigures, Plan
from pipeline.config.quantities import Model
from pipeline.config.resolved import INSTRUMENT, InstrumentTitle
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.config.yaml_models import parse, read_yaml
from pipeline.errors import ConfigError

Sensor = Literal["ins", "laser", "mbes"]
Block = dict[str, Any]
PRESETS = CONFIGS / "instruments"
SENSORS: Mapping[Sensor, type[Model]] = {"ins": Ins, "laser": Laser, "mbes": Mbes}
SETTINGS: Mapping[Sensor, tuple[str, ...]] = {  # what a preset may say, and the report shows
    "ins": ("drift", "white"),
    "laser": ("range_sigma_m", "range_bias_sigma_m", "angle_sigma_deg"),
    "mbes": ("range_sigma_m", "range_bias_sigma_m", "angle_sigma_deg", "beam_deg", "projector_offset_m"),
}
MOST_PRESETS = 1000  # that a message looks through


class Instrument(Model):
    """NAME.yaml"""

    title: InstrumentTitle
    sensor: Sensor
    settings: Block = Field(default_factory=dict)  # keys of the sensor's block
    rates: Block = Field(default_factory=dict)  # keys of PLAN.yaml, of the sensor
    unverified: tuple[str, ...] = Field(default=(), max_length=100)  # range_sigma_m, drift.heading_deg, rates.beams


def _part(model: type[BaseModel], names: tuple[str, ...]) -> type[Model]:
    """A model of some of the fields alone."""
    fields: Block = {name: (model.model_fields[name].annotation, model.model_fields[name]) for name in names}
    return create_model(f"{model.__name__}Part", __base__=Model, **fields)


def settings_model(sensor: Sensor) -> type[Model]:
    return _part(SENSORS[sensor], SETTINGS[sensor])


def rates_model(sensor: Sensor) -> type[Model]:
    plans: Mapping[Sensor, type[Model]] = {"laser": LaserFigures, "mbes": MbesFigures}
    return plans[sensor] if sensor in plans else _part(Plan, ("ins_rate_hz",))


def load_instrument(path: Path) -> Instrument:
    """A preset, checked."""
    found = parse(Instrument, read_yaml(path), str(path))
    parse(settings_model(found.sensor), found.settings, f"{path}: settings")
    parse(rates_model(found.sensor), found.rates, f"{path}: rates")
    given = set(_paths(found.settings)) & {*figures(found.sensor)} | {f"rates.{key}" for key in found.rates}
    for key in found.unverified:
        if key not in given:
            raise ConfigError(f"{path}: unverified: {key!r}: is given no value here; name one that is")
    return found


def applied(content: Block, folder: Path) -> tuple[Block, frozenset[str]]:
    """session.yaml's ``content`` with the presets that it names under its own keys, and these keys (``ins.drift``,
    ``ins.drift.heading_deg``): what a preset says was not said by the session."""
    full = {sensor: _with_preset(sensor, content[sensor], folder) for sensor in SENSORS if sensor in content}
    return content | full, frozenset(_paths(content))


def _with_preset(sensor: Sensor, block: Any, folder: Path) -> Any:
    name = block.get("instrument") if isinstance(block, dict) else None
    if name is None:
        return block
    instrument = _named(sensor, name, folder)
    own, preset = set(_paths(block)), set(_paths(instrument.settings))
    used = {  # InstrumentUsed
        "name": name,
        "title": instrument.title,
        "unverified": list(instrument.unverified),
        "origins": {
            key: "session" if key in own else "preset" if key in preset else "default" for key in figures(sensor)
        },
        "rates": instrument.rates,
    }
    return under(block, instrument.settings) | {"instrument": used}


def under(own: Any, lower: Any) -> Any:
    """``own`` with what it lacks from ``lower``, block by block.

    >>> under({"a": 1, "b": {"c": 2}}, {"a": 3, "b": {"d": 4}, "e": 5})
    {'a': 1, 'b': {'d': 4, 'c': 2}, 'e': 5}
    """
    if not (isinstance(own, dict) and isinstance(lower, dict)):
        return own
    return lower | {key: under(value, lower.get(key)) for key, value in own.items()}


def figures(sensor: Sensor) -> list[str]:
    """Dotted keys of all that a preset may say of the sensor."""
    fields = SENSORS[sensor].model_fields
    blocks = {name: getattr(fields[name].annotation, "model_fields", None) for name in SETTINGS[sensor]}
    return [key for name, inner in blocks.items() for key in ([f"{name}.{one}" for one in inner] if inner else [name])]


def _paths(content: Mapping[Any, Any], prefix: str = "") -> Iterator[str]:
    for key, value in content.items():
        yield f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _paths(value, f"{prefix}{key}.")


# --- files -----------------------------------------------------------------------------------------------------------
def _named(sensor: Sensor, name: Any, folder: Path) -> Instrument:
    where = f"{folder / 'session.yaml'}: {sensor}.instrument = {str(name)[:60]!r}"
    if not (isinstance(name, str) and fullmatch(INSTRUMENT, name)):
        raise ConfigError(f"{where}: is no name, of a-z, 0-9 and _; {_known(sensor, folder)}")
    path = _path(name, folder)
    if path is None:
        raise ConfigError(f"{where}: no such instrument; {_known(sensor, folder)}")
    found = load_instrument(path)
    if found.sensor != sensor:
        raise ConfigError(f"{where}: is a preset for {found.sensor} ({found.title}); {_known(sensor, folder)}")
    return found


def _path(name: str, folder: Path) -> Path | None:
    own, ours = folder / "instruments" / f"{name}.yaml", PRESETS / f"{name}.yaml"
    if os.path.lexists(own):
        if not os.path.isfile(own) or not own.resolve().is_relative_to(folder.resolve()):
            raise ConfigError(f"{own}: is no file inside the session folder; put the preset itself there")
        return own
    return ours if os.path.isfile(ours) else None


def _known(sensor: Sensor, folder: Path) -> str:
    names = {path.stem for place in (PRESETS, folder / "instruments") for path in sorted(place.glob("*.yaml"))}
    fitting = [name for name in sorted(names)[:MOST_PRESETS] if _sensor_of(name, folder) == sensor]
    return f"known for {sensor}: {', '.join(fitting) or 'none'}"


def _sensor_of(name: str, folder: Path) -> Sensor | None:
    try:
        path = _path(name, folder)
        return load_instrument(path).sensor if path else None
    except ConfigError:  # told when it is asked for
        return None
