"""A finished run's tables, streams, calibration.json and recordings, read as they were written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.parquet import read_table, row_count
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import ParquetPart, Stream
from pipeline.atomic_files import read_json
from pipeline.config.stage_settings import plain_settings
from pipeline.errors import ArtefactError, ConfigError
from pipeline.run import manifest
from pipeline.run.settings import read_settings

PAGE = "report.html"

@dataclass(frozen=True)
class Tables:
    """Tables and streams of a run folder."""

    run: Path

    def table(self, artefact: Artefact, *columns: str) -> pd.DataFrame:
        """Return the table with all columns, or with these ``columns`` alone."""
        return read_table(self.run / artefact.owner / f"{artefact.name}.parquet", artefact, columns)

    def stream(self, artefact: Artefact, *columns: str) -> Stream:
        """Return the stream with all columns, or with these ``columns`` alone."""
        folder = self.run / artefact.owner / artefact.name
        return Stream(tuple(ParquetPart(path, columns or None) for path in sorted(folder.glob("part-*.parquet"))))

    def sample(self, artefact: Artefact, at_most: int, *columns: str) -> tuple[dict[str, np.ndarray], int]:
        """Return every n-th row of a stream as arrays by column, and n.

        Parameters
        ----------
        artefact
            The stream.
        at_most
            The largest number of rows to return.
        columns
            Names of the columns.
        """
        stream = self.stream(artefact, *columns)
        total = sum(row_count(part.path) for part in stream.parts if isinstance(part, ParquetPart))
        step, rows_before = max(1, -(-total // at_most)), 0
        pieces: list[dict[str, np.ndarray]] = []
        for batch in stream.batches():
            rows = len(next(iter(batch.values())))
            first = -rows_before % step
            pieces.append({name: values[first::step].copy() for name, values in batch.items()})  # frees the batch
            rows_before += rows
        if not pieces:
            return {name: np.empty(0) for name in columns}, step
        return {name: np.concatenate([piece[name] for piece in pieces]) for name in columns}, step


def calibration(run: Path, several_heads: bool = False) -> dict[str, Any]:
    """Return the content of RUN/report/calibration.json.

    Parameters
    ----------
    run
        The run folder.
    several_heads
        False: refuse the run of a sonar with several heads. Its keys that are not in ``heads`` are the first head's.
    """
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
    if not several_heads and len(content.get("heads", ())) > 1:
        raise ConfigError(
            f"{run}: is the run of a sonar with {len(content['heads'])} heads, and this command takes one of a single "
            "head; poolcal report, export --head and diff take several"
        )
    return content


def recording_path(run: Path, stage: str) -> Path:
    """Return the path of a stage's recording."""
    return run / stage / f"{stage}.rrd"


def agreeing(run: Path, stages: Sequence[str]) -> dict[str, manifest.Manifest]:
    """Return, by stage and in order, the manifests of the results that agree with each other and with run.yaml."""
    settings = plain_settings(read_settings(run).resolved())
    manifests: dict[str, manifest.Manifest] = {}
    for stage in stages:
        result = manifest.read_manifest(run / stage)
        if result is not None and manifest.consistent(manifests | {stage: result}) and _is_as_set(result, settings):
            manifests[stage] = result
    return manifests


def _is_as_set(result: manifest.Manifest, settings: Mapping[str, Any]) -> bool:
    """Return whether the stage ran with the settings in run.yaml."""
    return all(name in settings and _covers(settings[name], value) for name, value in result.key.config.items())


def _covers(setting: Any, used: Any) -> bool:
    """Return whether ``used`` agrees with a setting. From a block of settings a stage may use only some fields."""
    if not (isinstance(setting, dict) and isinstance(used, dict)):
        return bool(setting == used)
    return all(name in setting and setting[name] == value for name, value in used.items())
