"""A run's target where the config leaves it to be found: it is found once, and remembered in the run folder."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from pipeline.artefacts.streams import Stream
from pipeline.atomic_files import read_json, write_text
from pipeline.config.found import Found
from pipeline.config.session import SessionConfig
from pipeline.finding.find import find_place
from pipeline.finding.place import FoundPlace
from pipeline.finding.pool_file import pool_yaml
from pipeline.readers.dispatch import raw_parts
from pipeline.run import folder, provenance
from pipeline.run.digests import Digests
from pipeline.run.freshness import raw_digests
from pipeline.run.progress import Progress
from pipeline.run.settings import refuse_shared_folder
from pipeline.run.workers import Workers

FINDS = ("pipeline.finding.find", "pipeline.finding.pool_file", "pipeline.readers.dispatch")


def place_in(session_folder: Path, session: SessionConfig, depth_m: float, workers: Workers) -> FoundPlace:
    """Return the target that a session's laser points show, its faces continued to a depth below the water."""
    ins, laser = (
        Stream(raw_parts(name, getattr(session, name), session_folder), workers.map, workers.here)
        for name in ("ins", "laser")
    )
    return find_place(ins, laser, session, depth_m)


def found_target(session_folder: Path, session: SessionConfig, wanted: Found, workers: Workers) -> Mapping[str, Any]:
    """Return the content of a pool's file with that target."""
    place = place_in(session_folder, session, wanted.depth_m, workers)
    found: Mapping[str, Any] = yaml.safe_load(pool_yaml(place, wanted.gaps))
    return found


def remembered_target(
    run: Path,
    stages: Sequence[str],
    session_folder: Path,
    session: SessionConfig,
    wanted: Found,
    *,
    workers: Workers,
    progress: Progress,
) -> Mapping[str, Any]:
    """Return the same from the memory in a run folder, if nothing has changed on which it depends.

    Parameters
    ----------
    run, stages
        The run folder, and the names of its stages.
    session_folder, session, wanted
        The session's folder and settings, and the target's.
    workers, progress
        Workers, and the display of the progress.
    """
    refuse_shared_folder(run, session_folder)
    with folder.locked(run, stages):
        digests, memory = Digests(run.absolute() / folder.DIGESTS, workers.here), run / folder.FOUND
        depends = {
            "raw": [raw_digests(digests, session_folder, name, getattr(session, name)) for name in ("ins", "laser")],
            "settings": [one.model_dump(mode="json") for one in (session.ins, session.laser)],
            "depth_m": wanted.depth_m,
            "gaps": wanted.gaps,
            "source": provenance.digests_of(*FINDS),
            "libraries": provenance.library_versions(),
        }
        key = hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()
        found = _remembered(memory, key)
        if found is None:
            with progress.shown("finding the target in the laser's points"):
                found = found_target(session_folder, session, wanted, workers)
            write_text(memory, json.dumps({"key": key, "found": found}, indent=1) + "\n")
        return found


def _remembered(path: Path, key: str) -> Mapping[str, Any] | None:
    """Return the target in a memory with this key; None if there is none, or a damaged one."""
    try:
        content = read_json(path)
    except (OSError, ValueError):
        return None
    found = content.get("found") if isinstance(content, dict) and content.get("key") == key else None
    return found if isinstance(found, dict) and {"target", "as_built"} <= found.keys() else None
