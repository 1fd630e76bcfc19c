"""The difference of two runs: of their settings, inputs and results, and whether the sonar's mount has moved.

Both runs are read as they were written; none of their results is recomputed. Results that cannot be compared are named.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.target import FACES, PLANES
from pipeline.artefacts.from_tables import family_names, horizontal_families, normal_of
from pipeline.errors import ConfigError
from pipeline.maths.geometry.planes import angle_between
from pipeline.results.answer_text import answer_sentence, visible_sentence
from pipeline.results.finished_run import FinishedRun
from pipeline.results.mount_difference import Row, is_same_result, mount_difference
from pipeline.results.units import Tolerances
from pipeline.run import manifest

PLACE = ("origin", "azimuth_deg", "water_level_m", "water_by_time")  # not of its shape
NO_TOLERANCES = Tolerances()


def run_difference(first: FinishedRun, second: FinishedRun, tolerances: Tolerances = NO_TOLERANCES) -> dict[str, Any]:
    """Return all differences of two runs as plain values; numbers are ``second`` (b) minus ``first`` (a).

    Parameters
    ----------
    first, second
        The runs.
    tolerances
        A mount parameter with a larger difference is listed by name.
    """
    heads = [
        {"run": str(run.path), "session": run.result["session"], "verdict": run.result["verdict"]}
        for run in (first, second)
    ]
    difference: dict[str, Any] = {"schema": 1, "a": heads[0], "b": heads[1]}
    difference["config"] = list(_changes(_computed_with(first), _computed_with(second)))
    difference["inputs"] = list(_changes(first.result["inputs"], second.result["inputs"]))
    difference["software"] = list(_changes(first.result["software"], second.result["software"]))
    difference["counts"] = list(_count_changes(first, second))
    difference["not_compared"] = []
    difference |= mount_difference(first, second, tolerances, difference["not_compared"])
    rejected = [key for key in ("a", "b") if difference[key]["verdict"] == "rejected"]
    # a rejected run answers nothing, unless both runs have the same values
    difference["answered"] = difference["comparable"] and (not rejected or is_same_result(difference))
    if not difference["answered"]:
        difference["answer"] = "none"
    elif difference["answer"] == "too_uncertain" and not difference["inputs"]:
        difference["answer"] = "no_movement_shown"  # within one session nothing moves
    difference["planes"] = list(_plane_changes(first, second, difference["not_compared"]))
    difference["sentence"] = answer_sentence(difference)
    difference["visible"] = visible_sentence(difference)
    return difference


def difference_by_head(
    first: FinishedRun, second: FinishedRun, tolerances: Tolerances = NO_TOLERANCES
) -> dict[str, Any]:
    """Return the difference of two runs as :func:`run_difference`; of a sonar with several heads, head by head.

    The keys of the first head's difference are those of a single head. ``heads`` has that of every head, with its
    name; it is absent for a single head.

    Raises
    ------
    ConfigError
        The runs have different numbers of heads.
    """
    if first.heads != second.heads:
        names = [", ".join(run.heads) for run in (first, second)]
        raise ConfigError(
            f"the runs have different heads, {first.path} {names[0]}, and {second.path} {names[1]}; name two runs of "
            "the same sonar"
        )
    by_head = [
        {"name": head} | run_difference(first.of_head(head), second.of_head(head), tolerances) for head in first.heads
    ]
    difference = {key: value for key, value in by_head[0].items() if key != "name"}
    if len(by_head) == 1:
        return difference
    planes = [
        row | {"sensor": one["name"] if row["sensor"] == "mbes" else row["sensor"]}
        for one in by_head
        for row in one["planes"]
        if row["sensor"] == "mbes" or one is by_head[0]
    ]
    settings = list(_changes(_computed_with(first), _computed_with(second)))
    return difference | {"config": settings, "planes": planes, "heads": by_head}


def _computed_with(run: FinishedRun) -> dict[str, Any]:
    """Return the settings that a result depends on: all but ``about``, which only the certificate shows."""
    return {key: value for key, value in run.settings.as_json().items() if key != "about"}


def _changes(first: Mapping[str, Any], second: Mapping[str, Any]) -> Iterator[Row]:
    before, after = manifest.flattened(first), manifest.flattened(second)
    for key in sorted(before.keys() | after.keys()):
        if before.get(key) != after.get(key):
            yield {"key": key, "a": before.get(key), "b": after.get(key)}


def _count_changes(first: FinishedRun, second: FinishedRun) -> Iterator[Row]:
    for stage in first.manifests:
        before, after = (
            {(row["source"], row["reason"]): row["count"] for row in run.manifests[stage].counts}
            for run in (first, second)
        )
        for source, reason in sorted(before.keys() | after.keys()):
            a, b = before.get((source, reason), 0), after.get((source, reason), 0)
            if a != b:
                yield {"stage": stage, "source": source, "reason": reason, "a": a, "b": b}


def _plane_changes(first: FinishedRun, second: FinishedRun, not_compared: list[str]) -> Iterator[Row]:
    """Yield the differences of each family's planes, over all passes, each run in its own target frame.

    The sonar's planes are placed with the coarse mount. Sentences on planes that cannot be compared are added to
    ``not_compared``.
    """
    designs = [run.settings.pool.target.model_dump(mode="json") for run in (first, second)]
    shape = [name for name in (designs[0] | designs[1]) if name not in PLACE]
    differing = [name for name in shape if designs[0].get(name) != designs[1].get(name)]
    if differing:
        not_compared.append(f"planes: the targets differ ({', '.join(f'target.{name}' for name in differing)})")
        return
    tables = []
    faces = first.tables.table(FACES)
    upright = [name for name in family_names(faces.loc[faces["one_plane"]]) if name not in horizontal_families(faces)]
    for run in (first, second):
        rows = run.tables.table(PLANES).query("`pass` == -1").to_dict("records")
        tables.append({(row["sensor"], row["plane"]): row for row in rows})
    same_mount = first.settings.session.sonar.mount == second.settings.session.sonar.mount
    if not same_mount:
        not_compared.append("planes of the sonar: they were placed with different coarse mounts")
    for sensor in ("laser", "mbes") if same_mount else ("laser",):
        for family in upright:
            key = (sensor, family)
            if not all(key in table for table in tables):
                not_compared.append(f"planes: {family} of {sensor} is not in both")
                continue
            row = _plane_change(*(table[key] for table in tables))
            if any(row.values()):
                yield {"sensor": sensor, "plane": family, **row}


def _plane_change(a: Mapping[Any, Any], b: Mapping[Any, Any]) -> Row:
    normals = [normal_of(row) for row in (a, b)]
    return {
        "angle_deg": float(np.degrees(angle_between(*normals))),
        "distance_m": float(b["distance_m"] - a["distance_m"]),
        "rms_m": float(b["rms_m"] - a["rms_m"]),
    }
