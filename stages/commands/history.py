"""``poolcal history``: all sessions of a boat on one page."""

import sys
from datetime import date
from pathlib import Path

from pipeline.console import plural, say
from pipeline.results.history import SessionFilter, read_history
from pipeline.results.pages.history import write_history


def command(folder: Path, out: Path | None, name: str, since: date | None, until: date | None) -> int:
    """Write history.html, history.csv and history.parquet.

    Parameters
    ----------
    folder
        Folder that holds run folders.
    out
        Where the files go; None: ``folder/history``.
    name
        Pattern of the sessions' names.
    since, until
        First and last day, UTC; None: any.
    """
    session_filter = SessionFilter(name, since, until)
    history = read_history(folder, session_filter)
    target = folder / "history" if out is None else out
    write_history(history, target, session_filter)
    for problem in history.unreadable:
        say(f"left out: {problem}", sys.stderr)
    if history.not_shown:
        say(history.not_shown, sys.stdout)
    say(f"{plural(len(history.table), 'session')}: {target / 'history.html'}", sys.stdout)
    return 0
