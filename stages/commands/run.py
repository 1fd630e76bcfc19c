"""``poolcal run``: run all stages, print the answer, make the drawings."""

from dataclasses import dataclass
from pathlib import Path

from pipeline.config.session import Calibrated
from pipeline.run import runner
from pipeline.run.progress import Progress
from pipeline.run.results import calibration
from pipeline.run.workers import workers
from stages import load
from stages.commands.answer import print_result, say_failures, say_next, say_where
from stages.commands.draw import Drawings, draw_missing
from stages.commands.entry import raise_if_interrupted


@dataclass(frozen=True)
class RunOptions:
    """Options of a run: the number of workers, the cluster if any, the drawings, and what may be overwritten."""

    jobs: int | None
    executor: str | None  # address of a dask scheduler
    drawings: Drawings
    overwrite: bool  # True: replace another session's run


@dataclass(frozen=True)
class Done:
    """What a run did: its exit status, the names of the stages that were run, the kinds of drawings that failed."""

    status: int  # 0: accepted, 1: rejected
    ran: list[str]
    not_drawn: list[str]


def command(session: Path, config: Path, run: Path, calibrated: Calibrated, options: RunOptions) -> int:
    """Calibrate a session as :func:`calibrate` does; return 0: accepted, 1: rejected."""
    return calibrate(session, config, run, calibrated, options).status


def calibrate(session: Path, config: Path, run: Path, calibrated: Calibrated, options: RunOptions) -> Done:
    """Calibrate a session, print the answer, and draw.

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
    """
    with workers(options.jobs, options.executor) as pool:
        ran = runner.run(
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
    failures = draw_missing(run, options.drawings, jobs)
    say_failures(failures, "; the calibration is complete")
    raise_if_interrupted()
    say_where(run)
    if status == 0 and calibrated == "mbes":
        say_next(run, [str(head["name"]) for head in calibration(run, several_heads=True).get("heads", ())])
    return Done(status, ran, [failure.kind for failure in failures])
