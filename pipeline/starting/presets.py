"""Presets of instruments for a new session: the one that a file's header names, and those to choose from."""

import re

from pipeline.config.instruments import PRESETS, Sensor, load_instrument

_MODELS = {  # preset by the whole of the instrument's name in headers; VZ-400i is another scanner than VZ-400
    r"R2Sonic 2024": "r2sonic_2024",
    r"RIEGL VZ-?1000": "riegl_vz1000",
    r"RIEGL VZ-?400": "riegl_vz400",
}


def preset_of(instrument: str) -> str:
    """Return the name of the preset for an instrument that a header names; empty if there is none for certain.

    >>> preset_of("R2Sonic 2024"), preset_of("RIEGL VZ-400"), preset_of("RIEGL VZ-400i"), preset_of("R2Sonic 2026")
    ('r2sonic_2024', 'riegl_vz400', '', '')
    """
    return next((name for model, name in _MODELS.items() if re.fullmatch(model, instrument)), "")


def presets_for(sensor: Sensor) -> list[str]:
    """Return the names of the program's presets for a sensor, each with the instrument's title."""
    presets = {path.stem: load_instrument(path) for path in sorted(PRESETS.glob("*.yaml"))}
    return [f"{name} ({preset.title})" for name, preset in presets.items() if preset.sensor == sensor]
