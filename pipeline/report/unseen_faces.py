"""Whether a wall that is off below the water, by more than ``as_built`` says, would be noticed.

This is internal and external reliability (Baarda 1968, "A testing procedure for use in geodetic networks"). Table
``freed`` has for the shift and the turns of each wet face, known beforehand to a sigma q, the value that each would
have if it alone were wrong, with the sigma σ of this value if all errors are as said
(:mod:`~pipeline.maths.adjustment.parameter_tests`). A face counts as off from 3 σ on. So one that is off by

    ∇ = (3 + 0.84) σ

is noticed in four sessions of five, a smaller one rarely. With the effect E of an error q on the mount, ∇ turns and
shifts the mount by E ∇ / q. It is in no sigma: these hold for errors as ``as_built`` says. Of faces that nothing tests,
∇ is boundless; 10 q are told of them, which hardly any wall is off.
"""

import re

import numpy as np
import pandas as pd

from pipeline.adjustment.wet_errors import BUILT_DEG, BUILT_M
from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import in_report_units, largest_sigmas
from pipeline.maths.mount_parameters import MOUNT_NAMES, MOUNT_WORDS
from pipeline.report.reason_codes import ReasonCode, Statement

NOTICED = 3 + 0.84  # sigmas of an error that a limit of 3 sigmas finds in four of five sessions
MOST = 10.0  # sigmas q by which a wall may be off
OF_FACE = re.compile(r"wet_(.*)_(shift|turn)(?:_[12])?")


def unseen_face_error(freed: pd.DataFrame, limits: VerdictLimits) -> list[Statement]:
    """Return a warning if a wall that nobody has surveyed may be off unnoticed, by more than the mount bears.

    Parameters
    ----------
    freed
        The table of single-parameter tests, with the effects.
    limits
        Limits of the verdict: what the mount bears.
    """
    rows = freed[freed["unknown"].str.fullmatch(OF_FACE) & freed["known"] & np.isfinite(freed["expected"])]
    shift = rows["unknown"].str.endswith("_shift")
    rows = rows[rows["considered"] > np.where(shift, BUILT_M, np.radians(BUILT_DEG))]
    if rows.empty:
        return []
    known = rows["considered"].to_numpy(float)
    unseen = np.minimum(NOTICED * rows["expected"].to_numpy(float), MOST * known)
    by_sigma = rows[[f"effect_{name}" for name in MOUNT_NAMES]].to_numpy(float)
    effects = by_sigma * (unseen / known)[:, None]
    shares = np.abs(effects) / largest_sigmas(limits)
    row, column = np.unravel_index(np.argmax(shares), shares.shape)
    if shares[row, column] <= 1:
        return []
    size = abs(in_report_units(effects[row])[column])
    change = f"{size:.2f}°" if column < len(MOUNT_NAMES) // 2 else f"{1000 * size:.0f} mm"
    face = OF_FACE.sub(r"\1", str(rows["unknown"].iloc[row]))
    far, turned = float(unseen[row]), not shift[rows.index[row]]
    off = f"is turned by {np.degrees(far):.1f}°" if turned else f"stands off by {1000 * far:.0f} mm"
    words = (
        f"a wall that {off} below the water could go unnoticed ({face}), and {MOUNT_WORDS[column]} would be wrong by "
        f"{change}; the total sigmas do not cover it: look at the walls below the water, or pass more walls"
    )
    return [Statement(ReasonCode.UNSEEN_FACE_ERROR, words)]
