"""Summaries of the raw files: the tables of files, gaps and counts, and the refusal of sensors that cannot be used."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import GAPS
from pipeline.artefacts.counts import counts_table
from pipeline.artefacts.streams import Batch
from pipeline.console import plural
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, WEEK_NS, utc_text
from pipeline.maths.geometry.passes import split_at_gaps
from pipeline.readers.rates import rate_hz
from pipeline.readers.whole_days import DAY_NS, whole_days_apart

_MS_NS = NS // 1000
_LEAST_STAMPS = 100  # different milliseconds: fewer decide nothing
_SPACING_NS = NS // 2  # one row of INS sigmas is kept per interval of this length


@dataclass(frozen=True)
class ChunkSummary:
    """Counts and times of one chunk; for an INS also its records and sigmas, for a sonar its sound speeds."""

    count: int  # good rows
    dropped: dict[str, int]  # rows left out, by reason
    epochs_ns: NDArray[np.int64]  # INS records or sigmas, pings, the laser's first point in each second and its last
    trajectory: dict[str, NDArray[Any]] = field(default_factory=dict)  # columns of INS records
    sigmas: dict[str, NDArray[Any]] = field(default_factory=dict)  # columns of INS sigmas, thinned
    accuracy: bool = False  # the chunk has INS sigmas only
    lowest_speed_m_s: float = np.inf  # sound speeds recorded with the pings
    highest_speed_m_s: float = -np.inf
    echoes: tuple[int, int, int] = (0, 0, 0)  # of soundings: see different_milliseconds


Summaries = Sequence[tuple[str, ChunkSummary]]  # part's name (file, or file#stretch), and a chunk's summary
_REMEDIES = {
    "ins": "log again after the INS has aligned, with INSPVA(S) on",
    "laser": "export the scan again, with time stamps",
    "mbes": "check that bathymetry was logged",
}


def refuse_empty_sensors(partials: Mapping[str, Summaries]) -> None:
    """Raise RawDataError if a sensor has no usable record; ``partials``: summaries by sensor."""
    for sensor, summaries in partials.items():
        if not sum(summary.count for _, summary in summaries):
            names = sorted({_file_name(name) for name, _ in summaries})
            reasons: Counter[str] = Counter()
            for _, summary in summaries:
                reasons.update(summary.dropped)
            counts = [f"{number} x {reason}" for reason, number in sorted(reasons.items())]
            why = ", ".join(counts) or "the files are empty"
            raise RawDataError(f"{', '.join(names[:3])}: no usable {sensor} record ({why}); {_REMEDIES[sensor]}")


def different_milliseconds(t_ns: NDArray[np.int64], two_way_time_s: NDArray[np.float64]) -> tuple[int, int, int]:
    """Return the number of different milliseconds in which soundings (n,) have their times, less 0, 1/2 and 1 two-way.

    All soundings of a ping have the time of its transmission. If each has the time at which its echo came back, or at
    which the sound was at the bottom, the times of a ping are as many as its ranges, and become one if the way is
    subtracted.
    """
    way_ns = two_way_time_s * NS
    times = [t_ns - np.rint(share * way_ns).astype(np.int64) for share in (0.0, 0.5, 1.0)]
    none, half, whole = (len(np.unique(one // _MS_NS)) for one in times)
    return none, half, whole


def times_of_reception(name: str, counts: Sequence[tuple[int, int, int]]) -> str | None:
    """Return what is wrong if a file's soundings have the times at which their echoes came back, or began to.

    At the speed v, taken for times of transmission, they turn the sonar's yaw by 2 v / c, 0.03° at 0.4 m/s. On passes
    of one speed nothing else shows it.

    Parameters
    ----------
    name : str
        Name of the file.
    counts : sequence of tuples
        Of each of its chunks the result of :func:`different_milliseconds`.
    """
    stamped, *less = (sum(numbers) for numbers in zip(*counts, strict=True))
    sent, words = min(zip(less, ("half their two-way times", "their two-way times"), strict=True))
    if stamped < _LEAST_STAMPS or sent >= stamped / 2:
        return None
    return (
        f"{name}: the soundings do not have the time of their ping's transmission: they lie in {stamped} different "
        f"milliseconds, less {words} in {sent}; export one time for all beams of a ping"
    )


def refuse_times_of_reception(soundings: Summaries) -> None:
    """Raise RawDataError if the soundings of a file do not have the time of transmission."""
    found: dict[str, list[tuple[int, int, int]]] = {}
    for name, summary in soundings:
        found.setdefault(_file_name(name), []).append(summary.echoes)
    for name, counts in found.items():
        if words := times_of_reception(name, counts):
            raise RawDataError(words)


def _file_name(part_name: str) -> str:
    return part_name.split("#")[0]


def _overlap(ins: tuple[int, int], sensor: tuple[int, int], offset_ns: int) -> bool:
    """Return whether a sensor's times (first, last; ns), minus an offset, overlap those of the INS."""
    return ins[0] <= sensor[1] - offset_ns and sensor[0] - offset_ns <= ins[1]


