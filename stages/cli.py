"""The command line. It declares each command's arguments, and passes them to its module in :mod:`stages.commands`.

A command's module and its imports are loaded only when the command is called. Therefore ``--help`` answers at once.
"""

import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

import pipeline
from pipeline.console import say
from stages import ORDER
from stages.commands import entry

app = typer.Typer(
    name="poolcal",
    help="Calibrates a boat's multibeam sonar against its laser scanner in a pool.",
    epilog="Exit status: 0 done; 1 done, but the answer is no; 2 bad input or config; 3 a bug in poolcal.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

SCENARIOS = ", ".join(sorted(path.stem for path in (pipeline.CONFIGS / "scenarios").glob("*.yaml")))
SESSION_FILES = "folder with session.yaml and the raw files"
POOL_FILE = "the pool's YAML file"

Session = Annotated[Path, typer.Argument(metavar="SESSION", help=SESSION_FILES)]
SessionYaml = Annotated[Path, typer.Option("--session", metavar="SESSION", help="folder with session.yaml")]
Pool = Annotated[Path, typer.Option("--config", metavar="CONFIG", help=POOL_FILE)]
NewRun = Annotated[Path, typer.Option("--run", metavar="RUN", help="folder for the results")]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="run folder, as given to poolcal run")]
Jobs = Annotated[int | None, typer.Option("--jobs", metavar="N", help="workers; default: one a core, at most 4")]
Recordings = Annotated[bool, typer.Option("--recordings/--no-recordings", help="draw recordings for the Rerun viewer")]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="replace another session's run in RUN; its accepted result is kept")
]
Report = Annotated[bool, typer.Option("--report/--no-report", help="draw RUN/report/report.html")]
Address = Annotated[
    str | None, typer.Option("--executor", metavar="ADDRESS", help="dask scheduler; its workers must see these folders")
]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON, for programs")]
Day = ["%Y-%m-%d"]


def _print_version(asked: bool) -> None:
    if asked:
        say(f"poolcal {pipeline.__version__}", sys.stdout)
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="print the version and end")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="show the traceback of bad input as well")] = False,
) -> None:
    """Options of every command."""


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


@app.command("stage")
def _stage(
    name: Annotated[str, typer.Argument(metavar="NAME", help=f"one of {', '.join(ORDER)}")],
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


@app.command("view")
def _view(
    first: RunFolder,
    second: Annotated[Path | None, typer.Argument(metavar="[RUN]", help="another run, shown beside the first")] = None,
    stage: Annotated[str | None, typer.Option(help=f"one of {', '.join(ORDER)} alone")] = None,
) -> int:
    """Open a run's recordings in the Rerun viewer, or two runs side by side.

    Nothing is served beyond this machine.
    """
    from stages.commands import view

    return view.command(first, second, stage)


@app.command("diff")
def _diff(
    first: Annotated[Path, typer.Argument(metavar="A", help="run folder")],
    second: Annotated[Path, typer.Argument(metavar="B", help="run folder, compared with A")],
    tolerance_deg: Annotated[
        float | None, typer.Option(min=0.0, help="an angle that differs by more is a no, significant or not")
    ] = None,
    tolerance_mm: Annotated[float | None, typer.Option(min=0.0, help="the same for the lever arm")] = None,
    as_json: AsJson = False,
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="write it as a page as well")] = None,
    rrd: Annotated[Path | None, typer.Option(metavar="FILE", help="write both runs as one recording as well")] = None,
) -> int:
    """Compare two runs, to see whether the sonar has moved.

    Status 1 if the mounts differ significantly, or by more than a tolerance, or cannot be compared.
    """
    from pipeline.results.units import Tolerances
    from stages.commands import diff

    tolerances = Tolerances(tolerance_deg, tolerance_mm)
    return diff.command(first, second, tolerances, diff.DiffOutputs(as_json, html, rrd))


@app.command("history")
def _history(
    folder: Annotated[Path, typer.Argument(metavar="RUNS_DIR", help="folder that holds run folders")],
    out: Annotated[Path | None, typer.Option(help="folder for the page; default: RUNS_DIR/history")] = None,
    name: Annotated[str, typer.Option(help="sessions whose name matches this pattern, such as 'boat_a*'")] = "*",
    since: Annotated[datetime | None, typer.Option(formats=Day, help="first day, UTC")] = None,
    until: Annotated[datetime | None, typer.Option(formats=Day, help="last day, UTC")] = None,
) -> int:
    """Show all sessions of a boat on one page: charts, table, jumps.

    Writes history.html, history.csv and history.parquet.
    """
    from stages.commands import history

    return history.command(folder, out, name, since.date() if since else None, until.date() if until else None)


@app.command("check")
def _check(
    session: Session,
    config: Annotated[
        Path | None, typer.Option("--config", metavar="CONFIG", help=f"{POOL_FILE}: where it is")
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Look into a session's files before calibrating, in seconds. Status 1 if something is wrong."""
    from stages.commands import check

    return check.command(session, config, as_json)


@app.command("plan")
def _plan(
    file: Annotated[Path, typer.Argument(metavar="PLAN", help="YAML file of the plan; README.md lists its keys")],
    session: SessionYaml,
    config: Pool,
    out: Annotated[Path | None, typer.Option("--yaml", metavar="FILE", help="write the prediction as YAML")] = None,
    rrd: Annotated[Path | None, typer.Option("--rrd", metavar="FILE", help="write a recording of it")] = None,
) -> int:
    """Predict what passes will give, before any data, and choose better ones. Status 1 if they will not do."""
    from stages.commands import plan

    return plan.command(file, session, config, out, rrd)


@app.command("coarse")
def _coarse(
    file: Annotated[Path, typer.Argument(metavar="MARKS", help="YAML file: marks as surveyed, and as drawn")],
    session: SessionYaml,
    out: Annotated[Path | None, typer.Option("--yaml", metavar="FILE", help="write all of it as YAML")] = None,
    write: Annotated[bool, typer.Option("--write/--no-write", help="put the mounts into session.yaml")] = True,
) -> int:
    """Find coarse mounts from a survey of marks on bracket and instruments. Status 1 if the marks do not agree."""
    from stages.commands import coarse

    return coarse.command(file, session, out, write)


@app.command("compare")
def _compare(
    run_folder: RunFolder,
    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="OUT.truth.json of poolcal simulate")],
) -> int:
    """Set a simulated session's result beside its truth.

    Status 0 if it was accepted and every error is within four sigma.
    """
    from stages.commands import compare

    return compare.command(run_folder, truth)


def call(arguments: list[str]) -> int:
    """Run a command line and return its exit status; no exception is raised."""
    debug = "--debug" in arguments  # may stand anywhere in the line
    words = [word for word in arguments if word != "--debug"] or ["--help"]
    return entry.status_of(lambda: app(words, prog_name="poolcal", standalone_mode=False), debug)


def main() -> None:
    """Run the command line of this process, as the console script does."""
    entry.prepare_process()
    entry.end_process(call(sys.argv[1:]))


if __name__ == "__main__":
    main()
