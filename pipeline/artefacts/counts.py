"""Counts by source and reason, as every stage over a stream keeps them."""

from collections.abc import Mapping, Sequence

import pandas as pd


def counts_table(partials: Mapping[str, Sequence[tuple[str, Mapping[str, int]]]]) -> pd.DataFrame:
    """Columns source, reason, count: the chunks' counts summed, reasons in alphabetical order."""
    rows = []
    for source, pieces in partials.items():
        total: dict[str, int] = {"used": 0}
        for _, counts in pieces:
            for reason, number in counts.items():
                total[reason] = total.get(reason, 0) + number
        rows += [{"source": source, "reason": reason, "count": number} for reason, number in sorted(total.items())]
    return pd.DataFrame(rows, columns=["source", "reason", "count"])
