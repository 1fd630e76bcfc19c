"""A whole run: stages, answer, pictures."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from pipeline.config.session import Calibrated
from pipeline.run import runner
from pipeline.run.progress import Progress
from pipeline.run.workers import workers
from stages import load
from stages.commands.answer import answer_of, say_failures, say_where
from stages.commands.draw import Painters, painters


def calibrate(
    calibrated: Calibrated,
    session: Path,
    config: Path,
    run: Path,
    after: Callable[[Painters, Path, str], None],
    jobs: int | None,
    executor: str | None,
    wanted: tuple[bool, bool],
    overwrite: bool = False,
) -> int:
    """The exit status; ``after`` each stage; ``wanted``: the report's page, the recordings; ``overwrite``: also another
    session's run."""
    with workers(jobs, executor) as pool, painters(*wanted, pool.jobs > 1) as drawing:
        finished = partial(after, drawing, run)
        runner.run(load(calibrated), session, config, run, pool, Progress(), finished, calibrated, overwrite)
        status = answer_of(run)
        say_failures(drawing.draw(run), "; the calibration is complete")
    say_where(run)
    return status
