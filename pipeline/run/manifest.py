"""A stage's manifest: what the result depends on, its files, and the reasons why it is out of date.

A result is current if a new run would use the same settings, the same content of inputs, the same source files of this
program and the same versions of libraries, and if the result's own files are unchanged. Times are never compared.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pipeline.atomic_files import read_json, write_text

NAME = "manifest.json"
SCHEMA = 1


@dataclass(frozen=True)
class Key:
    """Everything that a stage's result depends on."""

    config: Mapping[str, Any]  # by field of the stage's Config
    raw: Mapping[str, str]  # digest by raw file; names relative to the session folder
    inputs: Mapping[str, str]  # digest by artefact, "owner/name"
    source: Mapping[str, str]  # digest by file of this program
    versions: Mapping[str, str]


@dataclass(frozen=True)
class Manifest:
    """What one run of a stage read and wrote."""

    stage: str
    key: Key
    outputs: Mapping[str, Mapping[str, Any]]  # sha256 and bytes, by file in the folder
    rows: Mapping[str, int]  # by artefact
    counts: list[dict[str, Any]]  # numbers of records by source and reason; "used" is one of the reasons
    git_commit: str | None
    wall_s: float

    def write(self, folder: Path) -> None:
        """Write the manifest into a stage's folder."""
        content = {"schema": SCHEMA, **asdict(self)}
        write_text(folder / NAME, json.dumps(content, indent=1, ensure_ascii=True) + "\n")


def read_manifest(folder: Path) -> Manifest | None:
    """Return the manifest in ``folder``; None if it is missing, damaged or of another schema."""
    try:
        content: Any = read_json(folder / NAME)
        if content.pop("schema") != SCHEMA:
            return None
        manifest = Manifest(**content | {"key": Key(**content["key"])})
        plain = (manifest.key.config, manifest.key.raw, manifest.key.inputs, manifest.key.source, manifest.key.versions)
        good = all(isinstance(m, dict) for m in (*plain, manifest.rows, manifest.outputs))
        good = good and all(isinstance(rows, int) for rows in manifest.rows.values()) and _are_counts(manifest.counts)
        return manifest if good and all(_is_file(*item) for item in manifest.outputs.items()) else None
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None


def _are_counts(counts: Any) -> bool:
    of = {"source": str, "reason": str, "count": int}
    rows = isinstance(counts, list) and all(isinstance(row, dict) for row in counts)
    return rows and all(isinstance(row.get(key), kind) for row in counts for key, kind in of.items())


def _is_file(name: str, entry: Any) -> bool:
    inside = not Path(name).is_absolute() and ".." not in Path(name).parts
    return inside and isinstance(entry, dict) and isinstance(entry.get("sha256"), str)


def artefact_digests(outputs: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return one digest for each table, document and stream. A stream's digest covers its parts' names and digests.

    >>> sorted(artefact_digests({"a.parquet": {"sha256": "1"}, "s/part-00000-000.parquet": {"sha256": "2"}}))
    ['a.parquet', 's']
    """
    streams: dict[str, Any] = {}
    digests: dict[str, str] = {}
    for name, entry in sorted(outputs.items()):
        stream, _, part = name.rpartition("/")
        if stream:
            streams.setdefault(stream, hashlib.sha256()).update(f"{part} {entry['sha256']}\n".encode())
        else:
            digests[name] = str(entry["sha256"])
    return digests | {name: digest.hexdigest() for name, digest in streams.items()}


def consistent(manifests: Mapping[str, Manifest]) -> bool:
    """Return whether each stage was made from the present artefacts of the others."""
    present = {name: artefact_digests(result.outputs) for name, result in manifests.items()}

    def is_present(name: str, digest: str) -> bool:
        owner, _, artefact = name.partition("/")
        if artefact.count("/"):  # of a further head, whose run is looked at by itself
            return True
        digests = present.get(owner, {})
        return digest == digests.get(f"{artefact}.parquet", digests.get(artefact))

    return all(is_present(*item) for result in manifests.values() for item in result.key.inputs.items())


# --- reasons ---------------------------------------------------------------------------------------------------------
def reasons_out_of_date(old: Manifest, key: Key, digests: Mapping[str, str | None]) -> list[str]:
    """Return the reasons why a result is out of date; an empty list if it is current.

    Parameters
    ----------
    old
        The result's manifest.
    key
        The key that a new result would have.
    digests
        The present digests of the result's files by name; None for a missing file.
    """
    written = {name: entry["sha256"] for name, entry in old.outputs.items()}
    return [
        *_file_changes(written, digests, "its result ", "edited"),
        *_value_changes(flattened(old.key.config), flattened(key.config)),
        *_file_changes(old.key.raw, key.raw, "", "changed"),
        *_file_changes(old.key.inputs, key.inputs, "its input ", "changed"),
        *_source_changes(old.key.source, key.source),
        *_value_changes(old.key.versions, key.versions),
    ]


def _file_changes(old: Mapping[str, Any], new: Mapping[str, Any], what: str, verb: str) -> Iterator[str]:
    for name in sorted(old.keys() | new.keys()):
        if old.get(name) == new.get(name):
            continue
        word = "is new" if name not in old else "is gone" if new.get(name) is None else f"was {verb}" if what else verb
        yield f"{what}{name} {word}"


def _value_changes(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    for name in sorted(old.keys() | new.keys()):
        before, after = (_shown(values.get(name, "(none)")) for values in (old, new))
        if old.get(name, "(none)") != new.get(name, "(none)"):
            yield f"{name} {before} -> {after}"


def _source_changes(old: Mapping[str, str], new: Mapping[str, str]) -> Iterator[str]:
    changed = sorted(name for name in old.keys() | new.keys() if old.get(name) != new.get(name))
    if changed:
        more = f" and {len(changed) - 1} more" if len(changed) > 1 else ""
        yield f"poolcal changed ({changed[0]}{more})"


def _shown(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def flattened(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return nested values on one level, with their keys joined by dots.

    >>> flattened({"segment": {"margin_m": 0.05}})
    {'segment.margin_m': 0.05}
    """
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping) and value:
            flat |= flattened(value, f"{prefix}{name}.")
        else:
            flat[f"{prefix}{name}"] = value
    return flat
