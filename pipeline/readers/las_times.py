"""What the GPS times of a LAS file count from: what its header says, or, before that, ``laser.time`` of session.yaml.

Global encoding, bit 0: adjusted standard time, GPS seconds since the epoch - 1e9; else seconds of the GPS week. Many
programs write adjusted times and leave the bit unset. The two do not overlap, but for the first two weeks of adjusted
standard time, September 2011: so times tell beyond doubt where flag or key contradict them.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.recording import LasTime
from pipeline.errors import RawDataError
from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, NS, WEEK_NS
from pipeline.readers.float32_checks import through_float32
from pipeline.readers.row_checks import FIRST_WEEK, LAST_WEEK

WEEK_S = WEEK_NS / NS
NAMES = {True: "adjusted standard GPS time", False: "seconds of GPS week"}
KEYS = {True: "adjusted_standard", False: "seconds_of_week"}


def refuse_useless(seconds: NDArray[np.float64], name: str, adjusted: bool, told: LasTime) -> None:
    """RawDataError where times are all 0, are not what they are taken for, or have lost their digits."""
    if len(seconds) and not np.any(seconds):
        raise RawDataError(f"{name}: all its GPS times are 0; export it again with GPS time stamps")
    refuse_contradiction(seconds, name, adjusted, told)
    if through_float32(seconds):
        raise RawDataError(
            f"{name}: its GPS times went through float32 (first: {seconds[0]}); export it again in double precision"
        )


def refuse_contradiction(seconds: NDArray[np.float64], name: str, adjusted: bool, told: LasTime) -> None:
    """RawDataError where times cannot be what they are taken for."""
    given = seconds[np.isfinite(seconds) & (seconds != 0)]
    weekly, standard = _is_weekly(given), _is_standard(given)
    wrong = (np.all(weekly) or not np.any(standard)) if adjusted else not np.any(weekly)
    if len(given) and wrong:
        _refuse(name, float(given[0]), adjusted, told, likely=bool(np.any(weekly if adjusted else standard)))


def _refuse(name: str, first: float, adjusted: bool, told: LasTime, likely: bool) -> None:
    """``likely``: the times are possible as the other kind."""
    source = "its header" if told is None else f"laser.time: {told} in session.yaml"
    other = f"it seems to be {NAMES[not adjusted]}" if likely else "it is neither of the two times that LAS has"
    remedy = "export it again with GPS time stamps"
    if likely and told is None:
        remedy = f"write laser.time: {KEYS[not adjusted]} in session.yaml, or export it again with the right flag"
    elif likely:
        remedy = f"take laser.time out, or write laser.time: {KEYS[not adjusted]}"
    shown = f"{first:.6f}" if abs(first) < 1e12 else f"{first:g}"
    raise RawDataError(f"{name}: {source} promises {NAMES[adjusted]}, but {shown} is not that: {other}; {remedy}")


def _is_weekly(seconds: NDArray[np.float64]) -> NDArray[np.bool_]:
    good: NDArray[np.bool_] = (seconds >= 0) & (seconds < 2 * WEEK_S)
    return good


def _is_standard(seconds: NDArray[np.float64]) -> NDArray[np.bool_]:
    weeks = (seconds + ADJUSTED_STANDARD_OFFSET_S) / WEEK_S
    good: NDArray[np.bool_] = (weeks >= FIRST_WEEK) & (weeks <= LAST_WEEK) & ~_is_weekly(seconds)
    return good
