"""Records of the INS: the true poses, with drift through the whole session, GNSS steps and white noise."""

import numpy as np

from pipeline.gps_time import NS
from pipeline.simulation.ins_errors import gauss_markov_drift, gnss_steps, white_noise
from pipeline.simulation.motion import Movement, Times
from pipeline.simulation.random_streams import generator
from pipeline.simulation.scenario_ins import NO_DRIFT, InsScenario

Columns = dict[str, np.ndarray]
_POSE_COLUMNS = ("latitude_rad", "longitude_rad", "height_m", "roll_rad", "pitch_rad", "azimuth_rad")


def record_ins(scenario: InsScenario, movement: Movement, seed: int) -> tuple[Columns, list[int]]:
    """Simulate the records of the INS.

    Parameters
    ----------
    scenario : InsScenario
        Rate and errors.
    movement : Movement
        True poses.
    seed : int
        Seed of the session.

    Returns
    -------
    columns : Columns
        Canonical raw columns.
    first_rows : list of int
        First row of each pass, and the number of rows.
    """
    times = [_epochs(scenario.rate_hz, *movement.ins_runs_ns(k)) for k in movement.passes]
    t_ns = np.concatenate(times)
    errors = gauss_markov_drift(scenario.drift, t_ns, generator(seed, "ins_drift"))
    errors = errors + white_noise(scenario, len(t_ns), seed)
    if scenario.second_drift != NO_DRIFT:
        errors = errors + gauss_markov_drift(scenario.second_drift, t_ns, generator(seed, "ins_second_drift"))
    if scenario.gnss_step_m:
        errors[:3] += gnss_steps(scenario.gnss_step_m, t_ns, generator(seed, "ins_gnss"))
    rows = np.concatenate([[0], np.cumsum([len(t) for t in times])])
    columns: Columns = {"t_ns": t_ns} | {name: np.empty(len(t_ns)) for name in _POSE_COLUMNS}
    for k in movement.passes:
        part = slice(rows[k], rows[k + 1])
        pose = movement.pose(k, times[k])
        east_north_up = errors[:3, part].T
        shift_target = movement.site.R_level_from_target.inv().apply(east_north_up)
        position = movement.site.geodetic_from_target(pose.position_target_m + shift_target)
        for name, values in zip(_POSE_COLUMNS[:3], position, strict=True):
            columns[name][part] = values
        columns["roll_rad"][part] = pose.roll_rad + errors[3, part]
        columns["pitch_rad"][part] = pose.pitch_rad + errors[4, part]
        columns["azimuth_rad"][part] = (pose.azimuth_rad + errors[5, part]) % (2 * np.pi)
    return columns, [int(row) for row in rows]


def _epochs(rate_hz: float, start_ns: int, end_ns: int) -> Times:
    """Return epochs (GPS ns) from start to before end, at whole multiples of the interval, as receivers log them."""
    interval_ns = round(NS / rate_hz)
    return np.arange(-(-start_ns // interval_ns), -(-end_ns // interval_ns), dtype=np.int64) * interval_ns
