"""Files from real instruments. They are not part of the program: POOLCAL_DATA names the folder that holds them."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.config.instruments import Sensor
from pipeline.readers.dispatch import raw_parts
from tests.support.real_files import DEFAULT, settings_of

Columns = dict[str, np.ndarray]
Read = Callable[..., tuple[Columns, dict[str, int]]]


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real files."""
    folder = Path(os.environ.get("POOLCAL_DATA") or DEFAULT)
    if not folder.is_dir():
        pytest.skip(f"no real files: {folder} is no folder; set POOLCAL_DATA to the one that holds them")
    return folder




@pytest.fixture
def read(data: Path, tmp_path: Path) -> Read:
    """Reads a file as a session would: all its rows, and what was left out by reason; with ``sigmas``, of an INS all
    rows of what it says of its accuracy."""

    def read_(
        sensor: Sensor, kind: str, name: str, content: bytes | None = None, sigmas: bool = False, **more: Any
    ) -> Any:
        path = tmp_path / Path(name).name
        if content is None:
            shutil.copy(data / name, path)
        else:
            path.write_bytes(content)
        chunks = [
            chunk for part in raw_parts(sensor, settings_of(sensor, path.name, kind, **more), tmp_path)
            for chunk in part.chunks()
        ]
        dropped: dict[str, int] = {}
        for chunk in chunks:
            for reason, number in chunk.dropped.items():
                dropped[reason] = dropped.get(reason, 0) + number
        wanted = [chunk.sigmas if sigmas else chunk.columns for chunk in chunks]
        full = [columns for columns in wanted if columns]
        names = full[0] if full else {}
        return {name: np.concatenate([columns[name] for columns in full]) for name in names}, dropped

    return read_
