"""The table at the end of ``poolcal repeat``: a line for each session."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.console import plural
from pipeline.fleet.answer import ACCEPTED, BUG, COULD_NOT_RUN, REJECTED, Answer
from pipeline.fleet.logs import log_of
from pipeline.fleet.session_list import FleetSession, shown
from pipeline.language import letters
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.results.history import History
from pipeline.text_table import text_table

LAYOUT = "<8" + " >8" * 3 + " >6" * 3 + "  <12"  # behind the session's name
WIDTH, LEAST_LABEL, MOST_SINCE = 100, 12, 17  # columns
DECIMALS = {"deg": 4, "m": 3}  # 0.0001° is 0.05 mm at 30 m
FOR = " for "  # in a verdict in words, before what an accepted calibration is good for
MOST_NAMED = 3  # stages; of more than these the table shows the first and the last
UP_TO_DATE = "up to date"
BAD = {REJECTED: "rejected", COULD_NOT_RUN: "refused", BUG: "bug"}
COUNTED = {ACCEPTED: "accepted", REJECTED: "rejected", COULD_NOT_RUN: "could not run", BUG: "ended by a bug"}


@dataclass(frozen=True)
class Outcome:
    """A session with the answer about it, and the time that it took."""

    session: FleetSession
    answer: Answer
    seconds: float

    @property
    def done(self) -> str:
        """In words what was done."""
        answer = self.answer
        if answer.status in (COULD_NOT_RUN, BUG):
            return BAD[answer.status]
        ran = ", ".join(answer.ran)
        if len(answer.ran) > MOST_NAMED:
            ran = f"{answer.ran[0]} to {answer.ran[-1]}"
        return "; ".join([f"ran {ran}" if ran else UP_TO_DATE, *(f"{kind} not drawn" for kind in answer.not_drawn)])

    @property
    def verdict(self) -> str:
        """The verdict, *in part* for one that is accepted in part; without one, why there is none."""
        word = BAD.get(self.answer.status, self.answer.verdict.partition(FOR)[0])
        return word.removeprefix("accepted ")

    @property
    def complaint(self) -> str:
        """The line with the reason why there is no accepted calibration; empty if there is one."""
        answer = self.answer
        if answer.status == ACCEPTED:
            return ""
        where = f"; see {shown(log_of(self.session.run))}" if answer.status == BUG else ""
        return f"{self.session.label}: {BAD[answer.status]}: {answer.reason}{where}"

    @property
    def line(self) -> str:
        """The line about the end of the session."""
        words = self.complaint or f"{self.session.label}: {self.answer.verdict}"
        if self.done == UP_TO_DATE:
            return f"{words}; up to date ({self.seconds:.1f} s)"  # one sentence, for the translation
        done = f"; {self.done}" if self.answer.status in (ACCEPTED, REJECTED) else ""
        return f"{words}{done} ({self.seconds:.1f} s)"


def movements(history: History, folder: Path) -> dict[Path, str]:
    """Return by run folder the answer of each accepted session's comparison with the accepted session before it."""
    rows = history.table.to_dict("records")
    answers = {folder / row["run"]: row["answer"] + (f": {row['moved']}" if row["moved"] else "") for row in rows}
    return {run: answer for run, answer in answers.items() if answer}


def outcome_table(outcomes: Sequence[Outcome], moved: Mapping[Path, str]) -> list[str]:
    """Return the table's lines, and below them what to know of a session: no accepted calibration, a movement, a fault.

    Parameters
    ----------
    outcomes
        The sessions, in order.
    moved
        The answers of comparisons with the session before, by run folder.
    """
    units = {"deg": "°", "m": "m"}
    heads = [f"{name}, {units[unit]}" for name, *_, unit in PARAMETERS]
    rows, below = [], []
    for outcome in outcomes:
        mount = outcome.answer.mount
        values = [f"{mount[key]:.{DECIMALS[unit]}f}" if key in mount else "-" for *_, key, unit in PARAMETERS]
        since = moved.get(outcome.session.run, "-") if outcome.answer.status == ACCEPTED else "-"
        short, _, what = since.partition(": ")
        rows.append((outcome.verdict, *values, since if len(since) <= MOST_SINCE else short))
        where = outcome.session.label
        below += [outcome.complaint] if outcome.complaint else []
        below += [f"{where}: {outcome.answer.verdict}"] if FOR in outcome.answer.verdict else []
        below += [f"{where}: has moved since the session before: {what}"] if what else []
        below += [f"{where}: {kind} not drawn" for kind in outcome.answer.not_drawn]
    head = ("verdict", *heads, "since before")
    room = WIDTH - 1 - max(map(letters.width, text_table(LAYOUT, head, rows)))
    labels = _labels([outcome.session.label for outcome in outcomes], max(room, LEAST_LABEL))
    whole = ((label, *row) for label, row in zip(labels, rows, strict=True))
    table = text_table(f"<{LEAST_LABEL} {LAYOUT}", ("session", *head), whole)
    return [*table, *([""] if below else []), *below]


def _labels(whole: Sequence[str], room: int) -> list[str]:
    """Return the sessions' names, cut off in front, but no two of them alike: then they are given more room.

    >>> _labels(["data/boat_a/2026-05-12", "data/boat_b/2026-05-12"], 12)
    ['…a/2026-05-12', '…b/2026-05-12']
    """
    cut = ([_cut(label, wider) for label in whole] for wider in itertools.count(room))
    return next(labels for labels in cut if len({*labels}) == len({*whole}))


def _cut(label: str, room: int) -> str:
    """Return a session's name, cut off in front if it is too long.

    >>> _cut("data/boat_a/2026-05-12", 17), _cut("2026-05-12", 17)
    ('…oat_a/2026-05-12', '2026-05-12')
    """
    if letters.width(label) <= room:
        return label
    return next(f"…{end}" for start in range(1, len(label) + 1) if letters.width(end := label[start:]) < room)


def count_line(outcomes: Sequence[Outcome]) -> str:
    """Return the sentence with the numbers of sessions by what came out."""
    numbers = {words: sum(one.answer.status == status for one in outcomes) for status, words in COUNTED.items()}
    parts = ", ".join(f"{number} {words}" for words, number in numbers.items() if number)
    same = sum(one.answer.status in (ACCEPTED, REJECTED) and not one.answer.ran for one in outcomes)
    whole = f"{plural(len(outcomes), 'session')}: {parts}"
    return f"{whole}; {same} up to date." if same else f"{whole}."
