"""A finished run's tables and streams, read as they were written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.parquet import read_table, rows_of
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import ParquetPart, Stream
from pipeline.atomic_files import read_json
from pipeline.config.stage_settings import plain_settings
from pipeline.errors import ArtefactError, ConfigError
from pipeline.run import manifest
from pipeline.run.settings import read_settings


@dataclass(frozen=True)
class Tables:
    """What lies in a run folder."""

    run: Path

    def table(self, artefact: Artefact, *columns: str) -> pd.DataFrame:
        """The table, or these columns of it."""
        return read_table(self.run / artefact.owner / f"{artefact.name}.parquet", artefact, columns)

    def stream(self, artefact: Artefact, *columns: str) -> Stream:
        folder = self.run / artefact.owner / artefact.name
        return Stream(tuple(ParquetPart(path, columns or None) for path in sorted(folder.glob("part-*.parquet"))))

    def sample(self, artefact: Artefact, at_most: int, *columns: str) -> tuple[dict[str, np.ndarray], int]:
        """These columns of evenly spaced rows of a stream, at most so many; and one in how many that is."""
        stream = self.stream(artefact, *columns)
        total = sum(rows_of(part.path) for part in stream.parts if isinstance(part, ParquetPart))
        step, seen = max(1, -(-total // at_most)), 0
        pieces: list[dict[str, np.ndarray]] = []
        for batch in stream.batches():
            rows = len(next(iter(batch.values())))
            first = -seen % step
            pieces.append({name: values[first::step].copy() for name, values in batch.items()})  # no view of all
            seen += rows
        if not pieces:
            return {name: np.empty(0) for name in columns}, step
        return {name: np.concatenate([piece[name] for piece in pieces]) for name in columns}, step


def calibration(run: Path) -> dict[str, Any]:
    """RUN/report/calibration.json."""
    path = run / "report" / "calibration.json"
    if run.is_file():
        raise ConfigError(f"{run}: is a file; RUN is a run folder, and stands first")
    try:
        content = read_json(path)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise ArtefactError(f"{path}: cannot be read ({reason}); run poolcal run again") from error
    if not isinstance(content, dict) or content.get("verdict") not in ("accepted", "rejected"):
        raise ArtefactError(f"{path}: holds no verdict; run poolcal run again")
    return content


def recording_path(run: Path, stage: str) -> Path:
    """Where a stage's recording lies."""
    return run / stage / f"{stage}.rrd"


def agreeing(run: Path, stages: Sequence[str]) -> dict[str, manifest.Manifest]:
    """The finished stages that follow from each other and from run.yaml, in order."""
    settings = plain_settings(read_settings(run).resolved())
    found: dict[str, manifest.Manifest] = {}
    for stage in stages:
        one = manifest.read(run / stage)
        if one is not None and manifest.consistent(found | {stage: one}) and _as_set(one, settings):
            found[stage] = one
    return found


def _as_set(one: manifest.Manifest, settings: Mapping[str, Any]) -> bool:
    """Whether the stage ran with the settings in run.yaml."""
    return all(name in settings and _covers(settings[name], value) for name, value in one.key.config.items())


def _covers(setting: Any, used: Any) -> bool:
    """Whether a stage that used so much of a setting used it as it is: a stage has some of a block's fields."""
    if not (isinstance(setting, dict) and isinstance(used, dict)):
        return bool(setting == used)
    return all(name in setting and setting[name] == value for name, value in used.items())


PAGE = "report.html"
