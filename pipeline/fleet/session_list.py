"""The sessions that FLEET.yaml stands for, each with its own run folder, once patterns are replaced by folders."""

import glob
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.config.fleet import FleetFile, ListedSession
from pipeline.config.session import Calibrated
from pipeline.errors import ConfigError

HISTORY = "history"  # the folder beside the run folders for the page with all of them


@dataclass(frozen=True)
class FleetSession:
    """A session of the fleet, and the entry of FLEET.yaml that names it. Paths are absolute."""

    session: Path
    config: Path
    run: Path
    sensor: Calibrated
    entry: int

    @property
    def label(self) -> str:
        """The session's name in lines and tables."""
        return shown(self.session) + (" (laser)" if self.sensor == "laser" else "")


@dataclass(frozen=True)
class SessionList:
    """All sessions of a fleet, in the order of FLEET.yaml.

    Attributes
    ----------
    sessions
        The sessions.
    passed_over
        Folders that match a pattern, but hold no session.yaml.
    """

    sessions: tuple[FleetSession, ...]
    passed_over: tuple[Path, ...]


def shown(path: Path) -> str:
    """Return an absolute path for messages: from the working folder if it lies in it."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def list_sessions(file: FleetFile) -> SessionList:
    """Return the sessions of a fleet.

    Raises
    ------
    ConfigError
        A path or pattern has no session, a run folder is missing, or two sessions share one, or it lies in a session
        folder or in another run folder.
    """
    sessions: list[FleetSession] = []
    passed_over: list[Path] = []
    for number, listed in enumerate(file.fleet.sessions):
        folders = _matching(_real(file.path.parent), listed.session)
        found = [folder for folder in folders if os.path.isfile(folder / "session.yaml")]
        if not found:
            remedy = "correct the path or the pattern, or take the entry out"
            raise file.fault(number, "session", f"matches no folder that holds session.yaml; {remedy}")
        passed_over += [folder for folder in folders if folder not in found]
        sessions += _with_runs(file, number, listed, found)
    _refuse_common_run_folders(file, sessions)
    _refuse_wrong_run_folders(file, sessions)
    return SessionList(tuple(sessions), tuple(dict.fromkeys(passed_over)))


def _matching(base: Path, pattern: str) -> list[Path]:
    """Return the folders that match, by name; a folder of exactly this name goes before the pattern.

    Links to folders keep their own names. ``**`` is one level, as ``*`` is.
    """
    literal = os.path.join(base, pattern)
    names = [literal] if os.path.isdir(literal) else glob.glob(os.path.join(glob.escape(str(base)), pattern))
    paths = [Path(name) for name in sorted(names) if os.path.isdir(name)]
    return [_real(path) if path.name in ("", "..") else _real(path.parent) / path.name for path in paths]


def _with_runs(
    file: FleetFile, number: int, listed: ListedSession, folders: Sequence[Path]
) -> Iterator[FleetSession]:
    """Yield the sessions of an entry with their run folders."""
    base, runs = file.path.parent, listed.runs or file.fleet.runs
    if listed.run is not None and len(folders) > 1:
        names = f"{shown(folders[0])} and {shown(folders[1])}"
        raise file.fault(number, "run", f"is one run folder for several sessions, {names}; write runs instead")
    for folder in folders:
        if listed.run is not None:
            run = base / listed.run
        elif runs is not None:
            run = base / runs / folder.name
        else:
            raise file.fault(number, "run", "is missing; add it, or runs for all sessions")
        yield FleetSession(folder, _real(base / listed.config), _real(run), listed.sensor, number)


def _refuse_common_run_folders(file: FleetFile, sessions: Sequence[FleetSession]) -> None:
    """Raise a ConfigError if two sessions have one run folder."""
    first: dict[Path, FleetSession] = {}
    for session in sessions:
        other = first.setdefault(session.run, session)
        if other is not session:
            raise _fault(
                file,
                session,
                f"{session.label} would go into {shown(session.run)}, as {other.label} in line "
                f"{file.line(other.entry)} does; give one of them another run or runs",
            )


def _refuse_wrong_run_folders(file: FleetFile, sessions: Sequence[FleetSession]) -> None:
    """Raise a ConfigError if a run folder lies in a session folder or round it, in another, or where a history goes."""
    runs, folders = {session.run for session in sessions}, {_real(session.session) for session in sessions}
    inside = {parent: folder for folder in sorted(folders) for parent in folder.parents}
    for session in sessions:
        run = session.run
        within = (run, *run.parents)
        if run.name == HISTORY:
            raise _fault(file, session, f"{shown(run)} is where the history page goes; name another run folder")
        outer = next((place for place in run.parents if place in runs), None)
        if outer is not None:
            raise _fault(file, session, f"{shown(run)} lies in another run folder, {shown(outer)}; name one apart")
        folder = next((place for place in within if place in folders), inside.get(run))
        if folder is not None:
            words = f"{shown(run)} lies in the session folder {shown(folder)}, or round it; name one apart"
            raise _fault(file, session, words)


def _real(path: Path) -> Path:
    """Return the path without links and ``..``; Path.resolve raises an error for a link to itself."""
    return Path(os.path.realpath(path))


def _fault(file: FleetFile, session: FleetSession, words: str) -> ConfigError:
    """Return the error about a session's run folder, at the key that decides it."""
    listed = file.fleet.sessions[session.entry]
    key = "run" if listed.run is not None else "runs" if listed.runs is not None else "session"
    return file.fault(session.entry, key, words)
