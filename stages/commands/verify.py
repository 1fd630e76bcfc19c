"""``poolcal verify``: check that all files that a run read and wrote are as recorded."""

import sys
from pathlib import Path

from pipeline.console import plural
from pipeline.language.speaking import say
from pipeline.run.settings import calibrated_in
from pipeline.run.verify import problems_of_run
from pipeline.run.workers import workers
from stages import load


def command(run: Path, jobs: int | None) -> int:
    """Hash a run's files again with ``jobs`` threads, and print all differences; return 1 if there are any."""
    with workers(jobs) as pool:
        problems = problems_of_run(load(calibrated_in(run)), run, pool)
    for problem in problems:
        say(problem, sys.stdout)
    say(plural(len(problems), "problem") if problems else f"{run}: everything is as recorded", sys.stdout)
    return 1 if problems else 0
