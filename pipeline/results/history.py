"""All sessions of one boat in one table, which shows whether and when the mount has moved.

Each accepted session is compared with the accepted session before it, as ``poolcal diff`` does
(:mod:`pipeline.results.movement`). Rejected sessions are listed, but not compared.
"""

import fnmatch
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date, datetime
from pathlib import Path
from re import fullmatch
from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.results import CALIBRATION_JSON
from pipeline.console import plural
from pipeline.errors import ConfigError, PoolcalError
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS, SETTINGS
from pipeline.results.mount_difference import TO_UNITS
from pipeline.results.movement import movement_between
from pipeline.results.session_estimate import SessionEstimate, session_estimate
from pipeline.run.results import calibration
from pipeline.run.settings import RUN_YAML

TEXT_COLUMNS = ("date_utc", "session", "run", "verdict", "moved", "answer")


@dataclass(frozen=True)
class SessionFilter:
    """A filter of sessions: a pattern of the name, and the first and last day (UTC) on which a session may begin."""

    name: str = "*"
    since: date | None = None
    until: date | None = None

    def takes(self, session: str, day: str) -> bool:
        """Return whether a session of this name and day (YYYY-MM-DD) is shown."""
        inside = (self.since is None or day >= self.since.isoformat()) and (
            self.until is None or day <= self.until.isoformat()
        )
        return inside and fnmatch.fnmatchcase(session.casefold(), self.name.casefold())

    def words(self) -> str:
        """Return the filter in words; an empty text if all sessions are shown."""
        words = [f"name {self.name}"] if self.name != "*" else []
        words += [f"since {self.since}"] if self.since else []
        return ", ".join([*words, *([f"until {self.until}"] if self.until else [])])


@dataclass(frozen=True)
class History:
    """All sessions of a boat.

    Attributes
    ----------
    table
        One row for each session, in order of time.
    unreadable
        Texts, one for each run that could not be read, with the reason.
    lasers
        Runs that calibrate a laser. They are not in the table, which has the sonar's mounts.
    """

    table: pd.DataFrame
    unreadable: list[str] = field(default_factory=list)
    lasers: list[str] = field(default_factory=list)

    @property
    def not_shown(self) -> str:
        """The text that lists the runs left out because they calibrate a laser; empty without such runs."""
        number = len(self.lasers)
        return f"{plural(number, 'laser run')} not shown: {', '.join(self.lasers)}" if number else ""


def read_history(folder: Path, chosen: SessionFilter) -> History:
    """Return the history of the runs in ``folder``, up to two levels deep, that pass the filter ``chosen``."""
    if not folder.is_dir():
        raise ConfigError(f"{folder}: is no folder; RUNS_DIR is the folder that holds run folders")
    sessions, unreadable, lasers = [], [], []
    finished, begun = _runs_in(folder)
    if not finished and not begun:
        itself = (folder / RUN_YAML).is_file()
        remedy = "it is one itself: name the folder that holds it" if itself else "name the folder that holds them"
        raise ConfigError(f"{folder}: holds no run folder, nor do the folders in it; {remedy}")
    for run in finished:
        try:
            result = calibration(run)
            if result.get("calibrated") == "laser":
                lasers.append(run.relative_to(folder).as_posix())
                continue
            row, estimate = _row(run.relative_to(folder).as_posix(), result), session_estimate(result)
        except PoolcalError as error:
            unreadable.append(str(error))
            continue
        except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError):
            unreadable.append(f"{run}: its calibration.json is not as poolcal writes it")
            continue
        if chosen.takes(row["session"], row["date_utc"][:10]):
            sessions.append((row["date_utc"], row["run"], row, estimate))
    unreadable += [_why_without(run) for run in begun]
    sessions.sort(key=lambda session: session[:2])
    rows = list(_with_jumps([(row, estimate) for *_, row, estimate in sessions]))
    return History(pd.DataFrame(rows, columns=list(_columns())), unreadable, lasers)


def _runs_in(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return two lists of run folders, up to two levels deep: folders with a result, folders without a readable one."""
    finished, begun = set(), set()
    for depth in ("*", "*/*"):
        finished |= {path.parent.parent for path in folder.glob(f"{depth}/report/{CALIBRATION_JSON.name}")}
        begun |= {path.parent for path in folder.glob(f"{depth}/{RUN_YAML}")}
    return sorted(finished), sorted(begun - finished)


def _why_without(run: Path) -> str:
    try:
        (run / "report" / CALIBRATION_JSON.name).stat()
    except PermissionError as error:
        return f"{run}: its result cannot be read ({error.strerror}); correct its permissions"
    except OSError:
        pass
    return f"{run}: has no result; run poolcal run again, and see what it says"


def _columns() -> Iterator[str]:
    yield from ("date_utc", "session", "run", "verdict")
    for key in SETTINGS:
        yield from (key, f"sigma_{key}")
    yield from ("probability", "moved", "answer")
    for key in SETTINGS:
        yield f"detectable_{key}"


def _row(run: str, result: Mapping[str, Any]) -> dict[str, Any]:
    """Return a session's row: values and sigmas of the adjustment, whatever method gave the result; NaN if none."""
    block = result["methods"]["adjustment"]
    nothing = dict.fromkeys(SETTINGS, np.nan)
    mount, sigma = (block[name] or nothing for name in ("mount", "sigma_mount"))
    passes: Sequence[Mapping[str, Any]] = result["passes"]
    row: dict[str, Any] = {
        "date_utc": _checked_time(passes[0]["start_utc"]) if passes else "",
        "session": str(result["session"]),
        "run": run,
        "verdict": str(result["verdict"]),
    }
    for key in SETTINGS:
        row |= {key: float(mount[key]), f"sigma_{key}": float(sigma[key])}
        if np.isinf(row[key]) or np.isinf(row[f"sigma_{key}"]):
            raise ValueError(f"{key} is not finite")
    row |= {f"detectable_{key}": np.nan for key in SETTINGS}
    return row | {"probability": np.nan, "moved": "", "answer": ""}


def _checked_time(text: str) -> str:
    """Return ``text`` if it is a date and time in poolcal's format; otherwise raise ValueError."""
    if not fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z", text):
        raise ValueError(f"{text!r} is no date and time")
    datetime.fromisoformat(text)
    return text


def _with_jumps(sessions: list[tuple[dict[str, Any], SessionEstimate | None]]) -> Iterator[dict[str, Any]]:
    """Yield the rows. Each accepted session is tested against the accepted session before it."""
    before: SessionEstimate | None = None
    for row, now in sessions:
        if row["verdict"] == "accepted" and now is not None:
            row = row if before is None else row | _comparison(before, now)
            before = now
        yield row


def _comparison(before: SessionEstimate, now: SessionEstimate) -> dict[str, Any]:
    """Return the columns of a row that compare its session with the one before."""
    movement = movement_between(before, now)
    sizes = movement.detectable.surely * TO_UNITS
    return {
        "probability": movement.difference.probability,
        "moved": ", ".join(MOUNT_WORDS[k] for k in movement.moved),
        "answer": movement.answer.replace("_", " "),
        **{f"detectable_{key}": float(sizes[k]) for _, k, key, _ in PARAMETERS},
    }
