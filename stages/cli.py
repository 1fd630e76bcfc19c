"""The command line: thin. Imports what computes only inside the command that computes."""

import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import pipeline
from pipeline.console import say
from pipeline.errors import ConfigError
from stages import ORDER, calibrated_in, load, names_in
from stages.commands import entry
from stages.commands.answer import answer_of, say_failures
from stages.commands.diff import comparison, save_pair

if TYPE_CHECKING:

    from stages.commands.draw import Painters

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


def _version(asked: bool) -> None:
    if asked:
        say(f"poolcal {pipeline.__version__}", sys.stdout)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version and end")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="show the traceback of bad input as well")] = False,
) -> None:
    """Options of every command."""


@app.command()
def simulate(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="session folder to make; truth goes to OUT.truth.json")],
    scenario: Annotated[
        Path | None,
        typer.Option("--scenario", metavar="FILE", help=f"YAML file, or one of {SCENARIOS}; default: the demo's pool"),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="of all random numbers")] = 1,
) -> None:
    """Write a pool session with known truth as instrument files."""
    from pipeline.atomic_files import writing
    from pipeline.simulation.session import simulate_to_folder

    if seed < 0:
        raise ConfigError(f"--seed {seed}: must not be negative")
    with writing(out):
        written = simulate_to_folder(out, scenario, seed)
    for name, value in written.items():
        say(f"{name}: {value:.1f}" if isinstance(value, float) else f"{name}: {value}", sys.stdout)


@app.command()
def run(
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="folder with session.yaml and the raw files")],
    config: Annotated[Path, typer.Option("--config", metavar="CONFIG", help="the pool's YAML file")],
    run_folder: Annotated[Path, typer.Option("--run", metavar="RUN", help="folder for the results")],
    jobs: Jobs = None,
    executor: Address = None,
    recordings: Recordings = True,
    report: Report = True,
    overwrite: Overwrite = False,
) -> int:
    """Run all stages that are out of date, and say why each is."""
    from stages.commands.run import calibrate

    return calibrate("mbes", session, config, run_folder, _go_on, jobs, executor, (report, recordings), overwrite)


@app.command()
def laser(
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="folder with session.yaml and the raw files")],
    config: Annotated[Path, typer.Option("--config", metavar="CONFIG", help="the pool's YAML file")],
    run_folder: Annotated[Path, typer.Option("--run", metavar="RUN", help="folder for the results")],
    jobs: Jobs = None,
    executor: Address = None,
    recordings: Recordings = True,
    report: Report = True,
    write: Annotated[bool, typer.Option("--write/--no-write", help="an accepted mount into session.yaml")] = True,
    overwrite: Overwrite = False,
) -> int:
    """Calibrate the laser itself, from its own passes at the target.

    Of its three angles and lever arm what this target and these passes can give; the rest is held, and said so.
    """
    from stages.commands.laser_mount import write as write_mount
    from stages.commands.run import calibrate

    status = calibrate("laser", session, config, run_folder, _go_on, jobs, executor, (report, recordings), overwrite)
    if write and status == 0:
        say(write_mount(session, run_folder), sys.stdout)
    return status


