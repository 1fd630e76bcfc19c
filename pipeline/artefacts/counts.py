"""Counts of records or points by source and reason: the table ``counts`` of each stage that reads streams."""

from collections import Counter
from collections.abc import Mapping, Sequence

import pandas as pd

from pipeline.artefacts.columns import COUNTS
from pipeline.artefacts.count_codes import code_of

SENSOR_OF = {"laser_points": "laser", "laser_pool": "laser", "soundings": "mbes", "soundings_pool": "mbes"}


def counts_table(partials: Mapping[str, Sequence[tuple[str, Mapping[str, int]]]]) -> pd.DataFrame:
    """Return the table ``counts``: the counts of all chunks, summed by source and reason.

    Parameters
    ----------
    partials : mapping
        For each source a list of pairs: the name of a part, and the counts of one of its chunks by reason. The reason
        'used' counts the records that were kept.

    Returns
    -------
    DataFrame
        Columns source, reason, code, count. The reasons of a source are in alphabetical order.
    """
    rows = []
    for source, chunk_counts in partials.items():
        total = Counter({"used": 0})
        for _, counts in chunk_counts:
            for reason, number in counts.items():
                total[reason] += number
        rows += [
            {"source": source, "reason": reason, "code": code_of(reason), "count": number}
            for reason, number in sorted(total.items())
        ]
    return pd.DataFrame(rows, columns=[column.name for column in COUNTS])


def sensor_of(source: str) -> str:
    """Return the sensor whose points a source of the counts holds, for people to read.

    >>> sensor_of("soundings_pool"), sensor_of("ins")
    ('mbes', 'ins')
    """
    return SENSOR_OF.get(source, source)


def used(counts: pd.DataFrame, source: str) -> float:
    """Return the number of a source's records that were kept."""
    return float(counts[(counts["source"] == source) & (counts["reason"] == "used")]["count"].sum())


def by_reason(counts: pd.DataFrame, source: str) -> pd.Series:
    """Return the counts of a source by reason."""
    return counts[counts["source"] == source].set_index("reason")["count"]


def why_none_used(counts: pd.DataFrame, source: str) -> str | None:
    """Return a source's counts by reason as text if none of its records was kept; otherwise None."""
    of_source = by_reason(counts, source)
    if of_source["used"]:
        return None
    return ", ".join(f"{number} {reason}" for reason, number in of_source.items() if number and reason != "used")
