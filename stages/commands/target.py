"""``poolcal target``: walls and slopes that can serve as a target, found in a session's laser points."""

import sys
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


def command(folder: Path, out: Path | None, html: Path | None, depth_m: float | None, jobs: int | None) -> int:
    """Print the planes that were found; write them as a pool's config, and as a page with pictures.

    Parameters
    ----------
    folder
        The session folder.
    out
        The config to write; None: none is written.
    html
        The page to write; None: none is written.
    depth_m
        Depth below the water to which faces are continued; None: the usual one.
    jobs
        Number of workers.
    """
    least, most = DEPTHS_M
    depth_m = DEPTH_M if depth_m is None else depth_m
    if not least <= depth_m <= most:
        raise ConfigError(f"--depth {depth_m:g}: must be {least:g} to {most:g} m, the depth of the water at the wall")
    refuse_output("--out", out, suffix=".yaml", begins=FIRST.encode())
    refuse_output("--html", html, folder, begins=b"<!doctype html>")
    session = load_session(folder, with_cast)
    with workers(jobs, None) as pool:
        place = place_in(folder, session, depth_m, pool)
    say(table_text(place), sys.stdout)
    if out is not None:
        write_text(out, pool_yaml(place))
        say(f"\nWritten: {out}", sys.stdout)
    if html is not None:
        from pipeline.results.pages.place_page import place_page  # a second to import, and few want a page

        write_text(html, place_page(place, session.name))
        say(f"\nWritten: {html}", sys.stdout)
    return 0
