"""The imports of source files, remembered from one run of the program to the next by the files' content."""

import json
import os
from pathlib import Path

Pairs = tuple[tuple[str, str], ...]


class KnownImports:
    """Imports by a key of the file's content, kept in one file.

    What cannot be read counts as nothing, and what cannot be written is not: then each run reads the sources. Of two
    processes that write at once one wins, and the other's are found anew next time.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known: dict[str, Pairs] | None = None
        self._is_new = False

    def get(self, key: str) -> Pairs | None:
        """Return what was remembered under a key, or None."""
        return self._all().get(key)

    def put(self, key: str, pairs: Pairs) -> None:
        """Remember pairs."""
        self._all()[key] = pairs
        self._is_new = True

    def keep(self) -> None:
        """Write what is new."""
        if not self._is_new:
            return
        self._is_new = False
        beside = self._path.with_name(f"{self._path.name}.{os.getpid()}")
        try:
            beside.write_text(json.dumps(self._all(), sort_keys=True), encoding="utf-8")
            beside.replace(self._path)
        except OSError:
            beside.unlink(missing_ok=True)

    def _all(self) -> dict[str, Pairs]:
        if self._known is None:
            try:
                content = json.loads(self._path.read_text(encoding="utf-8"))
                self._known = {
                    str(key): tuple((str(base), str(word)) for base, word in pairs) for key, pairs in content.items()
                }
            except (OSError, ValueError, TypeError, AttributeError):
                self._known = {}
        return self._known
