"""Check whether the INS drifts farther than the figures of the session or of its files allow."""

import numpy as np
import pandas as pd

from pipeline.config.session import Drift
from pipeline.report.reason_codes import ReasonCode, Statement

MAX_DRIFT_RATIO = 1.2  # RMS of estimated drift over its sigma: a larger one contradicts the figures
NO_DRIFT = Statement(
    ReasonCode.INS_DRIFT_NOT_GIVEN,
    "ins.drift concedes the INS no drift at all: give its figures before anything else is looked for",
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
        f"the INS drifts at least {ratio:.1f} times as far as {source}: give its figures before anything else is "
        "looked for",
    )
