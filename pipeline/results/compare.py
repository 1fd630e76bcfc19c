"""Two runs side by side: what was different in what went in, and whether the sonar's mount has moved.

Nothing is recomputed: both runs are read as they are. What cannot be compared is said, and never left out in silence.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.target import FACES, PLANES
from pipeline.artefacts.families import families_of, level_families
from pipeline.errors import ArtefactError
from pipeline.maths.comparison import Estimate, compare
from pipeline.maths.geometry.planes import angle_between
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS
from pipeline.results.screen import summary
from pipeline.run import manifest
from pipeline.run.output_files import as_written
from pipeline.run.results import Tables, agreeing, calibration
from pipeline.run.settings import Settings, read_settings, refuse_other

LEVEL = 0.01  # of the joint test: so many false alarms where nothing has moved
UNITS = ("deg",) * 3 + ("m",) * 3
SHOWN = {"deg": ("°", 1.0, 4), "m": (" mm", 1000.0, 2)}
PLACE = ("origin", "azimuth_deg", "water_level_m")  # of a target, not its shape
FACE_KEYS = "target.faces."
Row = dict[str, Any]


@dataclass(frozen=True)
class RunRead:
    """A run as it was written."""

    path: Path
    settings: Settings
    result: Mapping[str, Any]
    manifests: Mapping[str, manifest.Manifest]

    @classmethod
    def read(cls, path: Path, stages: tuple[str, ...]) -> "RunRead":
        if not path.is_dir():
            raise ArtefactError(f"{path}: there is no such folder; name a run folder")
        refuse_other(path, "mbes")
        for stage in stages:
            if manifest.read(path / stage) is None:
                raise ArtefactError(f"{path}: {stage} has no complete result; run poolcal run again")
        found = agreeing(path, stages)
        for stage in stages:
            if stage not in found:
                raise ArtefactError(f"{path}: {stage} was made from other settings or results; run poolcal run again")
        result = calibration(path)
        with as_written(path):
            estimate_of(result)
            for name in ("inputs", "software"):
                manifest.flattened(result[name])
            summary(result)  # with --rrd
        return cls(path, read_settings(path), result, found)


def estimate_of(result: Mapping[str, Any]) -> Estimate | None:
    """The adjustment's, from calibration.json: the patent's forms have no covariance to test with."""
    block = result["methods"]["adjustment"]
    if block["covariance"] is None or block["mount"] is None:
        return None
    shapes = {"R_body_from_mbes": (3, 3), "lever_arm_m": (3,), "covariance": (6, 6)}
    found = Estimate(*(np.array(block[name], dtype=np.float64).reshape(shape) for name, shape in shapes.items()))
    if not np.linalg.eigvalsh(found.covariance).min() > 0:
        raise ValueError("the covariance is not positive")
    return found


def diff(
    first: RunRead, second: RunRead, tolerance_deg: float | None = None, tolerance_mm: float | None = None
) -> dict[str, Any]:
    """Everything that differs, as plain values; ``second`` minus ``first``."""
    heads = [
        {"run": str(r.path), "session": r.result["session"], "verdict": r.result["verdict"]} for r in (first, second)
    ]
    found: dict[str, Any] = {"schema": 1, "a": heads[0], "b": heads[1]}
    found["config"] = list(_changes(first.settings.as_json(), second.settings.as_json()))
    found["inputs"] = list(_changes(first.result["inputs"], second.result["inputs"]))
    found["software"] = list(_changes(first.result["software"], second.result["software"]))
    found["counts"] = list(_counts(first, second))
    found["not_compared"] = []
    found |= _mount(first, second, found["not_compared"], tolerance_deg, tolerance_mm)
    rejected = [key for key in ("a", "b") if found[key]["verdict"] == "rejected"]
    # values that must not be used answer nothing, unless they are the same
    found["answered"] = found["comparable"] and (not rejected or first_is_second(found))
    found["planes"] = list(_planes(first, second, found["not_compared"]))
    found["sentence"] = sentence(found)
    return found


def is_moved(found: Mapping[str, Any]) -> bool:
    """Whether the answer is no: significantly different, beyond a tolerance, or not to be told."""
    return not found["answered"] or found["joint"]["significant"] or bool(found["beyond_tolerance"])


# --- what went in ----------------------------------------------------------------------------------------------------
def _changes(first: Mapping[str, Any], second: Mapping[str, Any]) -> Iterator[Row]:
    one, other = manifest.flattened(first), manifest.flattened(second)
    for key in sorted(one.keys() | other.keys()):
        if one.get(key) != other.get(key):
            yield {"key": key, "a": one.get(key), "b": other.get(key)}


def _counts(first: RunRead, second: RunRead) -> Iterator[Row]:
    for stage in first.manifests:
        one, other = (
            {(c["source"], c["reason"]): c["count"] for c in run.manifests[stage].counts} for run in (first, second)
        )
        for source, reason in sorted(one.keys() | other.keys()):
            a, b = one.get((source, reason), 0), other.get((source, reason), 0)
            if a != b:
                yield {"stage": stage, "source": source, "reason": reason, "a": a, "b": b}


# --- the mount -------------------------------------------------------------------------------------------------------
def _mount(
    first: RunRead, second: RunRead, missing: list[str], tolerance_deg: float | None, tolerance_mm: float | None
) -> dict[str, Any]:
    one, other = estimate_of(first.result), estimate_of(second.result)
    if one is None or other is None:
        which = [run.result["session"] for run, e in ((first, one), (second, other)) if e is None]
        missing.append(f"mount: {' and '.join(which)} has no result with a covariance")
        return {"comparable": False, "parameters": [], "joint": None, "beyond_tolerance": []}
    found = compare(one, other)
    moved = found.moved(LEVEL)
    scale = [np.degrees(1.0)] * 3 + [1.0] * 3
    limits = [tolerance_deg] * 3 + [None if tolerance_mm is None else tolerance_mm / 1000] * 3
    rows: list[Row] = []
    beyond = []
    for _, k, *_ in PARAMETERS:
        name = MOUNT_WORDS[k]
        difference = float(found.difference[k] * scale[k])
        limit = limits[k]
        if limit is not None and abs(difference) > limit:
            beyond.append(name)
        rows.append(
            {
                "parameter": name,
                "unit": UNITS[k],
                "difference": difference,
                "sigma": float(found.sigma[k] * scale[k]),
                "z": float(found.z[k]),
                "moved": k in moved,
            }
        )
    joint = {
        "statistic": found.statistic,
        "dof": 6,
        "probability": found.probability,
        "level": LEVEL,
        "significant": found.probability < LEVEL,
    }
    return {"comparable": True, "parameters": rows, "joint": joint, "beyond_tolerance": beyond}


# --- planes ----------------------------------------------------------------------------------------------------------
def _planes(first: RunRead, second: RunRead, missing: list[str]) -> Iterator[Row]:
    """Each family's plane over all passes in its own target frame; the sonar's are those with the coarse mount."""
    one, other = (run.settings.pool.target.model_dump(mode="json") for run in (first, second))
    shape = [name for name in (one | other) if name not in PLACE]
    differing = [name for name in shape if one.get(name) != other.get(name)]
    if differing:
        missing.append(f"planes: the targets differ ({', '.join(f'target.{name}' for name in differing)})")
        return
    tables = []
    faces = Tables(first.path).table(FACES)
    upright = [name for name in families_of(faces.loc[faces["one_plane"]]) if name not in level_families(faces)]
    for run in (first, second):
        rows = Tables(run.path).table(PLANES).query("`pass` == -1").to_dict("records")
        tables.append({(row["sensor"], row["plane"]): row for row in rows})
    same_mount = first.settings.session.sonar.mount == second.settings.session.sonar.mount
    if not same_mount:
        missing.append("planes of the sonar: they were placed with different coarse mounts")
    for sensor in ("laser", "mbes") if same_mount else ("laser",):
        for family in upright:
            key = (sensor, family)
            if not all(key in table for table in tables):
                missing.append(f"planes: {family} of {sensor} is not in both")
                continue
            a, b = (table[key] for table in tables)
            one_n, other_n = (np.array([float(row[f"normal_{axis}_target_1"]) for axis in "xyz"]) for row in (a, b))
            angle = float(np.degrees(angle_between(one_n, other_n)))
            shift, rms = float(b["distance_m"] - a["distance_m"]), float(b["rms_m"] - a["rms_m"])
            if angle or shift or rms:
                yield {"sensor": sensor, "plane": family, "angle_deg": angle, "distance_m": shift, "rms_m": rms}


# --- words -----------------------------------------------------------------------------------------------------------
def shown(value: float, unit: str, sign: str = "+") -> str:
    suffix, scale, digits = SHOWN[unit]
    return f"{value * scale:{sign}.{digits}f}{suffix}"


def _with_sigma(row: Row) -> str:
    return f"{row['parameter']} by {shown(row['difference'], row['unit'])} ± {shown(row['sigma'], row['unit'], '')}"


def _listed(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)


def first_is_second(found: Mapping[str, Any]) -> bool:
    return found["comparable"] and not any(row["difference"] for row in found["parameters"])


def sentence(found: Mapping[str, Any]) -> str:
    """The answer in one sentence."""
    rejected = [f"{k} ({found[k]['session']}) was rejected" for k in ("a", "b") if found[k]["verdict"] == "rejected"]
    if rejected and first_is_second(found):
        return f"the same result in both; {_listed(rejected)}"
    if rejected:
        return f"no answer: {_listed(rejected)}, and what must not be used cannot be compared"
    if not found["comparable"]:
        return f"no answer: {found['not_compared'][0]}"
    moved = [row for row in found["parameters"] if row["moved"]]
    chance = f"p = {found['joint']['probability']:.2g}"
    if moved:
        each = [_with_sigma(row) for row in moved]
        rest = "" if len(moved) == len(MOUNT_WORDS) else "; the rest within noise"
        text = f"the sonar has moved, {_listed(each)}: significant ({chance}){rest}"
    elif first_is_second(found):
        text = "the same result in both"
    else:
        text = f"nothing has moved: all six differences are within their noise ({chance})"
    if found["beyond_tolerance"]:
        text += f"; beyond the tolerance: {_listed(found['beyond_tolerance'])}"
    return text


