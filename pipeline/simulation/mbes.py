"""Records of the sonar: two-way times and angles of beams of finite width, with unwanted echoes."""

import numpy as np

from pipeline.gps_time import NS
from pipeline.simulation.beams import BeamBundles, fan_angles, swing_rad, transmit_tilts_rad
from pipeline.simulation.echoes import Echoes
from pipeline.simulation.ins import Columns
from pipeline.simulation.motion import Movement, Times
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.random_streams import autoregressive, generator
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.site import Floats
from pipeline.simulation.water_column import WaterColumn

RAYS_AT_ONCE = 400_000
CLOCK_RATE_ERROR = 3.7e-5  # error of the sonar's clock, so that pings never fall into step with the INS
_SHORTEST_M = 0.5
OF_NEXT_HEAD = 1000  # more than passes: where the generators of the next head begin


def record_mbes(
    scenario: MbesScenario, movement: Movement, pool: Pool, seed: int, head: int = 0
) -> tuple[Columns, Columns]:
    """Simulate the records of one head of the sonar.

    Parameters
    ----------
    scenario : MbesScenario
        The sonar, its mount and its errors.
    movement : Movement
        True poses.
    pool : Pool
        Surfaces that its beams meet.
    seed : int
        Seed of the session.
    head : int
        Number of the head, from 0: each has noise and a clock of its own.

    Returns
    -------
    detections : Columns
        Canonical raw columns.
    pings : Columns
        Columns t_ns, ping, pass of every ping.
    """
    angles = fan_angles(scenario).angles_rad
    parts: list[Columns] = []
    pings: list[Columns] = []
    first = 1000
    for k in movement.passes:
        sonar = _SonarPass(scenario, movement, pool, angles, seed=seed, k=k, head=head, first_ping=first)
        batch = max(1, RAYS_AT_ONCE // (len(angles) * sonar.beams.rays))
        parts += [sonar.detections(slice(i, i + batch)) for i in range(0, max(len(sonar.t_ns), 1), batch)]
        pings.append({"t_ns": sonar.recorded_ns, "ping": sonar.ping, "pass": np.full(len(sonar.ping), k)})
        first += sonar.count
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return columns, {name: np.concatenate([part[name] for part in pings]) for name in pings[0]}


class _SonarPass:
    """Records of one pass. Batches of pings must be taken in order, because they share the generators."""

    def __init__(
        self,
        scenario: MbesScenario,
        movement: Movement,
        pool: Pool,
        angles_rad: Floats,
        *,
        seed: int,
        k: int,
        head: int,
        first_ping: int,
    ) -> None:
        self.scenario, self.movement, self.pool, self.k, self.angles_rad = scenario, movement, pool, k, angles_rad
        start_ns, end_ns = movement.sensors_run_ns(k)
        period_s = (1 + CLOCK_RATE_ERROR) / scenario.ping_rate_hz
        own = k + OF_NEXT_HEAD * head
        phase = generator(seed, "mbes_clock", own).random()
        self.count = round((end_ns - start_ns) / NS / period_s)
        t_ns = start_ns + np.rint((np.arange(self.count) + phase) * period_s * NS).astype(np.int64)
        kept = generator(seed, "mbes_drop", own).random(self.count) >= scenario.dropped_ping_share
        self.t_ns: Times = t_ns[kept]
        jitter_s = scenario.pps_jitter_s * generator(seed, "mbes_pps", own).standard_normal(self.count)[kept]
        self.recorded_ns: Times = self.t_ns + round(scenario.latency_s * NS) + np.rint(jitter_s * NS).astype(np.int64)
        self.ping = first_ping + np.flatnonzero(kept).astype(np.int64)
        self.beams = BeamBundles(scenario, pool.caster, pool.water_level_m)
        self.R_body_from_mbes = R_body_from_sensor(scenario.mount).as_matrix()
        names = ("range", "angle", "outlier", "surface", "corner", "side_lobe", "image", "ping", "steering")
        self.random = {name: generator(seed, f"mbes_{name}", own) for name in names}
        self.water = WaterColumn(scenario, self.beams, pool.water_level_m)
        self.echoes = Echoes(scenario, pool, self.beams, self.random)

    def detections(self, part: slice) -> Columns:
        """Return the canonical raw columns of the pings in ``part``, without beams that have no echo."""
        scenario, t_ns = self.scenario, self.t_ns[part]
        shape = (len(t_ns), len(self.angles_rad))
        pose = self.movement.pose(self.k, t_ns)
        origins = pose.position_target_m + pose.R_target_from_body @ lever_arm_m(scenario.mount)
        R_target_from_mbes = pose.R_target_from_body @ self.R_body_from_mbes
        tilts = transmit_tilts_rad(scenario, self.angles_rad, self.ping[part])
        # Both arrays are flat: they are steered with the recorded sound speed, sin(true) = k sin(recorded).
        k = self.water.speeds_at(origins) * (1 + scenario.head_speed_excess) / scenario.sound_speed_recorded_m_s
        true_tilts = np.arcsin(k * np.sin(tilts))
        swing, exists = swing_rad(k * np.sin(self._steered(shape)), true_tilts)
        of_ping = self.random["ping"].standard_normal((len(t_ns), 2))
        swing = swing - np.radians(scenario.ping_roll_sigma_deg) * of_ping[:, :1]  # starboard down: beams go to port
        paths, directions = self.water.paths(origins, R_target_from_mbes, swing, true_tilts)
        paths = self.echoes.detected(paths, origins, directions, R_target_from_mbes)
        paths = paths + scenario.ping_range_sigma_m * of_ping[:, 1:]
        dice = self.random["outlier"].random((*shape, 2))
        random_paths = _SHORTEST_M + dice[..., 1] * (scenario.max_range_m - _SHORTEST_M)
        paths = np.where(dice[..., 0] < scenario.outlier_share, random_paths, paths)
        ping, beam = np.nonzero(np.isfinite(paths) & exists & (paths > 0.1) & (paths <= scenario.max_range_m))
        two_way_time_s = 2 * paths[ping, beam] / scenario.sound_speed_true_m_s
        later_ns = np.rint(two_way_time_s * NS).astype(np.int64) if scenario.stamp == "reception" else 0
        return {
            "t_ns": self.recorded_ns[part][ping] + later_ns,
            "ping": self.ping[part][ping],
            "beam": beam.astype(np.int16),
            "two_way_time_s": two_way_time_s,
            "angle_rad": self.angles_rad[beam],
            "transmit_tilt_rad": tilts[ping, beam],
            "sound_speed_m_s": np.full(len(ping), float(np.float32(scenario.sound_speed_recorded_m_s))),
        }

    def _steered(self, shape: tuple[int, int]) -> Floats:
        """Return the angles (p, b) at which the beams listen: those recorded, the array's errors, and noise.

        Of the correlated part each beam keeps ``steering_correlation`` times that of the beam before.
        """
        scenario = self.scenario
        noise = self.random["angle"].standard_normal(shape)
        array = self.angles_rad + np.radians(scenario.array_ripple_deg) * np.sin(2 * self.angles_rad)
        steered: Floats = array + np.radians(scenario.angle_sigma_deg) * noise
        if not scenario.steering_sigma_deg:
            return steered
        kept = scenario.steering_correlation
        shocks = self.random["steering"].standard_normal(shape)
        shocks[:, 1:] *= np.sqrt(1 - kept**2)
        return np.asarray(steered + np.radians(scenario.steering_sigma_deg) * autoregressive(shocks, kept))
