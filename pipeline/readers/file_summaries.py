"""What stage ingest has seen of the files: what it refuses at once, and its tables of files, gaps and counts."""

from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import GAPS
from pipeline.artefacts.streams import Batch
from pipeline.console import plural
from pipeline.errors import RawDataError
from pipeline.gps_time import NS, WEEK_NS, utc_text
from pipeline.maths.geometry.passes import split_at_gaps
from pipeline.readers.rates import rate_hz
from pipeline.readers.whole_days import DAY_NS, whole_days

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Seen:
    """What is kept of one chunk: counts, epochs (INS records or pings; of laser points one a second, and the last)."""

    count: int
    dropped: dict[str, int]
    epochs_ns: NDArray[np.int64]
    trajectory: Columns
    sigmas: Columns = field(default_factory=dict)  # of the INS, thinned
    accuracy: bool = False  # of a file of sigmas alone
    lowest_speed_m_s: float = np.inf  # sound speeds recorded with the pings
    highest_speed_m_s: float = -np.inf


def refuse_empty(partials: dict[str, list[tuple[str, Seen]]]) -> None:
    for sensor, seen in partials.items():
        if not sum(piece.count for _, piece in seen):
            names = sorted({name.split("#")[0] for name, _ in seen})
            reasons: dict[str, int] = {}
            for _, piece in seen:
                for reason, number in piece.dropped.items():
                    reasons[reason] = reasons.get(reason, 0) + number
            why = (
                ", ".join(f"{number} x {reason}" for reason, number in sorted(reasons.items())) or "the files are empty"
            )
            advice = {
                "ins": "log again after the INS has aligned, with INSPVA(S) on",
                "laser": "export the scan again, with time stamps",
                "mbes": "check that bathymetry was logged",
            }[sensor]
            raise RawDataError(f"{', '.join(names[:3])}: no usable {sensor} record ({why}); {advice}")


def _meet(ins: tuple[int, int], other: tuple[int, int], offset_ns: int) -> bool:
    return ins[0] <= other[1] - offset_ns and other[0] - offset_ns <= ins[1]


def refuse_apart(ins: tuple[int, int], spans: dict[str, tuple[int, int]]) -> None:
    for sensor, (first, last) in spans.items():
        start, end = ins
        if last < start or first > end:
            apart = first - start
            days = whole_days(ins, (first, last), partial(_meet, ins, (first, last)))
            weeks = round(apart / WEEK_NS)
            hint = "check the instruments' clocks and latency_s"
            if days:
                amount, ahead, why = days
                hint = f"{sensor} is {amount} {'ahead of' if ahead else 'behind'} the INS: {why}"
            elif weeks and _meet(ins, (first, last), weeks * WEEK_NS):
                hint = f"they are {plural(abs(weeks), 'week')} apart: check gps_week"
            elif abs(apart) > WEEK_NS / 2:
                hint = f"they are {abs(apart) / DAY_NS:.0f} days apart: name files of one session"
            raise RawDataError(
                f"session.yaml: no time overlap: ins {utc_text(start)} to {utc_text(end)}, "
                f"{sensor} {utc_text(first)} to {utc_text(last)}; {hint}"
            )


def files_of(partials: dict[str, list[tuple[str, Seen]]]) -> pd.DataFrame:
    rows = []
    for sensor, pieces in partials.items():
        by_file: dict[str, list[Seen]] = {}
        for name, seen in pieces:
            by_file.setdefault(name.split("#")[0], []).append(seen)
        for name, seen_list in by_file.items():
            epochs = np.concatenate([seen.epochs_ns for seen in seen_list])
            records = sum(seen.count for seen in seen_list)
            accuracy = any(seen.accuracy for seen in seen_list)
            if accuracy:
                records = len(epochs)
            rate = rate_hz(sensor, epochs, records)
            rows.append(
                {
                    "sensor": "accuracy" if accuracy else sensor,
                    "file": name,
                    "records": records,
                    "dropped": sum(sum(seen.dropped.values()) for seen in seen_list),
                    "first_ns": int(epochs.min()) if len(epochs) else -1,
                    "last_ns": int(epochs.max()) if len(epochs) else -1,
                    "rate_hz": rate,
                    "sound_speed_low_m_s": _finite(min(seen.lowest_speed_m_s for seen in seen_list)),
                    "sound_speed_high_m_s": _finite(max(seen.highest_speed_m_s for seen in seen_list)),
                }
            )
    return pd.DataFrame(rows)


def _finite(value: float) -> float:
    return value if np.isfinite(value) else np.nan


def gaps_between(epochs_ns: dict[str, NDArray[np.int64]], max_gap_ns: int) -> pd.DataFrame:
    rows: list[dict[str, Any]] = []
    for sensor, t_ns in epochs_ns.items():
        stretches = split_at_gaps(t_ns, max_gap_ns)
        for (_, end), (start, _) in pairwise(stretches):
            rows.append({"sensor": sensor, "start_ns": end, "end_ns": start, "duration_s": (start - end) / NS})
    return pd.DataFrame(rows, columns=[column.name for column in GAPS.columns])


def counts_of(
    partials: dict[str, list[tuple[str, Seen]]], repeated: dict[str, int], sigmas_outside: int
) -> pd.DataFrame:
    rows = []
    for source, pieces in partials.items():
        total: dict[str, int] = {"used": 0, "repeated time": repeated.get(source, 0)}
        for _, seen in pieces:
            total["used"] += seen.count
            for reason, number in seen.dropped.items():
                total[reason] = total.get(reason, 0) + number
        total["used"] -= total["repeated time"]
        if source == "ins" and sigmas_outside:
            total["accuracy outside the INS's time"] = sigmas_outside
        rows += [{"source": source, "reason": reason, "count": number} for reason, number in sorted(total.items())]
    return pd.DataFrame(rows)


def thinned(sigmas: Batch) -> dict[str, NDArray[Any]]:
    """In order of time, the first row of each half second."""
    if not sigmas:
        return {}
    order = np.argsort(sigmas["t_ns"], kind="stable")
    slot = sigmas["t_ns"][order] // SPACING_NS
    kept = order[np.diff(slot, prepend=slot[:1] - 1) > 0]
    return {name: values[kept] for name, values in sigmas.items()}


SPACING_NS = NS // 2  # of the rows that are kept
