"""Whether a wall that is off below the water, by more than ``as_built`` says, would be noticed.

This is internal and external reliability (Baarda 1968, "A testing procedure for use in geodetic networks"). Table
``freed`` has for the shift of each wet face, known beforehand to its sigma q, the value that it would have if that
alone were wrong, with the sigma σ of this value if all errors are as said
(:mod:`~pipeline.maths.adjustment.parameter_tests`). A face counts as off from 3 σ on. So one that is off by

    ∇ = (3 + 0.84) σ

is noticed in four sessions of five, a smaller one rarely. With the effect E of an error q on the mount, ∇ turns and
shifts the mount by E ∇ / q. It is in no sigma: these hold for errors as ``as_built`` says.
"""

import numpy as np
import pandas as pd

from pipeline.adjustment.wet_errors import BUILT_M, SHIFT
from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import in_report_units, largest_sigmas
from pipeline.maths.mount_parameters import MOUNT_NAMES, MOUNT_WORDS
from pipeline.report.reason_codes import ReasonCode, Statement

NOTICED = 3 + 0.84  # sigmas of an error that a limit of 3 sigmas finds in four of five sessions
LISTED = 1.0  # least effect, in limits of the verdict, that is worth a word


def unseen_face_error(freed: pd.DataFrame, limits: VerdictLimits) -> list[Statement]:
    """Return a warning if a wall that nobody has surveyed may be off unnoticed, by more than the mount bears.

    Parameters
    ----------
    freed
        The table of single-parameter tests, with the effects.
    limits
        Limits of the verdict: what the mount bears.
    """
    shifts = freed["unknown"].str.fullmatch(SHIFT.pattern) & freed["known"] & (freed["considered"] > BUILT_M)
    rows = freed[shifts & np.isfinite(freed["expected"])]
    if rows.empty:
        return []
    unseen_m = NOTICED * rows["expected"].to_numpy(float)
    by_sigma = rows[[f"effect_{name}" for name in MOUNT_NAMES]].to_numpy(float)
    effects = by_sigma * (unseen_m / rows["considered"].to_numpy(float))[:, None]
    shares = np.abs(effects) / largest_sigmas(limits)
    row, column = np.unravel_index(np.argmax(shares), shares.shape)
    if shares[row, column] <= LISTED:
        return []
    size = abs(in_report_units(effects[row])[column])
    change = f"{size:.2f}°" if column < len(MOUNT_NAMES) // 2 else f"{1000 * size:.0f} mm"
    face = str(rows["unknown"].iloc[row]).removeprefix("wet_").removesuffix("_shift")
    words = (
        f"a wall that stands off by {1000 * unseen_m[row]:.0f} mm below the water could go unnoticed ({face}), and "
        f"{MOUNT_WORDS[column]} would be wrong by {change}; the total sigmas do not cover it: look at the walls below "
        "the water, or pass more walls"
    )
    return [Statement(ReasonCode.UNSEEN_FACE_ERROR, words)]
