"""A finished run's tables and streams, read as they were written."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.artefacts.parquet import read_table, rows_of
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import ParquetPart, Stream


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
