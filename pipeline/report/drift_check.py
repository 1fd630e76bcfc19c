"""Checks of the INS's drift against the figures of the session or of its files, never against the estimated ones."""

import numpy as np
import pandas as pd

from pipeline.config.session import Drift
from pipeline.report.reason_codes import ReasonCode, Statement

MAX_DRIFT_RATIO = 1.2  # RMS of estimated drift over its sigma: a larger one contradicts the figures
MAX_DEVIATION = 2.0  # of a figure, in sigmas of what data and ins.drift_within allow
NO_DRIFT = Statement(
    ReasonCode.INS_DRIFT_NOT_GIVEN,
    "ins.drift allows the INS no drift at all: give its figures before you look for any other cause",
)


def check_ins_drift(drift: pd.DataFrame, allowed: Drift, source: str = "ins.drift says") -> Statement | None:
    """Return a statement if the estimated drift is larger than its sigmas allow, or if all are zero; otherwise None.

    The measure is the root mean square of the estimates divided by their sigmas. The prior by the same sigmas draws the
    estimates towards zero. So the measure is 0.6 to 0.7 if the sigmas are right, and at least 1.6 if the INS drifts
    three times as far.

    Parameters
    ----------
    drift : table ``drift``: the estimates at the knots, m and degrees in the target frame
    allowed : sigmas of the drift, m and degrees
    source : subject and verb of the statement, which name the source of the sigmas
    """
    angles, arm = (allowed.roll_pitch_deg, allowed.roll_pitch_deg, allowed.heading_deg), allowed.horizontal_m
    sigmas = np.array([arm, arm, allowed.vertical_m, *angles])
    if not sigmas.any():
        return NO_DRIFT
    names = [f"{axis}_target_m" for axis in "xyz"] + [f"turn_{axis}_target_deg" for axis in "xyz"]
    normalised = drift[names].to_numpy(np.float64)[:, sigmas > 0] / sigmas[sigmas > 0]
    ratio = float(np.sqrt(np.mean(normalised**2))) if normalised.size else 0.0
    if not ratio > MAX_DRIFT_RATIO:
        return None
    return Statement(
        ReasonCode.INS_DRIFT_ABOVE_SETTINGS,
        f"the INS drifts at least {ratio:.1f} times as far as {source}: give its figures before you look for "
        "any other cause",
    )


def figures_disagree(figures: pd.DataFrame, source: str = "ins.drift says") -> Statement | None:
    """Return a statement if the data say that the INS drifts more, or faster, than its figures; otherwise None.

    A smaller or a slower drift is no fault: the INS is good. The result needs no correction, for the adjustment used
    the estimated figures; they should be used for the survey, too, and for the next session.

    Parameters
    ----------
    figures : table ``drift_figures``
    source : subject and verb of the statement, which name the source of the figures
    """
    rows = {str(row["figure"]): row for row in figures.to_dict("records")}
    worse = [(-1 if name == "time_constant_s" else 1) * row["deviation"] for name, row in rows.items()]
    if not max(worse, default=0.0) > MAX_DEVIATION:
        return None
    parts = [
        f"{rows[name]['estimated'] / rows[name]['configured']:.1f} times as far {words}"
        for name, words in (("horizontal_m", "in position"), ("roll_pitch_deg", "in attitude"))
        if rows[name]["configured"] > 0
    ]
    seconds = rows["time_constant_s"]
    of_time = f", with a time constant of {seconds['estimated']:.0f} s, not {seconds['configured']:.0f} s"
    return Statement(
        ReasonCode.INS_DRIFT_OFF_FIGURES,
        f"the INS drifts otherwise than {source}: {' and '.join(parts)}"
        f"{of_time if seconds['estimated'] != seconds['configured'] else ''}; the sigmas count with that, but look for "
        "the cause in the INS",
    )
