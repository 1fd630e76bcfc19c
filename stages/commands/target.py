"""``poolcal target``: walls and slopes that can serve as a target, found in a session's laser points."""

import sys
from pathlib import Path

from pipeline.atomic_files import write_text
from pipeline.config.found import DEPTHS_M
from pipeline.config.load import load_session
from pipeline.errors import ConfigError
from pipeline.finding.found_text import table_text
from pipeline.finding.pool_file import FIRST, pool_yaml
from pipeline.language.speaking import say
from pipeline.readers.casts import with_cast
from pipeline.run.found_target import place_in
from pipeline.run.output_files import refuse_output
from pipeline.run.workers import workers


def command(folder: Path, out: Path | None, depth_m: float, jobs: int | None) -> int:
    """Print the planes that were found; write them as a pool's config.

    Parameters
    ----------
    folder
        The session folder.
    out
        The config to write; None: none is written.
    depth_m
        Depth below the water to which faces are continued.
    jobs
        Number of workers.
    """
    least, most = DEPTHS_M
    if not least <= depth_m <= most:
        raise ConfigError(f"--depth {depth_m:g}: must be {least:g} to {most:g} m, the depth of the water at the wall")
    refuse_output("--out", out, suffix=".yaml", begins=FIRST.encode())
    session = load_session(folder, with_cast)
    with workers(jobs, None) as pool:
        place = place_in(folder, session, depth_m, pool)
    say(table_text(place), sys.stdout)
    if out is not None:
        write_text(out, pool_yaml(place))
        say(f"\nWritten: {out}", sys.stdout)
    return 0
