"""What the drift of the INS by the data means against its configured figures, in words for the report."""

from collections.abc import Collection
from typing import Any

import pandas as pd

from pipeline.report.reason_codes import ReasonCode

UNIT = {"m": "m", "deg": "°", "s": "s"}
NEAR = 1.25  # factor within which a figure counts as the same
FIGURES = {
    "shifts": ("horizontal_m", "vertical_m"),
    "turns": ("roll_pitch_deg", "heading_deg"),
    "time": ("time_constant_s",),
}
WORDS = {  # where the estimate is another one, and where it is about the same
    "shifts": ("its errors of position are {} times as large", "its errors of position are about as large"),
    "turns": ("its errors of attitude are {} times as large", "its errors of attitude are about as large"),
    "time": (
        "and the time over which they change is {} times as long",
        "and the time over which they change is about as long",
    ),
}
TOO_FAR = frozenset(
    {
        ReasonCode.INS_DRIFT_ABOVE_SETTINGS,
        ReasonCode.INS_DRIFT_OFF_FIGURES,
        ReasonCode.INS_DRIFT_BETWEEN_PASSES,
    }
)


def drift_rows(figures: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a row for each figure that was estimated: its name, both values, and the factor within which it is known.

    Parameters
    ----------
    figures
        The table ``drift_figures``.
    """
    return [row | {"unit": UNIT[row["figure"].rpartition("_")[2]]} for row in _estimated(figures)]


def drift_sentence(figures: pd.DataFrame, codes: Collection[str]) -> str:
    """Return sentences on how the estimated drift compares with the configured one, and whether that is all right.

    Shifts have one factor in common, and turns another; it is told by the first of their figures that is not zero.

    Parameters
    ----------
    figures
        The table ``drift_figures``.
    codes
        Codes of all reasons and warnings of the run: what they say of the drift, the sentence says too.
    """
    ratios = {row["figure"]: row["estimated"] / row["configured"] for row in _estimated(figures) if row["configured"]}
    found = {kind: [ratios[name] for name in names if name in ratios] for kind, names in FIGURES.items()}
    parts = [_compared(*WORDS[kind], of_kind[0]) for kind, of_kind in found.items() if of_kind]
    if not parts:
        return ""
    compared = f"Against the configured figures, {', '.join(parts)}."
    if TOO_FAR.intersection(codes):
        return (
            f"{compared} The INS drifts farther, or faster, than they allow: see the reasons and warnings at the top."
        )
    shorter = [1 / ratio for ratio in found["time"]]
    if max([ratio for kind in ("shifts", "turns") for ratio in found[kind]] + shorter) >= NEAR:
        return (
            f"{compared} That is more, or faster, than they say, but within the factors of ins.drift_within: the "
            "sigmas count with it."
        )
    return (
        f"{compared} That is all right: the INS drifted no more and no faster than its figures allow. Smaller errors, "
        "or slower ones, only mean that it did better in these minutes; a long time constant says that its errors "
        "hardly changed from pass to pass. Do not take the estimates for the INS's data sheet."
    )


def _estimated(figures: pd.DataFrame) -> list[dict[str, Any]]:
    rows = ({str(key): value for key, value in row.items()} for row in figures.to_dict("records"))
    return [row for row in rows if row["sigma_log"]]


def _compared(other: str, same: str, ratio: float) -> str:
    """Return a ratio in words.

    >>> [_compared("{} times", "the same", ratio) for ratio in (0.1, 27.2, 1.1)]
    ['0.10 times', '27 times', 'the same']
    """
    if 1 / NEAR < ratio < NEAR:
        return same
    return other.format(f"{ratio:.2g}" if ratio >= 1 else f"{ratio:.2f}")
