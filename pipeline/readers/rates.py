"""Record rates of sensors."""

import numpy as np
from numpy.typing import NDArray

from pipeline.gps_time import NS

ONE_PING_NS = 4_000_000  # the sectors of one ping are sent within this time, and each has a time of its own


def rate_hz(sensor: str, epochs_ns: NDArray[np.int64], records: int) -> float:
    """Return a sensor's rate: the median for INS records and pings, the mean for laser points.

    Parameters
    ----------
    sensor : str
        ins, laser or mbes.
    epochs_ns : (n,) array
        Times of INS records, pings or (some) laser points, GPS ns.
    records : int
        Number of laser points.

    Returns
    -------
    float
        Hz; NaN for fewer than two epochs.

    Examples
    --------
    >>> ping = np.array([0, 220_000, 440_000])
    >>> rate_hz("mbes", np.concatenate([ping, ping + NS // 10, ping + NS // 5]), 900)
    10.0
    """
    times = np.unique(epochs_ns)
    if len(times) < 2:
        return float("nan")
    if sensor == "laser":
        return float(records / ((times[-1] - times[0]) / NS))
    if sensor == "mbes":
        times = times[np.r_[True, np.diff(times) > ONE_PING_NS]]
    return float(NS / np.median(np.diff(times))) if len(times) > 1 else float("nan")
