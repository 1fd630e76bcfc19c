"""``poolcal laser``: calibrate the laser itself, and write its mount into session.yaml."""

import sys
from pathlib import Path

from pipeline.language.speaking import say
from stages.commands import laser_mount, run
from stages.commands.run import RunOptions


def command(session: Path, config: Path, run_folder: Path, write: bool, options: RunOptions) -> int:
    """Calibrate the laser.

    Parameters
    ----------
    session
        Folder with session.yaml and the raw files.
    config
        The pool's YAML file.
    run_folder
        Folder for the results.
    write
        True: write an accepted mount into session.yaml.
    options
        Workers, drawings and overwriting.

    Returns
    -------
    int
        0: accepted, 1: rejected.
    """
    status = run.command(session, config, run_folder, "laser", options)
    if write and status == 0:
        say(laser_mount.write(session, run_folder), sys.stdout)
    return status
