"""Presets of instruments: published figures of an instrument, under the keys of session.yaml.

session.yaml names a preset by ``instrument: r2sonic_2024`` in the sensor's block. The file is
SESSION/instruments/NAME.yaml, else configs/instruments/NAME.yaml. The session's values take precedence over the
preset's, and the preset's over the defaults. Nested blocks are merged key by key. The sensor's block records the source
of each figure (:class:`InstrumentUsed`), so that run.yaml can be read again without presets.
"""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from re import fullmatch
from typing import Any, Literal

from pydantic import BaseModel, Field, create_model

from pipeline import CONFIGS
from pipeline.config.heads import HEADS
from pipeline.config.plan import LaserFigures, MbesFigures, Plan
from pipeline.config.quantities import Model
from pipeline.config.references import INSTRUMENT, InstrumentTitle
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError

Sensor = Literal["ins", "laser", "mbes"]
Block = dict[str, Any]
PRESETS = CONFIGS / "instruments"
SENSORS: Mapping[Sensor, type[Model]] = {"ins": Ins, "laser": Laser, "mbes": Mbes}
SETTINGS: Mapping[Sensor, tuple[str, ...]] = {  # keys that a preset may set and the report shows
    "ins": ("drift", "white"),
    "laser": ("range_sigma_m", "range_bias_sigma_m", "incidence_bias_sigma_m", "angle_sigma_deg", "beam_m"),
    "mbes": (
        "range_sigma_m", "range_bias_sigma_m", "incidence_bias_sigma_m", "level_bias_sigma_m", "angle_sigma_deg",
        "beam_deg", "frequency_hz", "aperture_m", "focused", "projector_offset_m", "projector_sigma_m",
    ),
}
MOST_PRESETS = 1000  # most files that are read for a message


class Instrument(Model):
    """A preset: NAME.yaml."""

    title: InstrumentTitle
    sensor: Sensor
    settings: Block = Field(default_factory=dict)  # keys of the sensor's block
    rates: Block = Field(default_factory=dict)  # keys of PLAN.yaml for the sensor
    unverified: tuple[str, ...] = Field(default=(), max_length=100)  # keys without a document, such as rates.beams


def _part(model: type[BaseModel], names: tuple[str, ...]) -> type[Model]:
    """Return a model with only the named fields of another model."""
    fields: Block = {name: (model.model_fields[name].annotation, model.model_fields[name]) for name in names}
    return create_model(f"{model.__name__}Part", __base__=Model, **fields)


def settings_model(sensor: Sensor) -> type[Model]:
    """Return the model of a preset's block ``settings`` for the sensor."""
    return _part(SENSORS[sensor], SETTINGS[sensor])


def rates_model(sensor: Sensor) -> type[Model]:
    """Return the model of a preset's block ``rates`` for the sensor."""
    plans: Mapping[Sensor, type[Model]] = {"laser": LaserFigures, "mbes": MbesFigures}
    return plans[sensor] if sensor in plans else _part(Plan, ("ins_rate_hz",))


def load_instrument(path: Path) -> Instrument:
    """Return the preset in a file, checked; raise ConfigError if the file is no valid preset."""
    instrument = parse(Instrument, read_yaml(path), str(path))
    parse(settings_model(instrument.sensor), instrument.settings, f"{path}: settings")
    parse(rates_model(instrument.sensor), instrument.rates, f"{path}: rates")
    keys = set(dotted_keys(instrument.settings)) & {*figures(instrument.sensor)}
    keys |= {f"rates.{key}" for key in instrument.rates}
    for key in instrument.unverified:
        if key not in keys:
            raise ConfigError(f"{path}: unverified: {key!r}: is given no value here; name one that is")
    return instrument


def merge_presets(content: Block, folder: Path) -> tuple[Block, frozenset[str]]:
    """Merge the presets that session.yaml names into its content.

    Parameters
    ----------
    content : dict[str, Any]
        Content of session.yaml, each head in a block of its own. Its keys take precedence over a preset's.
    folder : Path
        The session folder, which may have presets of its own.

    Returns
    -------
    tuple[dict[str, Any], frozenset[str]]
        The content with the presets' values, and the dotted keys of session.yaml itself (``ins.drift``,
        ``ins.drift.heading_deg``), without keys that only a preset has.
    """
    blocks: dict[str, Sensor] = {sensor: sensor for sensor in SENSORS} | dict.fromkeys(HEADS, "mbes")
    full = {name: _with_preset(sensor, content[name], folder) for name, sensor in blocks.items() if name in content}
    return content | full, frozenset(dotted_keys(content))


