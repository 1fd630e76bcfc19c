"""A comparison of two runs as text for the screen."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pipeline.console import plural
from pipeline.results.compare import FACE_KEYS, Row, shown
from pipeline.text_table import text_table


def text(found: Mapping[str, Any]) -> str:
    """The whole comparison for the screen; what does not differ is not listed."""
    lines = [f"{key}: {found[key]['session']} ({found[key]['verdict']}), {found[key]['run']}" for key in ("a", "b")]
    if found["inputs"]:
        new, gone = (sum(row[key] is None for row in found["inputs"]) for key in ("a", "b"))
        lines += ["", f"raw files: {len(found['inputs']) - new - gone} changed, {new} in b alone, {gone} in a alone"]
    for title, key in (("config and session", "config"), ("software", "software")):
        if found[key]:
            rows = folded(found[key])
            lines += ["", f"{title}:", *(f"  {row['key']}: {_brief(row['a'])} -> {_brief(row['b'])}" for row in rows)]
    if found["counts"]:
        lines += ["", "counts:"]
        lines += [f"  {r['stage']}, {r['source']}, {r['reason']}: {r['a']:,} -> {r['b']:,}" for r in found["counts"]]
    if found["planes"]:
        planes = [
            (
                f"  {row['sensor']} {row['plane']}",
                shown(row["angle_deg"], "deg", ""),
                shown(row["distance_m"], "m"),
                shown(row["rms_m"], "m"),
            )
            for row in found["planes"]
        ]
        lines += ["", *text_table("<16>12>14>14", ("planes, b - a", "turned", "distance", "rms"), planes)]
    if any(row["difference"] for row in found["parameters"]):
        parameters = [
            (
                f"  {row['parameter']}",
                shown(row["difference"], row["unit"]),
                shown(row["sigma"], row["unit"], ""),
                f"{row['z']:.1f}",
                "moved" if row["moved"] else "",
            )
            for row in found["parameters"]
        ]
        lines += ["", *text_table("<16>14>14>12  <1", ("mount, b - a", "difference", "sigma", "in sigmas"), parameters)]
    lines += [f"not compared: {why}" for why in found["not_compared"]]
    return "\n".join([*lines, "", found["sentence"] + "."])


def folded(rows: Sequence[Row]) -> Iterator[Row]:
    """For people: faces that only one of the runs has are counted in place of their keys."""
    faces = [row for row in rows if row["key"].startswith(FACE_KEYS) and row["key"].endswith(".corners")]
    alone = {key: [r["key"].removesuffix("corners") for r in faces if r[other] is None] for key, other in ("ab", "ba")}
    for row in rows:
        if not row["key"].startswith((*alone["a"], *alone["b"])):
            yield row
    if alone["a"] or alone["b"]:
        own = {key: f"{plural(len(names), 'face')} of its own" for key, names in alone.items()}
        yield {"key": FACE_KEYS[:-1]} | own


def _brief(value: Any) -> str:
    if value is None:
        return "-"
    written = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return written if len(written) <= 24 else f"{written[:12]}..."
