"""The difference of two runs as text for the screen."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pipeline.artefacts.counts import sensor_of
from pipeline.console import plural
from pipeline.language.chosen import translated
from pipeline.results.answer_text import answer_lines
from pipeline.results.mount_difference import Row
from pipeline.results.units import quantity_text
from pipeline.text_table import text_table

FACE_KEYS = "target.faces."


def difference_text(difference: Mapping[str, Any]) -> str:
    """Return the difference as text for the screen, the answer first. Values that are equal in both are not listed."""
    heads = difference.get("heads", [])
    if heads:
        lines = [line for head in heads for line in (f"{head['name']}:", *(f"  {one}" for one in answer_lines(head)))]
    else:
        lines = list(answer_lines(difference))
    lines.append("")
    lines += [
        f"{key}: {difference[key]['session']} ({translated(difference[key]['verdict'])}), {difference[key]['run']}"
        for key in ("a", "b")
    ]
    for head in heads or [difference]:
        if any(row["difference"] for row in head["parameters"]):
            lines += ["", *_parameter_table(head["parameters"], head.get("name", "mount"))]
    inputs = difference["inputs"]
    if inputs:
        new, gone = (sum(row[key] is None for row in inputs) for key in ("a", "b"))
        lines += ["", f"raw files: {len(inputs) - new - gone} changed, {new} in b alone, {gone} in a alone"]
    for title, key in (("config and session", "config"), ("software", "software")):
        if difference[key]:
            rows = own_faces_counted(difference[key])
            lines += ["", f"{title}:", *(f"  {row['key']}: {_brief(row['a'])} -> {_brief(row['b'])}" for row in rows)]
    if difference["counts"]:
        lines += ["", "counts:"]
        lines += [
            f"  {row['stage']}, {sensor_of(row['source'])}, {row['reason']}: {row['a']:,} -> {row['b']:,}"
            for row in difference["counts"]
        ]
    if difference["planes"]:
        lines += ["", *_plane_table(difference["planes"])]
    why = [one for head in heads or [difference] for one in head["not_compared"]]
    lines += [f"not compared: {one}" for one in dict.fromkeys(why)]
    return "\n".join(lines)


def _plane_table(planes: Sequence[Row]) -> list[str]:
    rows = [
        (
            f"  {row['sensor']} {row['plane']}",
            quantity_text(row["angle_deg"], "deg", ""),
            quantity_text(row["distance_m"], "m"),
            quantity_text(row["rms_m"], "m"),
        )
        for row in planes
    ]
    return text_table("<16>12>14>14", ("planes, b - a", "turned", "distance", "rms"), rows)


def _parameter_table(parameters: Sequence[Row], title: str) -> list[str]:
    rows = [
        (
            f"  {row['parameter']}",
            quantity_text(row["difference"], row["unit"]),
            quantity_text(row["sigma"], row["unit"], ""),
            f"{row['z']:.1f}",
            quantity_text(row["detectable"], row["unit"], ""),
            "moved" if row["moved"] else "",
        )
        for row in parameters
    ]
    heads = (f"{title}, b - a", "difference", "sigma", "in sigmas", "found from")
    return text_table("<16>14>14>12>14  <1", heads, rows)


def own_faces_counted(changes: Sequence[Row]) -> Iterator[Row]:
    """Yield the changes of settings; one row has the numbers of faces that only one run has, in place of their keys."""
    faces = [row for row in changes if row["key"].startswith(FACE_KEYS) and row["key"].endswith(".corners")]
    own = {
        key: [row["key"].removesuffix("corners") for row in faces if row[other] is None] for key, other in ("ab", "ba")
    }
    for row in changes:
        if not row["key"].startswith((*own["a"], *own["b"])):
            yield row
    if own["a"] or own["b"]:
        counts = {key: f"{plural(len(names), 'face')} of its own" for key, names in own.items()}
        yield {"key": FACE_KEYS[:-1]} | counts


def _brief(value: Any) -> str:
    if value is None:
        return "-"
    written = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return written if len(written) <= 24 else f"{written[:12]}..."
