"""``poolcal`` alone: the usual way of work, and the next step in the present folder."""

import os
import sys
from collections.abc import Collection
from pathlib import Path

from pipeline.config.fill_in import unfilled
from pipeline.config.yaml_file import SESSION_YAML, text_of
from pipeline.errors import ConfigError
from pipeline.language.speaking import say

WAY: tuple[tuple[str, str, str], ...] = (  # command, its arguments, what it does
    ("init", "FOLDER", "begin: session.yaml and pool.yaml from the raw files"),
    ("coarse", "MARKS.yaml --session SESSION", "mounts to begin with, from a survey of marks"),
    ("check", "SESSION --config POOL.yaml", "what is wrong with the files, in seconds"),
    ("run", "SESSION --config POOL.yaml --run RUN", "calibrate: verdict, values, RUN/report/report.html"),
    ("view", "RUN", "look at the points and the residuals"),
    ("export", "RUN", "the values as the survey's software wants them"),
    ("check-entry", "RUN", "whether they were entered with the right signs"),
    ("diff", "RUN_A RUN_B", "has the sonar moved since?"),
)
RUN_YAML = "run.yaml"


def command(commands: Collection[str], here: Path) -> int:
    """Print the way of work and the next step.

    Parameters
    ----------
    commands
        The names of the commands that there are.
    here
        The present folder.
    """
    way = [(f"poolcal {name} {words}", about) for name, words, about in WAY if name in commands]
    width = max(len(words) for words, _ in way)
    lines = [f"  {number}  {words:<{width}}  {about}" for number, (words, about) in enumerate(way, 1)]
    head = "poolcal calibrates a boat's multibeam sonar against its laser scanner in a pool. The usual way:"
    foot = "All commands: poolcal --help. One of them: poolcal run --help"
    say("\n".join([head, *lines, next_step(here), foot]), sys.stdout)
    return 0


def next_step(here: Path) -> str:
    """Return the sentence about the next step in a folder: a run's, a session's, or another."""
    if (here / RUN_YAML).is_file():
        if (here / "report" / "calibration.json").is_file():
            return "Here is a run: open report/report.html, and see its points with poolcal view ."
        return "Here is a run that did not end: give the same poolcal run again"
    path = here / SESSION_YAML
    if not os.path.lexists(path):
        return "Next: poolcal init FOLDER, where FOLDER holds the raw files of one session"
    pool = here / "pool.yaml"
    config = "pool.yaml" if pool.is_file() else "POOL.yaml"
    try:
        open_keys = {file.name: len(unfilled(text_of(file), file)) for file in (path, pool) if file.is_file()}
    except ConfigError as error:
        return f"Here is a session, but {error}"
    for name, number in open_keys.items():
        if number:
            return f"Here is a session: fill in {name} ({number} x FILL_IN); then poolcal check . --config {config}"
    return f"Here is a session: poolcal check . --config {config}, then poolcal run . --config {config} --run ../RUN"
