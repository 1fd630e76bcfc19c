"""The files below a folder, sorted by what a session may do with them. No link is followed."""

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from pipeline.config.recording import inside_session
from pipeline.config.yaml_file import SESSION_YAML
from pipeline.console import plural
from pipeline.errors import ConfigError, RawDataError
from pipeline.readers import file_kind
from pipeline.readers.detect import kind_of
from pipeline.readers.file_kind import FileKind
from pipeline.readers.session_files import as_pattern
from pipeline.readers.table_files import sensors_of_table
from pipeline.run.settings import holds_run

MOST_FILES = 10_000
_SETTINGS = (".yaml", ".yml")


@dataclass(frozen=True, order=True)
class LeftOut:
    """A file or folder that the session does not use, and the reason."""

    name: str
    why: str


@dataclass
class FolderFiles:
    """The files below a folder.

    Attributes
    ----------
    by_kind : dict
        Names of the files that may be read, by their sensor and the title of their kind.
    kinds : dict
        These kinds by their titles.
    accuracy : list of str
        Names of accuracy files (SMRMSG), which belong to an SBET.
    texts : list of str
        Names of texts that are no raw files; a cast of sound speed may be among them.
    left_out : list of LeftOut
        The other files.
    """

    by_kind: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    kinds: dict[str, FileKind] = field(default_factory=dict)
    accuracy: list[str] = field(default_factory=list)
    texts: list[LeftOut] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)


def sort_files(folder: Path) -> FolderFiles:
    """Return all files below a folder by kind, in order of their names.

    Raises
    ------
    ConfigError
        There are too many files for a session.
    """
    files = FolderFiles()
    names = list(_walk(folder, files.left_out))
    for name in sorted(names):
        if why := _unlistable(name):
            files.left_out.append(LeftOut(name, why))
            continue
        try:
            _sort(files, folder / name, name)
        except RawDataError as error:
            files.left_out.append(LeftOut(name, str(error).removeprefix(f"{name}: ")))
    return files


def _sort(files: FolderFiles, path: Path, name: str) -> None:
    kind = kind_of(path, name)
    sensors = list(kind.sensors)
    if kind is file_kind.SMRMSG:
        files.accuracy.append(name)
        return
    if kind in (file_kind.CSV, file_kind.PARQUET):
        sensors = [*sensors_of_table(path, name)]
    if len(sensors) == 1:
        files.kinds[kind.title] = kind
        files.by_kind.setdefault((sensors[0], kind.title), []).append(name)
    elif sensors:
        files.left_out.append(LeftOut(name, f"has the columns of {' and '.join(sensors)}; keep those of one sensor"))
    else:
        is_text = kind is file_kind.TEXT or "cast" in kind.title
        advice = f"; {kind.advice}" if kind.advice else ""
        (files.texts if is_text else files.left_out).append(LeftOut(name, f"is {kind.title}{advice}"))


def _walk(folder: Path, left_out: list[LeftOut]) -> Iterator[str]:
    """Yield the names of regular files, without hidden ones, settings, run folders, and other sessions."""

    def refused(error: OSError) -> None:
        where = Path(error.filename or folder)
        name = "." if where == folder else where.relative_to(folder).as_posix()
        left_out.append(LeftOut(name, f"cannot be read ({error.strerror})"))

    number = 0
    for parent, folders, names in os.walk(folder, onerror=refused, followlinks=False):
        place = Path(parent)
        for name in sorted(folders):
            other = _other_folder(place / name)
            if other or name.startswith("."):
                folders.remove(name)
            if other:
                left_out.append(LeftOut(_name(place / name, folder), other))
        for name in sorted(names):
            if name.startswith(".") or PurePosixPath(name).suffix.lower() in _SETTINGS:
                continue
            number += 1
            if number > MOST_FILES:
                raise ConfigError(
                    f"{folder}: holds more than {plural(MOST_FILES, 'file')}; name the folder of one session"
                )
            mode = _mode(place / name)
            if stat.S_ISREG(mode):
                yield _name(place / name, folder)
            else:
                words = "is a link, which is not followed; copy the file" if stat.S_ISLNK(mode) else "is no file"
                left_out.append(LeftOut(_name(place / name, folder), words))


def _mode(path: Path) -> int:
    try:
        return path.lstat().st_mode
    except OSError:  # removed meanwhile
        return 0


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _other_folder(path: Path) -> str:
    """Return why a folder below is not looked into; empty if it is."""
    if path.is_symlink():
        return "is a link, which is not followed; copy the folder"
    if os.path.lexists(path / SESSION_YAML):
        return f"is a session of its own: it holds {SESSION_YAML}"
    return "holds a run of poolcal" if holds_run(path) else ""


def _unlistable(name: str) -> str:
    """Return why a file cannot be listed in session.yaml; empty if it can."""
    try:
        name.encode()
        inside_session(as_pattern(name))
    except UnicodeEncodeError:
        return "its name is no UTF-8 text; rename it"
    except ValueError as error:
        return f"its name cannot stand in {SESSION_YAML} ({error}); rename it"
    return ""
