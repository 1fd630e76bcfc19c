"""Sessions with presets of instruments: session.yaml and instruments/ in a folder, loaded."""

import json
from pathlib import Path
from typing import Any

import yaml

from pipeline.config.load import load_session
from pipeline.config.session import SessionConfig

MOUNT = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": -1.0}
FOREIGN = "<b>\"O'Brien\" & sons</b>"


def content(**blocks: dict[str, Any]) -> dict[str, Any]:
    """session.yaml; ``blocks``: more keys of a sensor."""
    plain: dict[str, dict[str, Any]] = {
        "ins": {"files": ["ins/*"], "format": "novatel"},
        "laser": {"files": ["laser/*"], "format": "las", "mount": MOUNT},
        "mbes": {"files": ["mbes/*"], "format": "r2sonic", "mount": MOUNT},
    }
    return {sensor: block | blocks.get(sensor, {}) for sensor, block in plain.items()}


def write(path: Path, values: dict[str, Any]) -> None:
    path.write_text(yaml.safe_dump(json.loads(json.dumps(values))), encoding="utf-8")  # copied: aliases are refused


def session(folder: Path, presets: dict[str, Any] | None = None, **blocks: dict[str, Any]) -> SessionConfig:
    (folder / "instruments").mkdir(exist_ok=True)
    for name, preset in (presets or {}).items():
        write(folder / "instruments" / f"{name}.yaml", preset)
    write(folder / "session.yaml", content(**blocks))
    return load_session(folder)
