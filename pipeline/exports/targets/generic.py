"""JSON, YAML and CSV of poolcal's own: settings, matrices, quaternions, covariance, on INS and vessel."""

import csv
import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import pipeline
from pipeline.config.yaml_file import content_of
from pipeline.errors import ConfigError
from pipeline.exports.convention import SFU, Convention
from pipeline.exports.explanation import explanation, heading
from pipeline.exports.json_text import json_of
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, whole_lines
from pipeline.exports.source import mount_of_settings
from pipeline.exports.target import Options, Target
from pipeline.maths.geometry.rotations import quaternion_from_rotation
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.mount import Mounted

FORMAT, VERSION = "poolcal mount", 1
STEM = "vessel.mount."  # of the keys in CSV that are read back
Content = dict[str, Any]


def content(target: Target, mounting: Mounting, options: Options) -> Content:
    """Return the content of a file. Its last key says that it is whole."""
    vessel, origin = mounting.vessel, mounting.origin
    about = [*heading(target, mounting), *explanation(target, mounting, options)]
    result: Content = {"format": FORMAT, "version": VERSION, "software": f"poolcal {pipeline.__version__}"}
    if origin.rejected is not None:
        result |= {"rejected": True, "reasons": list(origin.rejected)}
    result |= {
        "sensor": mounting.sensor,
        "session": origin.session,
        "run": origin.run,
        "mount": mounting.body.settings(),
        **_forms(mounting.body, "body", mounting.sensor),
        "latency_s": mounting.latency_s,
    }
    if mounting.covariance is not None:
        result |= {
            "sigma": mounting.body.sigmas(mounting.covariance),
            "covariance": mounting.covariance.tolist(),
            "covariance_of": "rotation about body x, y, z (rad), lever arm x, y, z (m); total, one sigma",
        }
    result["vessel"] = {
        "ins_point_m": list(mounting.frame.ins_point_m),
        "ins_turn_deg": list(mounting.frame.ins_turn_deg),
        "mount": vessel.settings(),
        **_forms(vessel, "vessel", mounting.sensor),
    }
    return result | {"about": about, "complete": True}


def _forms(mounted: Mounted, frame: str, sensor: str) -> Content:
    return {
        f"R_{frame}_from_{sensor}": mounted.R_body_from_sensor.tolist(),
        "quaternion_wxyz": quaternion_from_rotation(mounted.R_body_from_sensor).tolist(),
        "position_m": mounted.lever_arm_body_m.tolist(),
    }


def mount_of_content(found: Mapping[str, Any], where: str) -> Mounted:
    """Return the mount in the frame of the vessel that a file states, or in the INS's own; ``where``: the file."""
    if found.get("format") != FORMAT or found.get("version") != VERSION:
        raise ConfigError(f"{where}: is no {FORMAT!r} of version {VERSION}; export it again")
    if found.get("complete") not in (True, "True"):
        raise ConfigError(f"{where}: has no 'complete' at its end: it was cut off; export it again")
    vessel = found.get("vessel")
    settings = vessel.get("mount") if isinstance(vessel, dict) else None
    if not isinstance(settings, dict) or set(settings) != set(SETTINGS):
        raise ConfigError(f"{where}: vessel.mount must have {', '.join(SETTINGS)}; export it again")
    return mount_of_settings({key: number(settings[key], f"vessel.mount.{key}", where) for key in SETTINGS})


def stated_in(target: Target, text: str, where: str) -> tuple[str | None, np.ndarray | None]:
    """Return the sensor and the covariance (6, 6) that a file of these forms states; None: it does not.

    Parameters
    ----------
    target
        The target; of other forms nothing is known.
    text, where
        The file's text, and its name for messages.
    """
    if target.name not in _TREES:
        return None, None
    found = _TREES[target.name](text, where)
    sensor, rows = found.get("sensor"), found.get("covariance")
    if sensor not in ("mbes", "laser"):
        raise ConfigError(f"{where}: sensor = {sensor!r}: must be mbes or laser; export it again")
    if rows is None:
        return str(sensor), None
    try:
        return str(sensor), np.array(rows, dtype=np.float64).reshape(6, 6)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{where}: covariance: must have six rows of six numbers; export it again") from error


def _write_json(target: Target, mounting: Mounting, options: Options) -> str:
    return json.dumps(content(target, mounting, options), indent=1, ensure_ascii=False) + "\n"


def _write_yaml(target: Target, mounting: Mounting, options: Options) -> str:
    return yaml.safe_dump(content(target, mounting, options), sort_keys=False, allow_unicode=True, width=10_000)


def _yaml_tree(text: str, where: str) -> Content:
    whole_lines(text, where)
    return content_of(text, Path(where))


def _write_csv(target: Target, mounting: Mounting, options: Options) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("key", "value"))
    writer.writerows(_flat(content(target, mounting, options), ""))
    return stream.getvalue()


def _flat(values: Mapping[str, Any], stem: str) -> list[tuple[str, str]]:
    """Return mappings and lists as rows of dotted keys; a row of a matrix stands in one cell, separated by blanks."""
    rows: list[tuple[str, str]] = []
    for key, value in values.items():
        if isinstance(value, dict):
            rows += _flat(value, f"{stem}{key}.")
        elif isinstance(value, list) and value and not isinstance(value[0], (int, float)):
            lines = [" ".join(map(str, line)) if isinstance(line, list) else str(line) for line in value]
            rows += [(f"{stem}{key}.{place}", line) for place, line in enumerate(lines)]
        else:
            rows.append((f"{stem}{key}", " ".join(map(str, value)) if isinstance(value, list) else str(value)))
    return rows


def _csv_tree(text: str, where: str) -> Content:
    """Return the rows as :func:`content` has them, as far as they are read back."""
    whole_lines(text, where)
    try:
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except csv.Error as error:
        raise ConfigError(f"{where}: is no valid CSV ({error}); export it again") from error
    cells: dict[str, str] = {}
    for row in rows:
        if len(row) != 2 or row[0] in cells:
            raise ConfigError(f"{where}: {','.join(row)[:80]!r}: must be a key, once, and its value; export it again")
        cells[row[0]] = row[1]
    mount = {key.removeprefix(STEM): value for key, value in cells.items() if key.startswith(STEM)}
    found: Content = {**cells, "vessel": {"mount": mount}}
    found["version"] = int(cells["version"]) if cells.get("version", "").isdecimal() else None
    matrix = [value.split() for key, value in cells.items() if key.startswith("covariance.")]
    return found | ({"covariance": matrix} if matrix else {})


def _read(target: Target, text: str, where: str, _: Options) -> Mounted:
    return mount_of_content(_TREES[target.name](text, where), where)


_TREES: dict[str, Callable[[str, str], Content]] = {"json": json_of, "yaml": _yaml_tree, "csv": _csv_tree}
CONVENTION = Convention(SFU, (1, 1, 1), "YPR", "code", "poolcal's CONVENTIONS.md")
JSON = Target("json", "poolcal, for programs", "all of the mount", ".json", CONVENTION, _write_json, _read)
YAML = Target("yaml", "poolcal, for programs", "all of the mount", ".yaml", CONVENTION, _write_yaml, _read)
CSV = Target("csv", "poolcal, for spreadsheets", "all of the mount", ".csv", CONVENTION, _write_csv, _read)
