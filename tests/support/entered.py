"""A boat on two courses, its soundings, and where a software with a given mount places them, by scipy alone."""

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from pipeline.entry_check.run_soundings import EntrySource, RunSoundings
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import Mounted

ANGLES = {"roll": -48.8, "pitch": 1.2, "yaw": -2.0}
COARSE = {"roll": -48.0, "pitch": 2.0, "yaw": -2.8}
LEVER, COARSE_LEVER = np.array([0.30, 0.20, -2.01]), np.array([0.38, 0.12, -2.09])
LASER = Mounted(np.eye(3), np.array([0.21, 0.48, 1.10]))
LETTERS = {"roll": "Y", "pitch": "X", "yaw": "Z"}
PINGS, BEAMS, PING_S = 60, 20, 0.1


def rotation(angles: dict[str, float], order: str = "yaw pitch roll") -> np.ndarray:
    """Product of the rotations by angles in degrees, from left to right."""
    names = order.split()
    letters, values = "".join(LETTERS[name] for name in names), [angles[name] for name in names]
    return np.asarray(Rotation.from_euler(letters, values, degrees=True).as_matrix())


SOURCE = EntrySource(
    Mounted(rotation(ANGLES), LEVER), Mounted(rotation(COARSE), COARSE_LEVER), LASER, mbes_latency_s=0.02,
    ins_latency_s=0.0,
)  # fmt: skip


class Boat:
    """Sails one course after the other past points about 6 m to starboard, rolling and pitching."""

    def __init__(
        self, headings_deg: tuple[float, ...] = (0.0,), speed_m_s: float = 1.0, seed: int = 1, rolling: float = 1.0
    ) -> None:
        random = np.random.default_rng(seed)
        t_s = np.arange(0.0, (PINGS + 20) * PING_S * len(headings_deg), 0.02)
        course = np.minimum((t_s // ((PINGS + 20) * PING_S)).astype(int), len(headings_deg) - 1)
        heading = np.array(headings_deg)[course] + 1.5 * np.sin(t_s / 1.7)
        roll, pitch = rolling * 2.0 * np.sin(t_s / 0.9), rolling * 1.2 * np.sin(t_s / 1.3)
        self.attitude = Rotation.from_euler("ZXY", np.stack([-heading, pitch, roll], 1), degrees=True)
        way = np.cumsum(speed_m_s * (1 + 0.3 * np.sin(t_s / 2))) * 0.02
        east, north = np.sin(np.radians(heading)), np.cos(np.radians(heading))
        self.positions = np.stack([-6 + way * east, way * north - 4, 0.1 * np.sin(t_s)], 1)
        self.t_s = t_s
        ping_s = np.concatenate([(1 + k * (PINGS + 20)) * PING_S + PING_S * np.arange(PINGS)
                                 for k in range(len(headings_deg))])  # fmt: skip
        self.sounding_s = np.repeat(ping_s, BEAMS)
        beam = np.tile(np.arange(BEAMS), len(ping_s))
        theta = np.radians(-25 + 48 / BEAMS * beam)
        away = np.repeat(6 + 2 * np.sin(0.7 * np.arange(len(ping_s))), BEAMS)  # else all soundings lie in one line
        ranges = away / np.maximum(np.cos(theta), 0.5) + random.normal(0, 0.01, len(theta))
        self.x_mbes = np.stack([np.sin(theta), np.zeros_like(theta), -np.cos(theta)], 1) * ranges[:, None]
        t_ns = np.round(t_s * 1e9).astype(np.int64)
        trajectory = Trajectory.build(t_ns, self.positions, self.attitude.as_matrix())
        times = np.round(self.sounding_s * 1e9).astype(np.int64)
        self.soundings = RunSoundings.of(trajectory, times, beam, self.x_mbes)

    def placed(self, R: np.ndarray, lever: np.ndarray, delay_s: float = 0.0) -> np.ndarray:
        at = self.sounding_s + delay_s
        place = np.stack([np.interp(at, self.t_s, axis) for axis in self.positions.T], 1)
        return np.asarray(place + Slerp(self.t_s, self.attitude)(at).apply(self.x_mbes @ R.T + lever))