def refuse_disjoint_times(ins: tuple[int, int], spans: Mapping[str, tuple[int, int]]) -> None:
    """Refuse sensors that have no time in common with the INS.

    Parameters
    ----------
    ins : tuple of two ints
        First and last time of the INS, GPS ns.
    spans : mapping
        First and last time by sensor, GPS ns.

    Raises
    ------
    RawDataError
        A sensor's times all lie before or after those of the INS. The message names a likely cause.
    """
    for sensor, (first, last) in spans.items():
        start, end = ins
        if last < start or first > end:
            raise RawDataError(
                f"session.yaml: no time overlap: ins {utc_text(start)} to {utc_text(end)}, "
                f"{sensor} {utc_text(first)} to {utc_text(last)}; {_likely_cause(ins, sensor, (first, last))}"
            )


def _likely_cause(ins: tuple[int, int], sensor: str, span: tuple[int, int]) -> str:
    """Return the words of a message: why a sensor's times may differ from those of the INS, and the remedy."""
    apart_ns = span[0] - ins[0]
    days = whole_days_apart(ins, span, partial(_overlap, ins, span))
    weeks = round(apart_ns / WEEK_NS)
    if days:
        return f"{sensor} is {days.amount} {'ahead of' if days.ahead else 'behind'} the INS: {days.reason}"
    if weeks and _overlap(ins, span, weeks * WEEK_NS):
        return f"they are {plural(abs(weeks), 'week')} apart: check gps_week"
    if abs(apart_ns) > WEEK_NS / 2:
        return f"they are {abs(apart_ns) / DAY_NS:.0f} days apart: name files of one session"
    return "check the instruments' clocks and latency_s"


def files_table(partials: Mapping[str, Summaries]) -> pd.DataFrame:
    """Return the table ``files``: one row per raw file; ``partials``: summaries by sensor."""
    rows = []
    for sensor, summaries in partials.items():
        by_file: dict[str, list[ChunkSummary]] = {}
        for name, summary in summaries:
            by_file.setdefault(_file_name(name), []).append(summary)
        rows += [_file_row(sensor, name, of_file) for name, of_file in by_file.items()]
    return pd.DataFrame(rows)


def _file_row(sensor: str, name: str, summaries: Sequence[ChunkSummary]) -> dict[str, Any]:
    epochs = np.concatenate([summary.epochs_ns for summary in summaries])
    accuracy = any(summary.accuracy for summary in summaries)
    records = len(epochs) if accuracy else sum(summary.count for summary in summaries)
    return {
        "sensor": "accuracy" if accuracy else sensor,
        "file": name,
        "records": records,
        "dropped": sum(sum(summary.dropped.values()) for summary in summaries),
        "first_ns": int(epochs.min()) if len(epochs) else -1,
        "last_ns": int(epochs.max()) if len(epochs) else -1,
        "rate_hz": rate_hz(sensor, epochs, records),
        "sound_speed_low_m_s": _finite(min(summary.lowest_speed_m_s for summary in summaries)),
        "sound_speed_high_m_s": _finite(max(summary.highest_speed_m_s for summary in summaries)),
    }


def _finite(value: float) -> float:
    return value if np.isfinite(value) else np.nan


def gaps_table(epochs_ns: dict[str, NDArray[np.int64]], max_gap_ns: int) -> pd.DataFrame:
    """Return the table ``gaps``.

    Parameters
    ----------
    epochs_ns : dict
        Ascending times of records or pings by sensor, GPS ns.
    max_gap_ns : int
        An interval without a record is a gap if it is longer, ns.
    """
    rows: list[dict[str, Any]] = []
    for sensor, t_ns in epochs_ns.items():
        stretches = split_at_gaps(t_ns, max_gap_ns)
        for (_, end), (start, _) in pairwise(stretches):
            rows.append({"sensor": sensor, "start_ns": end, "end_ns": start, "duration_s": (start - end) / NS})
    return pd.DataFrame(rows, columns=[column.name for column in GAPS.columns])


def ingest_counts_table(
    partials: Mapping[str, Summaries], repeated: Mapping[str, int], sigmas_outside: int
) -> pd.DataFrame:
    """Return the table ``counts`` of stage ingest.

    Parameters
    ----------
    partials : mapping
        Summaries by sensor.
    repeated : mapping
        Number by sensor of good rows that were left out later, because another file has a record of the same time.
    sigmas_outside : int
        Number of rows of INS sigmas at times without INS records.
    """
    counts: dict[str, list[tuple[str, Mapping[str, int]]]] = {}
    for sensor, summaries in partials.items():
        counts[sensor] = [(name, {"used": summary.count} | summary.dropped) for name, summary in summaries]
        number = repeated.get(sensor, 0)
        counts[sensor].append(("", {"used": -number, "repeated time": number}))
    if sigmas_outside:
        counts["ins"].append(("", {"accuracy outside the INS's time": sigmas_outside}))
    return counts_table(counts)


def thin_sigmas(sigmas: Batch) -> dict[str, NDArray[Any]]:
    """Return the INS sigmas thinned to the first row of each half second, in order of time."""
    if not sigmas:
        return {}
    order = np.argsort(sigmas["t_ns"], kind="stable")
    half_second = sigmas["t_ns"][order] // _SPACING_NS
    kept = order[np.diff(half_second, prepend=half_second[:1] - 1) > 0]
    return {name: values[kept] for name, values in sigmas.items()}
