"""One reading of a session's files: the INS's records, and what is drawn of the laser's points.

All workers begin at once: while one reads the INS, others unpack points. So points are drawn by their times alone, and
placed later.
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pipeline.adjustment.ins_drift import drift_model, pose_noise
from pipeline.artefacts.catalogue.points import INS_SIGMAS
from pipeline.artefacts.streams import Batch, Part, Stream
from pipeline.config.session import Ins
from pipeline.finding.kept_points import Drawn, drawn_points, first_limit
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.readers.file_summaries import thin_sigmas
from pipeline.readers.track_tables import trajectory_table


def read_files(ins: Stream, laser: Stream) -> tuple[pd.DataFrame, list[Batch], Iterator[Drawn]]:
    """Return the INS's records in order of time, the sigmas that its files state, and the laser's drawn points.

    Points come part by part, as the workers read them (:func:`pipeline.finding.kept_points.drawn_points`).
    """
    limit = first_limit(laser.parts)
    work = [partial(_ins_part, part) for part in ins.parts]
    results: Iterator[Any] = iter(
        laser.mapper(_called, [*work, *(partial(drawn_points, part, limit) for part in laser.parts)])
    )
    read = [next(results) for _ in work]
    records = trajectory_table([batch for batches, _ in read for batch in batches])[0]
    return records, [batch for _, sigmas in read for batch in sigmas], results


def noise_over_all(ins: Ins, sigmas: list[Batch], t_ns: np.ndarray) -> PoseNoise:
    """Return the INS's errors over the whole session, whose records have the times (n,), by its files or settings."""
    names = [column.name for column in INS_SIGMAS.columns]
    stated = {name: np.concatenate([chunk[name] for chunk in sigmas]) for name in names} if sigmas else {}
    whole = pd.DataFrame({"start_ns": t_ns[:1], "end_ns": t_ns[-1:]})
    return pose_noise(drift_model(ins, pd.DataFrame(stated, columns=names), whole), ins.white)


def _called(work: partial[Any]) -> Any:
    return work()


def _ins_part(part: Part) -> tuple[list[Batch], list[Batch]]:
    """Return the records and the stated sigmas of one part of the INS's files."""
    records: list[Batch] = []
    sigmas: list[Batch] = []
    for chunk in part.chunks():
        records += [chunk.columns] if chunk.columns else []
        sigmas += [thin_sigmas(chunk.sigmas)] if chunk.sigmas else []
    return records, sigmas
