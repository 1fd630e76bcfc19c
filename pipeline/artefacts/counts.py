"""Counts by source and reason, as every stage over a stream keeps them."""

from collections import Counter
from collections.abc import Mapping, Sequence

import pandas as pd


def counts_table(partials: Mapping[str, Sequence[tuple[str, Mapping[str, int]]]]) -> pd.DataFrame:
    """Sum the counts of all chunks by source and reason.

    Parameters
    ----------
    partials : mapping
        By source: pairs of a part's name and the counts of one of its chunks, by reason; 'used' counts what went on.

    Returns
    -------
    DataFrame
        Columns source, reason, count: reasons of a source in alphabetical order.
    """
    rows = []
    for source, chunk_counts in partials.items():
        total = Counter({"used": 0})
        for _, counts in chunk_counts:
            for reason, number in counts.items():
                total[reason] += number
        rows += [{"source": source, "reason": reason, "count": number} for reason, number in sorted(total.items())]
    return pd.DataFrame(rows, columns=["source", "reason", "count"])
