"""The one truth of the Inertial Explorer exports made here, and whether what is read of them is it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.files import build
from tests.support.files.ie_files import (
    ATTITUDE,
    DEGREES,
    HEIGHT,
    WEEK,
    Columns,
    Row,
    truth,
)

NS = 1_000_000_000
DAY_S = 86_400
WEEK_NS = 7 * DAY_S * NS
ROWS = truth()
POSE: Columns = {**DEGREES, **HEIGHT, **ATTITUDE}


def read(path: Path, **more: Any) -> tuple[dict[str, np.ndarray], dict[str, int]]:
    return build.read("ins", path, "inertial_explorer", **more)


def more_of(layout: str) -> dict[str, Any]:
    return {"gps_week": WEEK} if layout == "commas" else {}


def is_truth(columns: dict[str, np.ndarray], given: list[Row] = ROWS) -> None:
    has_times(columns, given)
    for name in ("latitude", "longitude", "roll", "pitch"):
        expected = np.radians([getattr(row, name) for row in given])
        assert columns[f"{name}_rad"] == pytest.approx(expected, abs=2e-8 if name in ("roll", "pitch") else 2e-12), name
    assert columns["azimuth_rad"] == pytest.approx(np.radians([row.heading for row in given]), abs=2e-8)
    assert columns["height_m"] == pytest.approx([row.height for row in given], abs=1e-3)


def rows_of_day(day: int, count: int = 60) -> list[Row]:
    """Rows from ten o'clock GPS of a day of the week: 0 is Sunday."""
    return [Row(**{**vars(row), "seconds": day * DAY_S + 36_000 + k / 10}) for k, row in enumerate(ROWS[:count])]


def has_times(found: dict[str, np.ndarray], given: list[Row]) -> None:
    assert found["t_ns"].tolist() == [WEEK * WEEK_NS + round(row.seconds * 10) * NS // 10 for row in given]


def poses_are(found: dict[str, np.ndarray], given: list[Row]) -> None:
    for name in ("latitude", "longitude"):
        assert found[f"{name}_rad"] == pytest.approx(np.radians([getattr(row, name) for row in given]), abs=2e-12), name
    for name, column in (("roll", "roll_rad"), ("pitch", "pitch_rad"), ("heading", "azimuth_rad")):
        apart = found[column] - np.radians([getattr(row, name) for row in given])
        assert np.exp(1j * apart) == pytest.approx(np.ones(len(given)), abs=2e-8), name
    assert found["height_m"] == pytest.approx([row.height for row in given], abs=1e-3)
