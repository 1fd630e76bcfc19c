"""Passes of the boat in which the laser ran and the sonar did not: the only trace of a sonar file that is missing."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import UNSOUNDED_PASSES
from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic
from pipeline.maths.geometry.passes import FARTHEST_PASS_M, find_passes, pass_of

SOUNDED = 0.2  # share of the time abeam within passes, from which on the sonar ran


def unsounded_passes_table(
    trajectory: pd.DataFrame,
    frame: PoolFrame,
    laser_ns: NDArray[np.int64],
    passes: pd.DataFrame,
    max_gap_ns: int,
    reversal_m: float,
) -> pd.DataFrame:
    """Return the table ``unsounded_passes``.

    The boat passes the target where it crosses y = 0 in front of the target (-30 m < x < 0; pool frame), in a direction
    in which it sails in passes, too: it may come back with the sonar off. It is abeam of the target while |y| ≤ |x|.
    Such a stretch counts if the laser ran in it, and if less than a fifth of its INS records lie in passes.

    Parameters
    ----------
    trajectory : DataFrame
        INS records in order of time.
    frame : PoolFrame
        Frame of the positions.
    laser_ns : (n,) array
        Ascending times of laser points, one a second, GPS ns.
    passes : DataFrame
        The table ``passes``.
    max_gap_ns : int
        Longest interval without a record inside a pass, ns.
    reversal_m : float
        Movement back along the track that ends a pass, m.
    """
    t_ns = trajectory["t_ns"].to_numpy()
    geodetic = (trajectory[name].to_numpy() for name in ("latitude_rad", "longitude_rad", "height_m"))
    x, y = frame.points_from_ecef(ecef_from_geodetic(*geodetic))[:, :2].T
    abeam = (x < 0) & (x > -FARTHEST_PASS_M) & (np.abs(y) <= np.abs(x))
    sounded = pass_of(t_ns, passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy()) >= 0
    directions = {float(sense) for sense in np.sign(passes["length_m"])}
    rows = []
    for start, end in find_passes(t_ns, y, laser_ns, max_gap_ns, reversal_m):
        here = np.flatnonzero(abeam & (t_ns >= start) & (t_ns <= end))
        crosses = len(here) > 0 and y[here[0]] * y[here[-1]] < 0 and np.sign(y[here[-1]]) in directions
        if crosses and sounded[here].mean() < SOUNDED:
            times = {"start_ns": t_ns[here[0]], "end_ns": t_ns[here[-1]]}
            rows.append(times | {"distance_m": float(np.median(-x[here]))})
    return pd.DataFrame(rows, columns=[column.name for column in UNSOUNDED_PASSES.columns])
