"""Random numbers: one generator for each purpose, so that without one noise source all others are unchanged."""

import numpy as np

from pipeline.simulation.site import Floats

PURPOSES = (
    "coarse", "motion", "ins_white", "ins_drift", "laser_range", "laser_angle", "laser_outlier", "laser_water",
    "mbes_clock", "mbes_range", "mbes_angle", "mbes_outlier", "mbes_surface", "mbes_corner", "mbes_drop",
    "coarse_laser", "unevenness", "ins_second_drift", "ins_gnss", "laser_splash", "mbes_side_lobe", "mbes_image",
    "mbes_ping", "mbes_steering", "mbes_pps", "fouling",
)  # append only: the place in this list is part of the seed


def generator(seed: int, purpose: str, index: int = 0) -> np.random.Generator:
    """Return the generator of one purpose in one pass.

    Its numbers do not depend on the batches in which they are drawn.

    Parameters
    ----------
    seed : int
        Seed of the session.
    purpose : str
        One of PURPOSES.
    index : int
        Number of the pass.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(PURPOSES.index(purpose), index)))


def autoregressive(shocks: Floats, kept: float) -> Floats:
    """Return the first-order process y(i) = kept y(i - 1) + shock(i) along the last axis, with y(-1) = 0."""
    from scipy.signal import lfilter  # the import takes a second, and few sessions need it

    return np.asarray(lfilter([1.0], [1.0, -kept], shocks), np.float64)
