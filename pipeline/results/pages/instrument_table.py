"""The report's table of instruments: what weighs the observations, and on whose word."""

from collections.abc import Mapping
from functools import reduce
from typing import Any

from pydantic import BaseModel

from pipeline.config.instruments import SENSORS, figures
from pipeline.config.session import Ins, Laser, Mbes, SessionConfig

Row = Mapping[str, Any]


def figures_used(session: SessionConfig) -> list[Row]:
    """A row a figure; sensor and instrument in the first row of each. Where no preset is named, a value that is the
    default counts as such."""
    rows: list[Row] = []
    for sensor, model in SENSORS.items():
        block: Ins | Laser | Mbes | None = getattr(session, sensor)
        if block is None:
            continue
        used = block.instrument
        for number, key in enumerate(figures(sensor)):
            value, default = _at(block, key), _at(model.model_fields, key)
            origin = used.origins.get(key, "default") if used else "default" if value == default else "session"
            rows.append(
                {
                    "sensor": "" if number else sensor,
                    "instrument": "" if number else used.title if used else "–",
                    "key": key,
                    "value": _shown(value),
                    "origin": origin,
                    "unverified": used is not None and origin == "preset" and key in used.unverified,
                }
            )
    return rows


def _at(start: Any, key: str) -> Any:
    """What stands at a dotted key of a model, or of a model's fields, that is the default."""

    def step(block: Any, name: str) -> Any:
        return getattr(block, name) if isinstance(block, BaseModel) else block[name].get_default()

    return reduce(step, key.split("."), start)


def _shown(value: float | tuple[float, ...] | None) -> str:
    if value is None:
        return "–"
    return ", ".join(f"{one:g}" for one in (value if isinstance(value, tuple) else (value,)))