@app.command()
def stage(
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

    The stages before it must not be.
    """
    from pipeline.run import runner
    from pipeline.run.progress import Progress
    from pipeline.run.settings import holds_run, load_settings
    from pipeline.run.workers import workers
    from stages.commands.draw import Painters

    names = names_in(run_folder)
    if name not in names:
        raise ConfigError(f"NAME {name!r}: is no stage; the stages are {', '.join(names)}")
    if (session is None) != (config is None):
        raise ConfigError("--session and --config: give both, or neither to use those in RUN/run.yaml")
    calibrated = calibrated_in(run_folder) if holds_run(run_folder) else "mbes"
    settings = None
    if session is not None and config is not None:
        settings = load_settings(session, config, calibrated)
    with workers(jobs, executor) as pool:
        runner.run_stage(load(calibrated), name, run_folder, settings, pool, Progress())
    status = answer_of(run_folder) if name == names[-1] else 0
    say_failures(Painters(report, recordings).draw(run_folder))
    return status


@app.command()
def verify(run_folder: RunFolder, jobs: Jobs = None) -> int:
    """Recheck every digest of a run.

    Hashes again everything that it read and wrote, and lists what is not as recorded.
    """
    from pipeline.console import plural
    from pipeline.run.verify import verify as problems_of
    from pipeline.run.workers import workers

    with workers(jobs) as pool:
        problems = problems_of(load(calibrated_in(run_folder)), run_folder, pool)
    for problem in problems:
        say(problem, sys.stdout)
    say(plural(len(problems), "problem") if problems else f"{run_folder}: everything is as recorded", sys.stdout)
    return 1 if problems else 0


@app.command()
def view(
    first: RunFolder,
    second: Annotated[Path | None, typer.Argument(metavar="[RUN]", help="another run, shown beside the first")] = None,
    stage: Annotated[str | None, typer.Option(help=f"one of {', '.join(ORDER)} alone")] = None,
) -> int:
    """Open a run's recordings in the Rerun viewer, or two runs side by side.

    Nothing is served beyond this machine.
    """
    from stages.commands.view import view as open_viewer

    return open_viewer(first, second, stage)


@app.command()
def diff(
    first: Annotated[Path, typer.Argument(metavar="A", help="run folder")],
    second: Annotated[Path, typer.Argument(metavar="B", help="run folder, compared with A")],
    tolerance_deg: Annotated[
        float | None, typer.Option(min=0.0, help="an angle that differs by more is a no, significant or not")
    ] = None,
    tolerance_mm: Annotated[float | None, typer.Option(min=0.0, help="the same for the lever arm")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON, for programs")] = False,
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="write it as a page as well")] = None,
    rrd: Annotated[Path | None, typer.Option(metavar="FILE", help="write both runs as one recording as well")] = None,
) -> int:
    """Compare two runs: has the sonar moved?

    Status 1 if the mounts differ significantly, or by more than a tolerance, or cannot be compared.
    """
    import json

    from pipeline.atomic_files import write_text
    from pipeline.results.compare_text import comparison_text
    from pipeline.results.mount_difference import is_moved
    from pipeline.run.output_files import refuse_output

    found = comparison(first, second, tolerance_deg, tolerance_mm)
    for option, file in (("--html", html), ("--rrd", rrd)):
        refuse_output(option, file, first, second)
    if html is not None:
        from pipeline.results.pages.comparison import comparison_page

        write_text(html, comparison_page(found))
    if rrd is not None:
        save_pair(first, second, found, rrd)
    say(json.dumps(found, indent=1, ensure_ascii=False) if as_json else comparison_text(found), sys.stdout)
    return 1 if is_moved(found) else 0


@app.command()
def history(
    folder: Annotated[Path, typer.Argument(metavar="RUNS_DIR", help="folder that holds run folders")],
    out: Annotated[Path | None, typer.Option(help="folder for the page; default: RUNS_DIR/history")] = None,
    name: Annotated[str, typer.Option(help="sessions whose name matches this pattern, such as 'boat_a*'")] = "*",
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="first day, UTC")] = None,
    until: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="last day, UTC")] = None,
) -> int:
    """All sessions of a boat on one page: charts, table, jumps.

    Writes history.html, history.csv and history.parquet.
    """
    from pipeline.console import plural
    from pipeline.results.history import SessionFilter, read_history
    from pipeline.results.pages.history import write_history

    chosen = SessionFilter(name, since.date() if since else None, until.date() if until else None)
    found = read_history(folder, chosen)
    target = folder / "history" if out is None else out
    write_history(found, target, chosen)
    for problem in found.unreadable:
        say(f"left out: {problem}", sys.stderr)
    if found.not_shown:
        say(found.not_shown, sys.stdout)
    say(f"{plural(len(found.table), 'session')}: {target / 'history.html'}", sys.stdout)
    return 0


@app.command()
def check(
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="folder with session.yaml and the raw files")],
    config: Annotated[Path | None, typer.Option(metavar="CONFIG", help="the pool's YAML file: where it is")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON, for programs")] = False,
) -> int:
    """Look into a session's files before calibrating, in seconds. Status 1 if something is wrong."""
    from stages.commands.check import check as check_of

    said, wrong = check_of(session, config, as_json)
    say(said, sys.stdout)
    return 1 if wrong else 0


@app.command()
def plan(
    file: Annotated[Path, typer.Argument(metavar="PLAN", help="YAML file: passes, and what else README.md says")],
    session: Annotated[Path, typer.Option("--session", metavar="SESSION", help="folder with session.yaml")],
    config: Annotated[Path, typer.Option("--config", metavar="CONFIG", help="the pool's YAML file")],
    out: Annotated[Path | None, typer.Option("--yaml", metavar="FILE", help="write the prediction as YAML")] = None,
    rrd: Annotated[Path | None, typer.Option("--rrd", metavar="FILE", help="write a recording of it")] = None,
) -> int:
    """Predict what passes will give, before any data, and choose better ones. Status 1 if they will not do."""
    from pipeline.run.output_files import refuse_output
    from stages.commands.plan import plan as plan_of

    refuse_output("--yaml", out, session, begins=b"given:")
    refuse_output("--rrd", rrd, session)
    said, enough = plan_of(file, session, config, out, rrd)
    say(said, sys.stdout)
    return 0 if enough else 1


@app.command()
def coarse(
    file: Annotated[Path, typer.Argument(metavar="MARKS", help="YAML file: marks as surveyed, and as drawn")],
    session: Annotated[Path, typer.Option("--session", metavar="SESSION", help="folder with session.yaml")],
    out: Annotated[Path | None, typer.Option("--yaml", metavar="FILE", help="write all of it as YAML")] = None,
    write: Annotated[bool, typer.Option("--write/--no-write", help="put the mounts into session.yaml")] = True,
) -> int:
    """Coarse mounts from a survey of marks on bracket and instruments. Status 1 if the marks do not agree."""
    from pipeline.run.output_files import refuse_output
    from stages.commands.coarse import coarse_mounts

    refuse_output("--yaml", out, session, begins=b"agrees:")
    said, agrees = coarse_mounts(file, session, out, write)
    say(said, sys.stdout)
    return 0 if agrees else 1


@app.command()
def compare(
    run_folder: RunFolder,
    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="OUT.truth.json of poolcal simulate")],
) -> int:
    """Set a simulated session's result beside its truth.

    Status 0 if it was accepted and every error is within four sigma.
    """
    from stages.commands.truth import compare as table_of

    text, good = table_of(run_folder, truth)
    say(text, sys.stdout)
    return 0 if good else 1


# --- from exceptions to exit status ----------------------------------------------------------------------------------
def call(arguments: list[str]) -> int:
    """The exit status of a command line; nothing is raised."""
    debug = "--debug" in arguments  # accepted anywhere on the line
    words = [word for word in arguments if word != "--debug"] or ["--help"]
    return entry.status_of(lambda: app(words, prog_name="poolcal", standalone_mode=False), debug)


def _go_on(drawing: "Painters", run_folder: Path, stage: str) -> None:
    """After a stage; not where somebody interrupted it in a place in which Python ignores that."""
    if entry.interrupts:
        raise KeyboardInterrupt
    drawing.begin(run_folder, stage)


def main() -> None:
    """The console script."""
    entry.prepare()
    entry.leave(call(sys.argv[1:]))


if __name__ == "__main__":
    main()
