"""The report's table of instruments: the figures that weigh the observations, and where each comes from."""

from collections.abc import Mapping
from functools import reduce
from typing import Any

from pydantic import BaseModel

from pipeline.config.instruments import SENSORS, figures
from pipeline.config.session import Ins, Laser, Mbes, SessionConfig

Row = Mapping[str, Any]


def instrument_rows(session: SessionConfig) -> list[Row]:
    """Return a row for each figure, with sensor and instrument in the first row of each sensor.

    Where no preset is named, a value that equals the default counts as the default.
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
    """Return the value at a dotted key of a model, or the default at that key of a model's fields."""

    def step(block: Any, name: str) -> Any:
        return getattr(block, name) if isinstance(block, BaseModel) else block[name].get_default()

    return reduce(step, key.split("."), start)


def _shown(value: float | tuple[float, ...] | None) -> str:
    if value is None:
        return "–"
    return ", ".join(f"{number:g}" for number in (value if isinstance(value, tuple) else (value,)))
