"""``poolcal check-entry``: whether the calibrated mount was entered rightly into a survey software."""

import json
from pathlib import Path

from pipeline.entry_check.check import check_entry
from pipeline.entry_check.words import check_json, check_text
from pipeline.errors import ConfigError
from pipeline.exports.registry import target_named
from pipeline.results.finished_run import FinishedRun
from stages import ORDER
from stages.commands.answer import print_answer


def command(
    run: Path, soundings: Path, crs: str | None, other_heights: bool, program: str | None, as_json: bool
) -> int:
    """Print the answer.

    Parameters
    ----------
    run
        Run folder.
    soundings
        Soundings of the same session, as the software placed them.
    crs
        CRS of their coordinates; None: by the file, or guessed.
    other_heights
        Whether their heights are above another surface than the ellipsoid.
    program
        Name of the program in whose signs the values are shown as well; None: in none.
    as_json
        True: print JSON, for programs.

    Returns
    -------
    int
        0: entered rightly; 1: not, or it cannot be told.
    """
    target = None if program is None else target_named(program, "--to")
    if target is not None and target.sensor == "laser":
        raise ConfigError(f"--to {program}: takes the laser's mount, and has no soundings; name the survey program")
    check = check_entry(FinishedRun.read(run, ORDER), soundings, crs, other_heights)
    text = json.dumps(check_json(check), indent=1, ensure_ascii=False) if as_json else check_text(check, target)
    return print_answer(text, check.answer.is_right, as_is=as_json)
