"""Sonars that are level and still, and distances that follow by hand."""

import numpy as np

from pipeline.simulation.session import SimulatedSession

LEVEL = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": -2.0}
STILL = {name: {"amplitude": 0.0, "period_s": 5.0} for name in ("surge", "sway", "heave", "roll", "pitch", "heading")}
LEVEL_CURVES = 1e-5  # m: 5 m from the origin the local level is turned by 5 / 6.4e6 rad


def range_m(session: SimulatedSession, angle_deg: float, y_m: float) -> float:
    """The range of the beam at an angle while the INS passes y."""
    when = session.truth["passes"][0]["start_ns"] + round((y_m + 4.5) / 0.4 * 1e9)
    ping = session.pings["ping"][np.argmin(np.abs(session.pings["t_ns"] - when))]
    chosen = (session.mbes["ping"] == ping) & (np.abs(session.mbes["angle_rad"] - np.radians(angle_deg)) < 1e-6)
    assert chosen.sum() == 1
    return float(session.mbes["two_way_time_s"][chosen][0] * session.mbes["sound_speed_m_s"][0] / 2)


def distance_to_model_m(points: np.ndarray, a: float, b: float, c: float, e: float) -> np.ndarray:
    """Distance to the nearest plane: wall, slanted faces, sides, tops and bottoms, back wall, floor."""
    x, y, z = points.T
    slanted = (np.abs(y) - b / 2 - x) / np.sqrt(2)
    horizontal = (z + a / 2 + e / 2) % e - e / 2
    planes = [x, slanted, np.abs(y) - b / 2, horizontal, x - c, z + a / 2 + 0.3]
    nearest: np.ndarray = np.min(np.abs(planes), axis=0)
    return nearest
