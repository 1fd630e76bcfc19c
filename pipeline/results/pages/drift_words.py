"""What the drift of the INS by the data means against its configured figures, in words for the report."""

from typing import Any

import pandas as pd

from pipeline.report.drift_check import figures_disagree

UNIT = {"m": "m", "deg": "°", "s": "s"}
NEAR = 1.25  # factor within which a figure counts as the same


def drift_rows(figures: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a row for each figure that was estimated: its name, both values, and the factor within which it is known.

    Parameters
    ----------
    figures
        The table ``drift_figures``.
    """
    return [row | {"unit": UNIT[row["figure"].rpartition("_")[2]]} for row in _estimated(figures)]


def drift_sentence(figures: pd.DataFrame) -> str:
    """Return sentences on how the estimated drift compares with the configured one, and whether that is all right.

    Parameters
    ----------
    figures
        The table ``drift_figures``.
    """
    ratios = {row["figure"]: row["estimated"] / row["configured"] for row in _estimated(figures) if row["configured"]}
    parts = [
        f"{words} {_times(ratios[name])}"
        for name, words in (
            ("horizontal_m", "its errors of position are"),
            ("roll_pitch_deg", "those of attitude"),
            ("time_constant_s", "and the time over which they change"),
        )
        if name in ratios
    ]
    if not parts:
        return ""
    compared = f"Against the configured figures, {', '.join(parts)}."
    if figures_disagree(figures) is not None:
        return f"{compared} That is more than the figures allow: see the warnings."
    return (
        f"{compared} That is all right: the INS drifted no more and no faster than its figures allow. Smaller errors, "
        "or slower ones, only mean that it did better in these minutes; a long time constant says that its errors "
        "hardly changed from pass to pass. Do not take the estimates for the INS's data sheet."
    )


def _estimated(figures: pd.DataFrame) -> list[dict[str, Any]]:
    rows = ({str(key): value for key, value in row.items()} for row in figures.to_dict("records"))
    return [row for row in rows if row["sigma_log"]]


def _times(ratio: float) -> str:
    """Return a ratio in words.

    >>> _times(0.1), _times(27.2), _times(1.1)
    ('0.10 times as large', '27 times as large', 'about as large')
    """
    if 1 / NEAR < ratio < NEAR:
        return "about as large"
    return f"{ratio:.2g} times as large" if ratio >= 1 else f"{ratio:.2f} times as large"
