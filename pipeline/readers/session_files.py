"""The files in the session folder that match the patterns of session.yaml."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path, PurePosixPath

from pipeline.errors import ConfigError, RawDataError


@dataclass(frozen=True, order=True)
class SessionFile:
    """A raw file: its path in the session folder (with / as separator), and its full path."""

    name: str
    path: Path


def as_pattern(name: str) -> str:
    """Return the pattern that matches the file of this name alone.

    >>> as_pattern("ins/pass [1].gps")
    'ins/pass [[]1].gps'
    """
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


def files_matching(folder: Path, patterns: Sequence[str], key: str) -> list[SessionFile]:
    """Return the files that match, each once, in order of their names.

    Parameters
    ----------
    folder
        The session folder.
    patterns
        Glob patterns relative to the folder. A file that matches under several names (links) counts once, under the
        first of them.
    key
        The key of session.yaml that holds the patterns, for the messages.

    Raises
    ------
    RawDataError
        The folder does not exist or cannot be read, a pattern matches no file, or a symbolic link leads to a file
        outside the folder.
    ConfigError
        A pattern is not valid.
    """
    if not folder.is_dir():
        raise RawDataError(f"{folder}: the session folder is gone; put it back, or name its new place")
    path_by_target: dict[Path, Path] = {}
    for pattern in patterns:
        matches = _matches(folder, pattern, key)
        if not matches:
            raise RawDataError(f"session.yaml: {key}: {pattern!r} matches no file in {folder}; correct the pattern")
        for path, target in matches:
            path_by_target[target] = min(path, path_by_target.get(target, path))
    return sorted(SessionFile(path.relative_to(folder).as_posix(), path) for path in path_by_target.values())


def _matches(folder: Path, pattern: str, key: str) -> list[tuple[Path, Path]]:
    """Return the regular files that match, each with its resolved path."""
    matches = []
    try:
        root = folder.resolve()
        for path in folder.glob(pattern):
            if not path.is_file():
                continue
            target = path.resolve()
            if not target.is_relative_to(root):
                raise RawDataError(f"{path}: leads out of the session folder, to {target}; copy the file into it")
            matches.append((path, target))
        _refuse_unreadable_folders(folder, pattern)
    except (ValueError, NotImplementedError) as error:
        raise ConfigError(f"session.yaml: {key}: {pattern} is no pattern ({error}); correct the pattern") from error
    except (OSError, RuntimeError) as error:
        raise RawDataError(f"{folder}: {pattern} cannot be searched ({error}); check the folder") from error
    return matches


def _refuse_unreadable_folders(folder: Path, pattern: str) -> None:
    """Raise OSError for a folder that the user may not read; glob skips its files without an error."""
    parts = PurePosixPath(pattern).parts
    literal_parts = list(takewhile(lambda part: not set(part) & set("*?["), parts[:-1]))

    def refuse(error: OSError) -> None:
        if not isinstance(error, FileNotFoundError):
            raise error

    for _ in os.walk(folder.joinpath(*literal_parts), onerror=refuse):
        if len(literal_parts) == len(parts) - 1:  # every file that can match lies in this folder
            break
