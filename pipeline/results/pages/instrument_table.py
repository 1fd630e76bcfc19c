"""The report's table of instruments: the figures that weight the observations, and the origin of each."""

from collections.abc import Mapping
from functools import reduce
from typing import Any

from pydantic import BaseModel

from pipeline.config.instruments import SENSORS, figures
from pipeline.config.session import Ins, Laser, Mbes, SessionConfig

Row = Mapping[str, Any]


def instrument_rows(session: SessionConfig) -> list[Row]:
    """Return one row for each figure. The first row of a sensor has the names of the sensor and of its instrument.

    Without a preset, the origin of a value that equals the default is the default.
    """
    rows: list[Row] = []
    for sensor, model in SENSORS.items():
        block: Ins | Laser | Mbes | None = getattr(session, sensor)
        if block is None:
            continue
        preset = block.instrument
        for number, key in enumerate(figures(sensor)):
            value, default = _at(block, key), _at(model.model_fields, key)
            origin = preset.origins.get(key, "default") if preset else "default" if value == default else "session"
            rows.append(
                {
                    "sensor": "" if number else sensor,
                    "instrument": "" if number else preset.title if preset else "–",
                    "key": key,
                    "value": _shown(value),
                    "origin": origin,
                    "unverified": preset is not None and origin == "preset" and key in preset.unverified,
                }
            )
    return rows


def _at(start: Any, key: str) -> Any:
    """Return the value of a model at a dotted key, or, if ``start`` holds a model's fields, the default at this key."""

    def step(block: Any, name: str) -> Any:
        return getattr(block, name) if isinstance(block, BaseModel) else block[name].get_default()

    return reduce(step, key.split("."), start)


def _shown(value: float | tuple[float, ...] | None) -> str:
    if value is None:
        return "–"
    words = {True: "yes", False: "no"}
    numbers = value if isinstance(value, tuple) else (value,)
    return ", ".join(words[number] if isinstance(number, bool) else f"{number:g}" for number in numbers)
