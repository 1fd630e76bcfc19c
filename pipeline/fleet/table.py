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

LAYOUT = "<12  <8" + " >9" * 6 + "  <12 >9  <1"
MOST_NAMED = 3  # stages; of more than these the table shows the first and the last
COUNTED = {ACCEPTED: "accepted", REJECTED: "rejected", COULD_NOT_RUN: "could not run", BUG: "ended by a bug"}


@dataclass(frozen=True)
class Outcome:
    """A session with the answer about it, and the time that it took."""

    session: FleetSession
    answer: Answer
    seconds: float

    def done(self) -> str:
        """Return in words what was done."""
        answer = self.answer
        if answer.status == COULD_NOT_RUN:
            return f"refused: {answer.reason}"
        if answer.status == BUG:
            return f"bug: {answer.reason}; see {shown(log_of(self.session.run))}"
        ran = ", ".join(answer.ran)
        if len(answer.ran) > MOST_NAMED:
            ran = f"{len(answer.ran)} stages, {answer.ran[0]} to {answer.ran[-1]}"
        words = [f"ran {ran}" if ran else "up to date", *(f"{kind} not drawn" for kind in answer.not_drawn)]
        return "; ".join(words)

    def line(self) -> str:
        """Return the line about the end of the session."""
        verdict = f"{self.answer.verdict}, " if self.answer.verdict else ""
        return f"{self.session.label}: {verdict}{self.done()}, {self.seconds:.1f} s"


def movements(history: History, folder: Path) -> dict[Path, str]:
    """Return by run folder the answer of each accepted session's comparison with the accepted session before it."""
    rows = history.table.to_dict("records")
    answers = {folder / row["run"]: row["answer"] + (f": {row['moved']}" if row["moved"] else "") for row in rows}
    return {run: answer for run, answer in answers.items() if answer}


def outcome_table(outcomes: Sequence[Outcome], moved: Mapping[Path, str]) -> list[str]:
    """Return the table's lines.

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
        row = (outcome.session.label, answer.verdict or "-", *values, since, f"{outcome.seconds:.1f} s", outcome.done())
        rows.append(row)
    return text_table(LAYOUT, ("session", "verdict", *heads, "since before", "time", "done"), rows)


def count_line(outcomes: Sequence[Outcome]) -> str:
    """Return the sentence with the numbers of sessions by what came out."""
    numbers = {words: sum(one.answer.status == status for one in outcomes) for status, words in COUNTED.items()}
    parts = ", ".join(f"{number} {words}" for words, number in numbers.items() if number)
    return f"{plural(len(outcomes), 'session')}: {parts}."
