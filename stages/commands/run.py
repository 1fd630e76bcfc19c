"""``poolcal run``: run all stages, print the answer, make the drawings."""

from dataclasses import dataclass
from pathlib import Path

from pipeline.config.session import Calibrated
from pipeline.run import runner
from pipeline.run.progress import Progress
from pipeline.run.workers import workers
from stages import load
from stages.commands.answer import print_result, say_failures, say_where
from stages.commands.draw import Drawings, draw_missing
from stages.commands.entry import raise_if_interrupted


@dataclass(frozen=True)
class RunOptions:
    """Options of a run: the number of workers, the cluster if any, the drawings, and what may be overwritten."""

    jobs: int | None
    executor: str | None  # address of a dask scheduler
    drawings: Drawings
    overwrite: bool  # True: replace another session's run


def command(session: Path, config: Path, run: Path, calibrated: Calibrated, options: RunOptions) -> int:
    """Calibrate a session.

    Parameters
    ----------
    session
        Folder with session.yaml and the raw files.
    config
        The pool's YAML file.
    run
        Folder for the results.
    calibrated
        The sensor that is calibrated.
    options
        Workers, drawings and overwriting.

    Returns
    -------
    int
        0: accepted, 1: rejected.
    """
    with workers(options.jobs, options.executor) as pool:
        runner.run(
            load(calibrated),
            session,
            config,
            run,
            workers=pool,
            progress=Progress(),
            finished=lambda _: raise_if_interrupted(),
            calibrated=calibrated,
            overwrite=options.overwrite,
        )
        status = print_result(run)
        jobs = pool.jobs
    say_failures(draw_missing(run, options.drawings, jobs), "; the calibration is complete")
    raise_if_interrupted()
    say_where(run)
    return status
