"""Checks of the labels: too few on a family, noise that their gate cuts off, and labels that have not settled."""

import numpy as np
import pandas as pd

from pipeline.adjustment.wet_planes import FEWEST_SOUNDINGS, LARGEST_SHARE_OF_GATE
from pipeline.report.noise_warnings import points_of
from pipeline.report.reason_codes import ReasonCode, Statement

MAX_LABEL_CHANGE = 0.01  # share of the labels that the last provisional adjustment may change; usual: 0.001


def too_few_soundings(cells: pd.DataFrame, head: str = "mbes") -> list[Statement]:
    """Return a reason for each family with too few soundings for reliable labels. A family without any is not used.

    Parameters
    ----------
    cells : the table
    head : the head of the sonar
    """
    count = cells[cells["sensor"] == head].groupby("family")["count"].sum()
    return [
        Statement(
            ReasonCode.TOO_FEW_SOUNDINGS,
            f"too few soundings lie on {family} to trust ({number}): sail so that the fan covers it (poolcal check "
            "tells why so few hit it)",
        )
        for family, number in count.items()
        if number < FEWEST_SOUNDINGS
    ]


def noise_cut_by_gate(cells: pd.DataFrame, gates_m: dict[str, float]) -> list[Statement]:
    """Return a reason for each family whose noise fills its gate.

    Such a gate cuts the noise off where the provisional mount places the face. The mean of what remains is near there
    whatever the mount, and so is the result.

    Parameters
    ----------
    cells : the table
    gates_m : largest distance from a face at which a point has a label, by sensor
    """
    statements = []
    for names, rows in cells.groupby(["sensor", "family"], sort=True):
        sensor, family = map(str, names)
        rms_m = float(np.sqrt(np.average(rows["rms_m"] ** 2, weights=rows["count"])))
        if rms_m > LARGEST_SHARE_OF_GATE * gates_m[sensor]:
            words = (
                f"{points_of(sensor)} on {family} scatter by {1000 * rms_m:.0f} mm, and those more than "
                f"{1000 * gates_m[sensor]:.0f} mm off its faces are not used: the result may be drawn to where the "
                "search began; look for what makes them so noisy (weed, a face that is not there, a wrong range gate), "
                "or enter a larger segment.gate_m"
            )
            statements.append(Statement(ReasonCode.NOISE_CUT_BY_GATE, words))
    return statements


def unsettled_labels(label_change: float) -> list[Statement]:
    """Return a warning if no provisional adjustment has corrected the labels, or if the last one still changed many.

    ``label_change``: of table ``provisional_mount``.
    """
    advice = (
        "labels near edges may be wrong: run again with segment.margin_m: 0.03, and see that no value changes by more "
        "than its sigma"
    )
    if np.isnan(label_change):
        words = f"no sample of the points could be adjusted: they are labelled with the INS's drift; {advice}"
    elif label_change > MAX_LABEL_CHANGE:
        words = f"the last adjustment of the sample still changed {100 * label_change:.1f} % of the labels; {advice}"
    else:
        return []
    return [Statement(ReasonCode.LABELS_UNSETTLED, words)]
