"""``poolcal history``: all sessions of a boat on one page."""

import sys
from datetime import date
from pathlib import Path

from pipeline.console import plural
from pipeline.language.speaking import say
from pipeline.results.history import History, SessionFilter, read_history
from pipeline.results.pages.history import write_history


def command(folder: Path, out: Path | None, name: str, since: date | None, until: date | None) -> int:
    """Write history.html, history.csv and history.parquet.

    Parameters
    ----------
    folder
        The folder that contains run folders.
    out
        The folder for the files; None: ``folder/history``.
    name
        Pattern of the names of sessions to show.
    since, until
        First and last day of sessions to show, UTC; None: no limit.
    """
    session_filter = SessionFilter(name, since, until)
    history = read_history(folder, session_filter)
    write(history, folder / "history" if out is None else out, session_filter)
    return 0


def write(history: History, target: Path, session_filter: SessionFilter) -> None:
    """Write the page and the tables of a history to the folder ``target``, and print what is in them and what not."""
    write_history(history, target, session_filter)
    for problem in history.unreadable:
        say(f"left out: {problem}", sys.stderr)
    if history.not_shown:
        say(history.not_shown, sys.stdout)
    say(f"{plural(len(history.table), 'session')}: {target / 'history.html'}", sys.stdout)