def _with_preset(sensor: Sensor, block: Any, folder: Path) -> Any:
    """Return a sensor's block merged with the preset that it names, and with the source of each figure."""
    name = block.get("instrument") if isinstance(block, dict) else None
    if name is None:
        return block
    instrument = _instrument_by_name(sensor, name, folder)
    own, preset = set(dotted_keys(block)), set(dotted_keys(instrument.settings))
    used = {  # InstrumentUsed
        "name": name,
        "title": instrument.title,
        "unverified": list(instrument.unverified),
        "origins": {
            key: "session" if key in own else "preset" if key in preset else "default" for key in figures(sensor)
        },
        "rates": instrument.rates,
    }
    return deep_merge(instrument.settings, block) | {"instrument": used}


def deep_merge(defaults: Any, own: Any) -> Any:
    """Return ``own`` with its missing keys taken from ``defaults``, block by block.

    >>> deep_merge({"a": 3, "b": {"d": 4}, "e": 5}, {"a": 1, "b": {"c": 2}})
    {'a': 1, 'b': {'d': 4, 'c': 2}, 'e': 5}
    """
    if not (isinstance(own, dict) and isinstance(defaults, dict)):
        return own
    return defaults | {key: deep_merge(defaults.get(key), value) for key, value in own.items()}


def figures(sensor: Sensor) -> list[str]:
    """Return the dotted keys of all figures that a preset may set for the sensor."""
    fields = SENSORS[sensor].model_fields
    blocks = {name: getattr(fields[name].annotation, "model_fields", None) for name in SETTINGS[sensor]}
    keys = ([f"{name}.{key}" for key in inner] if inner else [name] for name, inner in blocks.items())
    return [key for group in keys for key in group]


def dotted_keys(content: Mapping[Any, Any], prefix: str = "") -> Iterator[str]:
    """Yield the dotted keys of nested blocks: first a block's own key, then the keys in it."""
    for key, value in content.items():
        yield f"{prefix}{key}"
        if isinstance(value, dict):
            yield from dotted_keys(value, f"{prefix}{key}.")


# --- files -----------------------------------------------------------------------------------------------------------
def _instrument_by_name(sensor: Sensor, name: Any, folder: Path) -> Instrument:
    where = f"{folder / 'session.yaml'}: {sensor}.instrument = {str(name)[:60]!r}"
    if not (isinstance(name, str) and fullmatch(INSTRUMENT, name)):
        raise ConfigError(f"{where}: is no name, of a-z, 0-9 and _; {_known(sensor, folder)}")
    path = _path(name, folder)
    if path is None:
        raise ConfigError(f"{where}: no such instrument; {_known(sensor, folder)}")
    instrument = load_instrument(path)
    if instrument.sensor != sensor:
        raise ConfigError(
            f"{where}: is a preset for {instrument.sensor} ({instrument.title}); {_known(sensor, folder)}"
        )
    return instrument


def _path(name: str, folder: Path) -> Path | None:
    """Return the path of a preset in the session folder, or else of the program's preset; None if there is neither."""
    in_session, in_program = folder / "instruments" / f"{name}.yaml", PRESETS / f"{name}.yaml"
    if os.path.lexists(in_session):
        if not os.path.isfile(in_session) or not in_session.resolve().is_relative_to(folder.resolve()):
            raise ConfigError(f"{in_session}: is no file inside the session folder; put the preset itself there")
        return in_session
    return in_program if os.path.isfile(in_program) else None


def _known(sensor: Sensor, folder: Path) -> str:
    """Return the part of a message that lists the presets for the sensor."""
    names = {path.stem for place in (PRESETS, folder / "instruments") for path in sorted(place.glob("*.yaml"))}
    fitting = [name for name in sorted(names)[:MOST_PRESETS] if _sensor_of(name, folder) == sensor]
    return f"known for {sensor}: {', '.join(fitting) or 'none'}"


def _sensor_of(name: str, folder: Path) -> Sensor | None:
    """Return the sensor that a preset is for; None if the preset cannot be read."""
    try:
        path = _path(name, folder)
        return load_instrument(path).sensor if path else None
    except ConfigError:  # reported when a session names it
        return None
