"""How far a fit changes if a whole pass is left out: the uncertainty by errors that are common to a pass.

Another cast, other rays, or positions that were processed otherwise move all soundings of a pass in much the same way.
Residuals within a second do not show that, but passes at different distances and times do.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.run_soundings import NS_PER_S

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
GAP_S = 5.0  # between two passes (CONVENTIONS.md)
LEAST_GROUPS = 4


def time_groups(t_ns: Integers) -> Integers:
    """Return the number (n,) of each sounding's group: its pass, or a part of it where there are fewer than four.

    Parameters
    ----------
    t_ns
        (n,): times, in any order.
    """
    times = np.unique(t_ns)
    run = np.cumsum(np.diff(times, prepend=times[:1]) > GAP_S * NS_PER_S, dtype=np.int64)
    parts = -(-LEAST_GROUPS // (int(run[-1]) + 1))
    first = np.searchsorted(run, np.arange(run[-1] + 1))
    count = np.bincount(run)
    part = (np.arange(len(times)) - first[run]) * parts // count[run]
    return np.asarray((run * parts + part)[np.searchsorted(times, t_ns)])


def leave_one_out(design: Array, weight: Array, scores: Array, normal: Array, group: Integers) -> Array:
    """Return the variances (p,) of the parameters, (G - 1)/G Σ δ δ, δ their change without one of G groups.

    At the minimum all scores g = Aᵀ w r sum up to 0. Without a group the step that is left is
    δ = -(N - N_group)⁻¹ g_group (Efron 1982, the jackknife; to first order).

    Parameters
    ----------
    design, weight, scores
        A (n, 3, p), w (n,), and g of each sounding (n, p).
    normal
        N (p, p).
    group
        (n,): the sounding's group.
    """
    names = np.unique(group)
    changes = []
    for name in names:
        rows = group == name
        own = np.einsum("nik,n,nil->kl", design[rows], weight[rows], design[rows], optimize=True)
        changes.append(np.linalg.pinv(normal - own, rcond=1e-14, hermitian=True) @ scores[rows].sum(axis=0))
    return np.asarray((len(names) - 1) / len(names) * np.square(changes).sum(axis=0))
