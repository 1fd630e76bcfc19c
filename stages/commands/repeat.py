"""``poolcal repeat``: bring all sessions of a list up to date, and show them in one table."""

import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.config.fleet import load_fleet
from pipeline.errors import PoolcalError
from pipeline.fleet.answer import BUG, COULD_NOT_RUN, Answer, answer_of_ended, overall_status
from pipeline.fleet.logs import write_log
from pipeline.fleet.processes import Command, Reply, ask_all
from pipeline.fleet.session_list import HISTORY, FleetSession, list_sessions, shown
from pipeline.fleet.table import Outcome, count_line, movements, outcome_table
from pipeline.language.speaking import say
from pipeline.results.history import History, SessionFilter, read_history
from pipeline.run.settings import holds_run
from pipeline.run.workers import default_jobs, workers
from stages.commands import child, history
from stages.commands.draw import Drawings
from stages.commands.entry import raise_if_interrupted
from stages.commands.repeat_worker import Request

WORKER: Sequence[str] = (*child.PYTHON, "stages.commands.repeat_worker")


def command(fleet: Path, jobs: int | None, executor: str | None, drawings: Drawings) -> int:
    """Bring every session of a fleet up to date.

    Parameters
    ----------
    fleet
        The YAML file with the list of sessions.
    jobs
        The number of sessions at a time; None: as many as a run has workers.
    executor
        The address of a dask scheduler; None: each session has one worker.
    drawings
        What to draw.

    Returns
    -------
    int
        3: a bug in one of them; else 2: one could not be run; else 1: one was rejected; else 0.
    """
    listed = list_sessions(load_fleet(fleet))
    if executor is not None:
        with workers(None, executor):  # a wrong address is refused once, not for each session
            pass
    for folder in listed.passed_over:
        say(f"left out: {shown(folder)}: holds no session.yaml", sys.stderr)
    outcomes = _calibrate(listed.sessions, jobs or default_jobs(), executor, drawings)
    raise_if_interrupted()
    all_written = _show(outcomes)
    status = overall_status([outcome.answer for outcome in outcomes])
    return status if all_written else max(status, COULD_NOT_RUN)


def _calibrate(
    sessions: Sequence[FleetSession], jobs: int, executor: str | None, drawings: Drawings
) -> list[Outcome]:
    """Calibrate all sessions, ``jobs`` at a time, and say when each begins and ends."""
    outcomes: dict[int, Outcome] = {}

    def begun(number: int) -> None:
        say(f"{sessions[number].label}: begins, {number + 1} of {len(sessions)}", sys.stderr)

    def replied(number: int, reply: Reply) -> bool:
        answer = answer_of_ended(reply.exit_code) if reply.line is None else Answer.from_line(reply.line)
        outcome = outcomes[number] = Outcome(sessions[number], answer, reply.seconds)
        say(outcome.line, sys.stderr)
        if problem := write_log(outcome.session.run, outcome.session.label, reply.said):
            say(f"{outcome.session.label}: no log: {problem}", sys.stderr)
        return answer.status != BUG

    command = Command(WORKER, child.environment() | {"PYTHONIOENCODING": "utf-8"})
    requests = [_request(session, executor, drawings).as_line() for session in sessions]
    ask_all(command, requests, jobs, begun, replied)
    return [outcomes[number] for number in range(len(sessions))]


def _request(session: FleetSession, executor: str | None, drawings: Drawings) -> Request:
    return Request(
        session=shown(session.session),
        config=shown(session.config),
        run=shown(session.run),
        sensor=session.sensor,
        executor=executor,
        report=drawings.report,
        recordings=drawings.recordings,
    )


def _show(outcomes: Sequence[Outcome]) -> bool:
    """Print the table, and write the history of each folder with runs of the sonar; return whether all were written."""
    runs = [outcome.session.run for outcome in outcomes if outcome.session.sensor == "mbes"]
    histories: dict[Path, History] = {}
    moved: dict[Path, str] = {}
    problems: list[PoolcalError] = []
    for folder in sorted({run.parent for run in runs if holds_run(run)}):
        try:
            histories[folder] = read_history(Path(shown(folder)), SessionFilter())
        except PoolcalError as error:
            problems.append(error)
        else:
            moved |= movements(histories[folder], folder)
    say("\n".join([*outcome_table(outcomes, moved), "", count_line(outcomes)]), sys.stdout)
    for folder, one in histories.items():
        try:
            history.write(one, Path(shown(folder)) / HISTORY, SessionFilter())
        except PoolcalError as error:
            problems.append(error)
    for problem in problems:
        say(f"no history: {problem}", sys.stderr)
    return not problems
