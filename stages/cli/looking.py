"""Commands that show results, or compare them."""

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from stages import ORDER
from stages.cli.application import app
from stages.cli.arguments import AsJson, Day, RunFolder


@app.command("view")
def _view(
    first: RunFolder,
    second: Annotated[Path | None, typer.Argument(metavar="[RUN]", help="another run, shown beside the first")] = None,
    stage: Annotated[
        str | None, typer.Option(help=f"recordings of one stage alone, by its name: {', '.join(ORDER)}")
    ] = None,
) -> int:
    """Open a run's recordings in the Rerun viewer, or two runs side by side.

    Nothing is served beyond this machine.
    """
    from stages.commands import view

    return view.command(first, second, stage)


@app.command("report")
def _report(
    run_folder: RunFolder,
    pdf: Annotated[Path | None, typer.Option(metavar="FILE", help="write it as PDF as well, for print")] = None,
    certificate: Annotated[bool, typer.Option("--certificate", help="of the PDF its first two pages alone")] = False,
) -> int:
    """Draw the report of a finished run, certificate first.

    PDF needs WeasyPrint (pip install 'poolcal[pdf]') or Chromium.
    """
    from stages.commands import report

    return report.command(run_folder, pdf, certificate)


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
