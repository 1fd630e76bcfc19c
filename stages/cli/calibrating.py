"""Commands that make results: a simulated session, a run, many runs, one stage."""

from pathlib import Path
from typing import Annotated

import typer

import pipeline
from stages import ORDER
from stages.cli.application import app
from stages.cli.arguments import Address, Jobs, NewRun, Overwrite, Pool, Recordings, Report, RunFolder, Session

SCENARIOS = ", ".join(sorted(path.stem for path in (pipeline.CONFIGS / "scenarios").glob("*.yaml")))


@app.command("simulate")
def _simulate(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="session folder to make; truth goes to OUT.truth.json")],
    scenario: Annotated[
        Path | None,
        typer.Option("--scenario", metavar="FILE", help=f"YAML file, or one of {SCENARIOS}; default: the demo's pool"),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="of all random numbers")] = 1,
) -> int:
    """Write a pool session with known truth as instrument files."""
    from stages.commands import simulate

    return simulate.command(out, scenario, seed)


@app.command("run")
def _run(
    session: Session,
    config: Pool,
    run_folder: NewRun,
    jobs: Jobs = None,
    executor: Address = None,
    recordings: Recordings = True,
    report: Report = True,
    overwrite: Overwrite = False,
) -> int:
    """Run all stages that are out of date, and say why each is."""
    from stages.commands import run
    from stages.commands.draw import Drawings

    options = run.RunOptions(jobs, executor, Drawings(report, recordings), overwrite)
    return run.command(session, config, run_folder, "mbes", options)


@app.command("laser")
def _laser(
    session: Session,
    config: Pool,
    run_folder: NewRun,
    jobs: Jobs = None,
    executor: Address = None,
    recordings: Recordings = True,
    report: Report = True,
    write: Annotated[bool, typer.Option("--write/--no-write", help="put an accepted mount into session.yaml")] = True,
    overwrite: Overwrite = False,
) -> int:
    """Calibrate the laser itself, from its own passes at the target.

    The adjustment estimates all six angles and lever-arm components, with the coarse mount as an observation. The
    result names those that are not good enough.
    """
    from stages.commands import laser
    from stages.commands.draw import Drawings
    from stages.commands.run import RunOptions

    options = RunOptions(jobs, executor, Drawings(report, recordings), overwrite)
    return laser.command(session, config, run_folder, write, options)


@app.command("repeat")
def _repeat(
    fleet: Annotated[Path, typer.Argument(metavar="FLEET", help="YAML file that lists them, as configs/fleet.yaml")],
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", metavar="N", min=1, help="sessions at a time; default: one a core, at most 4"),
    ] = None,
    executor: Address = None,
    recordings: Recordings = True,
    report: Report = True,
) -> int:
    """Bring many sessions up to date, then show one table.

    Goes on past a session that is refused. Status 1 if any was rejected, 2 if any could not run. A second call
    computes only what is out of date.
    """
    from stages.commands import repeat
    from stages.commands.draw import Drawings

    return repeat.command(fleet, jobs, executor, Drawings(report, recordings))


@app.command("stage")
def _stage(
    name: Annotated[str, typer.Argument(metavar="NAME", help=f"name of the stage to run, one of {', '.join(ORDER)}")],
    run_folder: RunFolder,
    session: Annotated[Path | None, typer.Option("--session", help="default: as in RUN/run.yaml")] = None,
    config: Annotated[Path | None, typer.Option("--config", help="default: as in RUN/run.yaml")] = None,
    jobs: Jobs = None,
    executor: Address = None,
    recordings: Recordings = True,
    report: Report = True,
) -> int:
    """Run one stage, if it is out of date.

    The stages before it must be up to date.
    """
    from stages.commands import stage
    from stages.commands.draw import Drawings
    from stages.commands.run import RunOptions

    options = RunOptions(jobs, executor, Drawings(report, recordings), overwrite=False)
    return stage.command(name, run_folder, session, config, options)


@app.command("verify")
def _verify(run_folder: RunFolder, jobs: Jobs = None) -> int:
    """Recheck every digest of a run.

    Hashes again everything that it read and wrote, and lists what is not as recorded.
    """
    from stages.commands import verify

    return verify.command(run_folder, jobs)
