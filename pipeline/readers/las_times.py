"""The zero point of GPS times in a LAS file, from ``laser.time`` of session.yaml or else from the file's header.

If bit 0 of the global encoding is set, times are adjusted standard time: GPS seconds since the epoch minus 1e9. If the
bit is not set, they are seconds of the GPS week. Many programs write adjusted standard time and leave the bit unset.
The numbers of the two types overlap only in the first two weeks of adjusted standard time (September 2011). Every other
number shows its type.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.recording import LasTime
from pipeline.errors import RawDataError
from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, WEEK_S
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.row_checks import FIRST_WEEK, LAST_WEEK

_TITLES = {True: "adjusted standard GPS time", False: "seconds of GPS week"}
_KEYS = {True: "adjusted_standard", False: "seconds_of_week"}


def refuse_unusable_times(seconds: NDArray[np.float64], name: str, adjusted: bool, declared: LasTime) -> None:
    """Refuse times that are all 0, are not of the type that is assumed, or were stored as float32.

    Parameters
    ----------
    seconds : (n,) array
        GPS times as they stand in the file.
    name : str
        The file's path in the session folder, for messages.
    adjusted : bool
        True: the times are read as adjusted standard time; false: as seconds of the week.
    declared : LasTime
        ``laser.time`` of session.yaml; None: the header's flag decides.

    Raises
    ------
    RawDataError
        The times cannot be used.
    """
    if len(seconds) and not np.any(seconds):
        raise RawDataError(f"{name}: all its GPS times are 0; export it again with GPS time stamps")
    refuse_wrong_time_type(seconds, name, adjusted, declared)
    if through_float32(seconds):
        raise RawDataError(
            f"{name}: its GPS times went through float32 (first: {seconds[0]}); export it again in double precision"
        )


def refuse_wrong_time_type(seconds: NDArray[np.float64], name: str, adjusted: bool, declared: LasTime) -> None:
    """Refuse times that are impossible for the type that is assumed.

    Parameters
    ----------
    seconds, name, adjusted, declared
        As for :func:`refuse_unusable_times`.

    Raises
    ------
    RawDataError
        The times are of the other type, or of neither.
    """
    nonzero = seconds[np.isfinite(seconds) & (seconds != 0)]
    weekly, standard = _is_weekly(nonzero), _is_standard(nonzero)
    wrong = (np.all(weekly) or not np.any(standard)) if adjusted else not np.any(weekly)
    if len(nonzero) and wrong:
        _refuse(name, float(nonzero[0]), adjusted, declared, likely=bool(np.any(weekly if adjusted else standard)))


def _refuse(name: str, first: float, adjusted: bool, declared: LasTime, likely: bool) -> None:
    """Raise RawDataError for times; ``first``: the first of them, ``likely``: they are possible as the other type."""
    source = "its header" if declared is None else f"laser.time: {declared} in session.yaml"
    other = f"it seems to be {_TITLES[not adjusted]}" if likely else "it is neither of the two times that LAS has"
    remedy = "export it again with GPS time stamps"
    if likely and declared is None:
        remedy = f"write laser.time: {_KEYS[not adjusted]} in session.yaml, or export it again with the right flag"
    elif likely:
        remedy = f"take laser.time out, or write laser.time: {_KEYS[not adjusted]}"
    shown = f"{first:.6f}" if abs(first) < 1e12 else f"{first:g}"
    raise RawDataError(f"{name}: {source} promises {_TITLES[adjusted]}, but {shown} is not that: {other}; {remedy}")


def _is_weekly(seconds: NDArray[np.float64]) -> NDArray[np.bool_]:
    weekly: NDArray[np.bool_] = (seconds >= 0) & (seconds < 2 * WEEK_S)
    return weekly


def _is_standard(seconds: NDArray[np.float64]) -> NDArray[np.bool_]:
    weeks = (seconds + ADJUSTED_STANDARD_OFFSET_S) / WEEK_S
    standard: NDArray[np.bool_] = (weeks >= FIRST_WEEK) & (weeks <= LAST_WEEK) & ~_is_weekly(seconds)
    return standard
