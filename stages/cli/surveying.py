"""Commands that take a result to the survey."""

from pathlib import Path
from typing import Annotated

import typer

from stages.cli.application import app
from stages.cli.arguments import AsJson, RunFolder


@app.command("check-entry")
def _check_entry(
    run_folder: RunFolder,
    soundings: Annotated[
        Path,
        typer.Argument(metavar="SOUNDINGS", help="the session's soundings by the survey software: XYZ, CSV, LAS, GSF"),
    ],
    crs: Annotated[
        str | None,
        typer.Option("--crs", metavar="CRS", help="of the coordinates, such as EPSG:32651; default: what fits"),
    ] = None,
    other_heights: Annotated[
        bool, typer.Option("--other-heights", help="heights are not ellipsoidal: do not judge z")
    ] = False,
    as_json: AsJson = False,
) -> int:
    """Check that the mount was entered rightly elsewhere.

    Compares soundings of the same session, as the survey software placed them with the values that were entered into
    it. Status 1 if they were not entered rightly, or if it cannot be told.
    """
    from stages.commands import check_entry

    return check_entry.command(run_folder, soundings, crs, other_heights, as_json)
