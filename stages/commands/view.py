"""``poolcal view``: show a run's recordings, or two runs side by side, in the Rerun viewer."""

import sys
from pathlib import Path

from pipeline.atomic_files import temporary_folder
from pipeline.errors import ConfigError
from pipeline.language.speaking import say
from pipeline.results.units import Tolerances
from pipeline.run.settings import read_settings
from stages import ORDER
from stages.commands.answer import say_failures
from stages.commands.diff import compare_runs, write_two_runs
from stages.commands.draw import Drawings, draw_missing
from stages.views.recording import recordings_of
from stages.views.viewer import show_recordings


def command(first: Path, second: Path | None, stage: str | None) -> int:
    """Open the viewer, and wait until it is closed.

    Parameters
    ----------
    first
        A run folder.
    second
        The run folder to show beside the first; None: no second run.
    stage
        The stage to show; None: all stages. Not allowed with two runs.

    Returns
    -------
    int
        0, or 1 after an error in the viewer.
    """
    if stage is not None and stage not in ORDER:
        raise ConfigError(f"--stage {stage!r}: is no stage; the stages are {', '.join(ORDER)}")
    if second is None:
        if len(read_settings(first).session.heads) > 1:
            say(
                "Note: the sonar has several heads; the recordings of the stages before adjust show the first alone",
                sys.stderr,
            )
        say_failures(draw_missing(first, Drawings(report=False, recordings=True)))
        copy = f"copy {first}/*/*.rrd to a machine with one, or open {first}/report/report.html"
        return show_recordings(recordings_of(first, stage), copy)
    if stage is not None:
        raise ConfigError(f"--stage {stage}: two runs are shown as a whole; leave it out, or name one run")
    difference = compare_runs(first, second, Tolerances())
    if "heads" in difference:
        raise ConfigError(f"{first}: is of a sonar with several heads: two such runs are not shown; see poolcal diff")
    with temporary_folder() as place:
        path = place / "pair.rrd"
        write_two_runs(first, second, difference, path)
        copy = f"write both by poolcal diff {first} {second} --rrd FILE, and copy that to a machine with one"
        return show_recordings([path], copy)
