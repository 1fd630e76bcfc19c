"""Patterns of session.yaml that match some files of a folder, and no others."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path, PurePosixPath

from pipeline.readers.session_files import as_pattern


def patterns_for(names: Sequence[str], folder: Path) -> list[str]:
    """Return patterns that match these files alone, as few as may be.

    All files of a subfolder with the same suffix become one pattern, such as ``ins/*.gps``, if every file that this
    pattern matches is among them. Otherwise each becomes a pattern of its own.

    Parameters
    ----------
    names
        Paths in the session folder, with / between their parts.
    folder
        The session folder.
    """
    patterns: list[str] = []
    for (parent, suffix), group in groupby(sorted(names, key=_place), _place):
        together = list(group)
        where = "" if parent == "." else f"{as_pattern(parent)}/"
        pattern = f"{where}*{as_pattern(suffix)}"
        matched = {path.relative_to(folder).as_posix() for path in folder.glob(pattern)} if suffix else set()
        patterns += [pattern] if matched == set(together) else sorted(map(as_pattern, together))
    return patterns


def _place(name: str) -> tuple[str, str]:
    path = PurePosixPath(name)
    return str(path.parent), path.suffix
