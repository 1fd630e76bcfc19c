"""The check of an entry as a whole: a run and a file of soundings, compared."""

from dataclasses import dataclass, replace
from pathlib import Path

from pipeline.entry_check.answer import Answer, answer_of
from pipeline.entry_check.hypotheses import starts
from pipeline.entry_check.identification import Pairs, identify
from pipeline.entry_check.run_soundings import EntrySource, RunSide, run_side
from pipeline.entry_check.soundings_file import FileSide, file_side
from pipeline.errors import RawDataError
from pipeline.results.finished_run import FinishedRun


@dataclass(frozen=True)
class EntryCheck:
    """What was compared, and the answer."""

    run: RunSide
    source: EntrySource
    file: FileSide
    pairs: Pairs
    answer: Answer


def check_entry(run: FinishedRun, path: Path, crs: str | None, other_heights: bool) -> EntryCheck:
    """Compare a file of soundings with a run.

    Parameters
    ----------
    run
        The run.
    path
        The file.
    crs
        The CRS of its coordinates; None: it says so itself, or it is guessed.
    other_heights
        Whether its heights are above another surface than the ellipsoid.
    """
    side = run_side(run)
    file = file_side(path, crs, side)
    source = replace(side.source, convergence_rad=file.placing.convergence_rad)
    pairs = identify(side.soundings, file.points, starts(source))
    if pairs is None:
        raise RawDataError(_not_found(path, file))
    heights_differ = other_heights or file.depths or pairs.negated or file.placing.geoid is not None
    answer = answer_of(pairs, source, heights_differ, file.points.rounding_m)
    return EntryCheck(side, source, file, pairs, answer)


def _not_found(path: Path, file: FileSide) -> str:
    says = f"{path}: its {len(file.points.row):,} soundings near the track are not found among the run's"
    if file.cell_m is not None:
        return f"{says}: they stand in a grid of {file.cell_m:.2f} m; export single soundings, not a surface"
    return (
        f"{says}: is it the same session? Export all its single soundings, not thinned, gridded or averaged, 3 "
        "decimals, in the order of time"
    )
