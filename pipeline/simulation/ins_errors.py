"""Errors of the INS's poses: white noise, steps at full seconds, and Gauss-Markov drift."""

from itertools import pairwise

import numpy as np

from pipeline.config.session import Drift
from pipeline.gps_time import NS
from pipeline.simulation.motion import Times
from pipeline.simulation.random_streams import autoregressive, generator
from pipeline.simulation.scenario_ins import InsScenario
from pipeline.simulation.site import Floats


def pose_sigmas(position_m: tuple[float, float, float], attitude_deg: tuple[float, float, float]) -> Floats:
    """Return sigmas (6, 1) of east, north, up in m and of roll, pitch, azimuth in rad."""
    return np.concatenate([position_m, np.radians(attitude_deg)])[:, None]


def white_noise(scenario: InsScenario, count: int, seed: int) -> Floats:
    """Return independent errors of the records.

    Parameters
    ----------
    scenario : InsScenario
        Their sigmas.
    count : int
        Number of records.
    seed : int
        Seed of the session.

    Returns
    -------
    (6, count) array
        East, north, up in m; roll, pitch, azimuth in rad.
    """
    position, attitude = scenario.white.position_m, scenario.white.attitude_deg
    noise = generator(seed, "ins_white").standard_normal((6, count))
    return pose_sigmas((position,) * 3, (attitude,) * 3) * noise


def gnss_steps(step_m: float, t_ns: Times, random: np.random.Generator) -> Floats:
    """Return position errors (3, n) that stay for a second of GPS time and are independent of those of the next.

    Parameters
    ----------
    step_m : float
        RMS of the step from one second to the next, √2 times that of the error.
    t_ns : (n,) array
        Times of the records, GPS ns, in order.
    random : Generator
        Generator of the random numbers.
    """
    _, second = np.unique(t_ns // NS, return_inverse=True)
    errors: Floats = step_m / np.sqrt(2) * random.standard_normal((int(second.max(initial=-1)) + 1, 3))
    return errors[second].T


def gauss_markov_drift(scenario: Drift, t_ns: Times, random: np.random.Generator) -> Floats:
    """Return first-order Gauss-Markov errors. The process continues through gaps.

    x(t + dt) = f x(t) + sqrt(1 - f²) sigma w, f = exp(-dt / tau): stationary from the first record on.

    Parameters
    ----------
    scenario : Drift
        Sigmas and time constant.
    t_ns : (n,) array
        Times of the records, GPS ns.
    random : Generator
        Generator of the random numbers.

    Returns
    -------
    (6, n) array
        East, north, up in m; roll, pitch, azimuth in rad.
    """
    scale = pose_sigmas(
        (scenario.horizontal_m, scenario.horizontal_m, scenario.vertical_m),
        (scenario.roll_pitch_deg, scenario.roll_pitch_deg, scenario.heading_deg),
    )
    if not np.any(scale):
        return np.zeros((6, len(t_ns)))
    shocks = random.standard_normal((6, len(t_ns)))
    steps = np.diff(t_ns)
    usual = np.median(steps) if len(steps) else 1
    breaks = [0, *(np.flatnonzero(np.abs(steps - usual) > 1) + 1), len(t_ns)]
    result = np.empty_like(shocks)
    last, before_ns = np.zeros(6), None
    for begin, end in pairwise(breaks):
        f = 0.0 if before_ns is None else np.exp(-(t_ns[begin] - before_ns) / NS / scenario.time_constant_s)
        shocks[:, begin] = f * last + np.sqrt(1 - f**2) * shocks[:, begin]
        f = np.exp(-usual / NS / scenario.time_constant_s)
        shocks[:, begin + 1 : end] *= np.sqrt(1 - f**2)
        result[:, begin:end] = autoregressive(shocks[:, begin:end], f)
        last, before_ns = result[:, end - 1], t_ns[end - 1]
    return scale * result
