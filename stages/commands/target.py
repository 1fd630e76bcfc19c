"""``poolcal target``: walls and slopes that can serve as a target, found in a session's laser points."""

import sys
from dataclasses import dataclass
from pathlib import Path

from pipeline.atomic_files import write_text
from pipeline.config.found import DEPTH_M, DEPTHS_M
from pipeline.config.load import load_session
from pipeline.errors import ConfigError
from pipeline.finding.found_text import table_text
from pipeline.finding.pool_file import FIRST, pool_yaml
from pipeline.language.speaking import say
from pipeline.readers.casts import with_cast
from pipeline.run.found_target import place_in
from pipeline.run.output_files import refuse_output
from pipeline.run.workers import workers


@dataclass(frozen=True)
class TargetOutputs:
    """Files to write, None: none: a pool's config, a page with pictures, a recording."""

    out: Path | None
    html: Path | None
    rrd: Path | None


def command(folder: Path, outputs: TargetOutputs, depth_m: float | None, jobs: int | None) -> int:
    """Print the planes that were found; write them as a pool's config, as a page with pictures, as a recording.

    Parameters
    ----------
    folder
        The session folder.
    outputs
        The files to write.
    depth_m
        Depth below the water to which faces are continued; None: the usual one.
    jobs
        Number of workers.
    """
    least, most = DEPTHS_M
    depth_m = DEPTH_M if depth_m is None else depth_m
    if not least <= depth_m <= most:
        raise ConfigError(f"--depth {depth_m:g}: must be {least:g} to {most:g} m, the depth of the water at the wall")
    refuse_output("--out", outputs.out, suffix=".yaml", begins=FIRST.encode())
    refuse_output("--html", outputs.html, folder, begins=b"<!doctype html>")
    refuse_output("--rrd", outputs.rrd, folder)
    session = load_session(folder, with_cast)
    with workers(jobs, None) as pool:
        place = place_in(folder, session, depth_m, pool)
    said = table_text(place)
    say(said, sys.stdout)
    if outputs.out is not None:
        write_text(outputs.out, pool_yaml(place))
    if outputs.html is not None:
        from pipeline.results.pages.place_page import place_page  # a second to import, and few want a page

        write_text(outputs.html, place_page(place, session.name))
    if outputs.rrd is not None:
        from stages.views.place import save_place

        save_place(place, said, outputs.rrd)
    for file in (outputs.out, outputs.html, outputs.rrd):
        if file is not None:
            say(f"\nWritten: {file}", sys.stdout)
    return 0
