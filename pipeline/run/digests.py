"""Digests (SHA-256) of files, remembered between runs. A file is hashed again only if its size or a time differs."""

import json
from collections.abc import Iterable
from pathlib import Path

from pipeline.artefacts.streams import Mapper, serial
from pipeline.atomic_files import read_json, sha256, write_text
from pipeline.errors import ArtefactError


class Digests:
    """The digest of each file, remembered with the file's size and times, so that large raw files are hashed once."""

    def __init__(self, memory: Path | None, mapper: Mapper = serial) -> None:
        self._memory = memory
        self.mapper = mapper
        self._known: dict[str, list[object]] = _read_memory(memory) if memory is not None else {}

    def of(self, paths: Iterable[Path]) -> list[str]:
        """Return the digests of ``paths``, in their order. New and changed files are hashed in parallel."""
        absolute = [path.absolute() for path in paths]
        marks = {path: _mark(path) for path in absolute}
        stale = [path for path, mark in marks.items() if self._known.get(str(path), [None])[1:] != mark]
        for path, digest in zip(stale, self.mapper(sha256, stale), strict=True):
            self._known[str(path)] = [digest, *marks[path]]
        if stale and self._memory is not None:
            write_text(self._memory, json.dumps(self._known, indent=0, sort_keys=True) + "\n")
        return [str(self._known[str(path)][0]) for path in absolute]


def _mark(path: Path) -> list[object]:
    try:
        status = path.stat()
    except OSError as error:
        raise ArtefactError(f"{path}: cannot be read ({error.strerror}); correct this and run again") from error
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns]


def _read_memory(path: Path) -> dict[str, list[object]]:
    """Return the remembered entries by path. A damaged file gives none, because the memory only saves time."""
    try:
        content = read_json(path)
    except (OSError, ValueError):
        return {}
    if not isinstance(content, dict):
        return {}
    return {name: entry for name, entry in content.items() if isinstance(entry, list) and len(entry) == 4}
