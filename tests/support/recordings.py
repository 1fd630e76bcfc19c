"""What is in a recording, read back with the SDK."""

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rerun.chunk import RrdReader

Chunks = dict[str, list[Any]]


def read(run: Path, stage: str) -> Chunks:
    found: Chunks = defaultdict(list)
    for chunk in RrdReader(run / stage / f"{stage}.rrd").stream():
        found[str(chunk.entity_path)].append(chunk.to_record_batch())
    return found


def rows_in(path: Path) -> int:
    return sum(len(pd.read_parquet(part)) for part in path.glob("part-*.parquet"))


def points(chunks: list[Any]) -> np.ndarray:
    lists = [row for chunk in chunks for row in chunk.column("Points3D:positions").to_pylist()]
    return np.array([point for row in lists for point in row])


def strip(chunks: list[Any]) -> np.ndarray:
    """Return the corners (k, 3) of a single line strip."""
    ((corners,),) = [row for chunk in chunks for row in chunk.column("LineStrips3D:strips").to_pylist()]
    return np.array(corners)


def text(found: Chunks, path: str) -> str:
    (chunk,) = found[path]
    ((written,),) = chunk.column("TextDocument:text").to_pylist()
    return str(written)


def placed(chunks: list[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return the translation and the rotation matrix of a frame; a column after the other is stored."""
    (chunk,) = [one for one in chunks if "Transform3D:translation" in one.schema.names]
    (translation,) = chunk.column("Transform3D:translation").to_pylist()[0]
    (matrix,) = chunk.column("Transform3D:mat3x3").to_pylist()[0]
    return np.array(translation), np.reshape(matrix, (3, 3)).T
