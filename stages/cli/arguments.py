"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

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
