"""Recognise times and positions that have lost digits because a program stored them as float32."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError


@np.errstate(all="ignore")
def through_float32(values: NDArray[np.float64]) -> bool:
    """Return whether times (or other large numbers) have lost digits because a program stored them as float32.

    All values are then float32 numbers. Multiples of 1/8 s are float32 numbers by chance, and do not count as proof.

    >>> through_float32(np.array([76892.6953125, 76892.703125])), through_float32(np.array([76892.5, 76893.0]))
    (True, False)
    """
    values = values[np.isfinite(values) & (np.abs(values) < 1e30)]
    if not len(values) or not np.array_equal(values, values.astype(np.float32)):
        return False
    step = float(np.spacing(np.float32(np.abs(values).max())))
    if step < 1e-4:
        return False
    if step < 1:
        return bool(np.any(np.mod(values * 8, 1) != 0))
    return len(values) >= 100 and step >= 8


@np.errstate(all="ignore")
def refuse_float32(columns: Mapping[str, NDArray[Any]], name: str) -> None:
    """Raise RawDataError if seconds_of_week, latitude_deg or longitude_deg were stored as float32."""
    seconds = columns.get("seconds_of_week")
    degraded = seconds is not None and through_float32(seconds)
    for column in ("latitude_deg", "longitude_deg"):
        values = columns.get(column)
        if values is not None and len(values) >= 20 and len(np.unique(values)) > 1:
            degraded = degraded or bool(np.all(np.abs(values - values.astype(np.float32)) < 1e-11))
    if degraded:
        raise RawDataError(f"{name}: its times or positions went through float32; export it again in double precision")
