"""``poolcal stage``: run one stage of a run."""

from functools import partial
from pathlib import Path

from pipeline.errors import ConfigError
from pipeline.run import runner
from pipeline.run.found_target import remembered_target
from pipeline.run.progress import Progress
from pipeline.run.settings import calibrated_in, holds_run, load_settings
from pipeline.run.workers import workers
from stages import load, names_in
from stages.commands.answer import print_result, say_failures
from stages.commands.draw import draw_missing
from stages.commands.run import RunOptions


def command(name: str, run: Path, session: Path | None, config: Path | None, options: RunOptions) -> int:
    """Run one stage, if it is out of date.

    Parameters
    ----------
    name
        The stage's name.
    run
        The run folder.
    session, config
        The session's folder and the pool's YAML file; both None: the settings in run.yaml.
    options
        Workers and drawings. Another session's results are never replaced.

    Returns
    -------
    int
        0; after the last stage 1 if the result was rejected.
    """
    names = names_in(run)
    if name not in names:
        raise ConfigError(f"NAME {name!r}: is no stage; the stages are {', '.join(names)}")
    if (session is None) != (config is None):
        raise ConfigError("--session and --config: give both, or neither to use those in RUN/run.yaml")
    calibrated = calibrated_in(run) if holds_run(run) else "mbes"
    settings, progress = None, Progress()
    with workers(options.jobs, options.executor) as pool:
        if session is not None and config is not None:
            find = partial(remembered_target, run, names, session, workers=pool, progress=progress)
            settings = load_settings(session, config, calibrated, find)
        runner.run_stage(load(calibrated), name, run, settings=settings, workers=pool, progress=progress)
    status = print_result(run) if name == names[-1] else 0
    say_failures(draw_missing(run, options.drawings))
    return status
