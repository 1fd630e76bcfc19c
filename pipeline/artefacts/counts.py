"""Counts by source and reason, as every stage over a stream keeps them."""

from collections import Counter
from collections.abc import Mapping, Sequence

import pandas as pd

from pipeline.artefacts.columns import COUNTS
from pipeline.artefacts.count_codes import code_of


def counts_table(partials: Mapping[str, Sequence[tuple[str, Mapping[str, int]]]]) -> pd.DataFrame:
    """Sum the counts of all chunks by source and reason.

    Parameters
    ----------
    partials : mapping
        By source: pairs of a part's name and the counts of one of its chunks, by reason; 'used' counts what went on.

    Returns
    -------
    DataFrame
        Columns source, reason, code, count: reasons of a source in alphabetical order.
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


def used(counts: pd.DataFrame, source: str) -> float:
    """Return how many records of a source went on."""
    return float(counts[(counts["source"] == source) & (counts["reason"] == "used")]["count"].sum())


def by_reason(counts: pd.DataFrame, source: str) -> pd.Series:
    """Return the counts of a source by reason."""
    return counts[counts["source"] == source].set_index("reason")["count"]


def why_none_used(counts: pd.DataFrame, source: str) -> str | None:
    """Return the counts of a source by reason, as text, if no record went on; else None."""
    of_source = by_reason(counts, source)
    if of_source["used"]:
        return None
    return ", ".join(f"{number} {reason}" for reason, number in of_source.items() if number and reason != "used")
