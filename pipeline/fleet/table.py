"""The table at the end of ``poolcal repeat``: a line for each session."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.console import plural
from pipeline.fleet.answer import ACCEPTED, BUG, COULD_NOT_RUN, REJECTED, Answer
from pipeline.fleet.logs import log_of
from pipeline.fleet.session_list import FleetSession, shown
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.results.history import History
from pipeline.text_table import text_table

LAYOUT = "<12  <8" + " >8" * 6 + "  <12 >8  <1"
MOST_NAMED = 3  # stages; of more than these the table shows the first and the last
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
        return "; ".join([f"ran {ran}" if ran else "up to date", *(f"{kind} not drawn" for kind in answer.not_drawn)])

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
        done = f"; {self.done}" if self.answer.status in (ACCEPTED, REJECTED) else ""
        return f"{words}{done} ({self.seconds:.1f} s)"


def movements(history: History, folder: Path) -> dict[Path, str]:
    """Return by run folder the answer of each accepted session's comparison with the accepted session before it."""
    rows = history.table.to_dict("records")
    answers = {folder / row["run"]: row["answer"] + (f": {row['moved']}" if row["moved"] else "") for row in rows}
    return {run: answer for run, answer in answers.items() if answer}


def outcome_table(outcomes: Sequence[Outcome], moved: Mapping[Path, str]) -> list[str]:
    """Return the table's lines, and below them one for each session that has no accepted calibration.

    Parameters
    ----------
    outcomes
        The sessions, in order.
    moved
        The answers of comparisons with the session before, by run folder.
    """
    units = {"deg": "°", "m": "m"}
    heads = [f"{name}, {units[unit]}" for name, *_, unit in PARAMETERS]
    rows = []
    for outcome in outcomes:
        answer = outcome.answer
        values = [f"{answer.mount[key]:.4f}" if key in answer.mount else "-" for *_, key, _ in PARAMETERS]
        since = moved.get(outcome.session.run, "-") if answer.status == ACCEPTED else "-"
        row = (outcome.session.label, answer.verdict or "-", *values, since, f"{outcome.seconds:.1f} s", outcome.done)
        rows.append(row)
    table = text_table(LAYOUT, ("session", "verdict", *heads, "since before", "time", "done"), rows)
    complaints = [outcome.complaint for outcome in outcomes if outcome.complaint]
    return [*table, *([""] if complaints else []), *complaints]


def count_line(outcomes: Sequence[Outcome]) -> str:
    """Return the sentence with the numbers of sessions by what came out."""
    numbers = {words: sum(one.answer.status == status for one in outcomes) for status, words in COUNTED.items()}
    parts = ", ".join(f"{number} {words}" for words, number in numbers.items() if number)
    return f"{plural(len(outcomes), 'session')}: {parts}."
