"""Records of the sonar: two-way times and angles of beams of finite width, with unwanted echoes."""

import numpy as np

from pipeline.gps_time import NS
from pipeline.simulation.beams import BeamBundles, directions_in_mbes, fan_angles, swing_rad, transmit_tilts_rad
from pipeline.simulation.ins import Columns
from pipeline.simulation.motion import Movement, Times
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.random_streams import generator
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario import MbesScenario
from pipeline.simulation.site import Floats

RAYS_AT_ONCE = 400_000
CLOCK_RATE_ERROR = 3.7e-5  # error of the sonar's clock, so that pings never fall into step with the INS
_SHORTEST_M = 0.5
UPWARD_RAD = np.radians(-30.0)  # beams above this may get the water surface's echo


def record_mbes(
    scenario: MbesScenario, movement: Movement, pool: Pool, seed: int
) -> tuple[Columns, Columns]:
    """Simulate the records of the sonar.

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
        sonar = _SonarPass(scenario, movement, pool, angles, seed=seed, k=k, first_ping=first)
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
        first_ping: int,
    ) -> None:
        self.scenario, self.movement, self.pool, self.k, self.angles_rad = scenario, movement, pool, k, angles_rad
        start_ns, end_ns = movement.sensors_run_ns(k)
        period_s = (1 + CLOCK_RATE_ERROR) / scenario.ping_rate_hz
        phase = generator(seed, "mbes_clock", k).random()
        self.count = round((end_ns - start_ns) / NS / period_s)
        t_ns = start_ns + np.rint((np.arange(self.count) + phase) * period_s * NS).astype(np.int64)
        kept = generator(seed, "mbes_drop", k).random(self.count) >= scenario.dropped_ping_share
        self.t_ns: Times = t_ns[kept]
        self.recorded_ns: Times = self.t_ns + round(scenario.latency_s * NS)
        self.ping = first_ping + np.flatnonzero(kept).astype(np.int64)
        self.beams = BeamBundles(scenario, pool.caster, pool.water_level_m)
        self.R_body_from_mbes = R_body_from_sensor(scenario.mount).as_matrix()
        names = ("range", "angle", "outlier", "surface", "corner")
        self.random = {name: generator(seed, f"mbes_{name}", k) for name in names}

    def detections(self, part: slice) -> Columns:
        """Return the canonical raw columns of the pings in ``part``, without beams that have no echo."""
        scenario, t_ns = self.scenario, self.t_ns[part]
        shape = (len(t_ns), len(self.angles_rad))
        pose = self.movement.pose(self.k, t_ns)
        origins = pose.position_target_m + pose.R_target_from_body @ lever_arm_m(scenario.mount)
        R_target_from_mbes = pose.R_target_from_body @ self.R_body_from_mbes
        steered = self.angles_rad + np.radians(scenario.angle_sigma_deg) * self.random["angle"].standard_normal(shape)
        tilts = transmit_tilts_rad(scenario, self.angles_rad, self.ping[part])
        # Both arrays are flat: they are steered with the recorded sound speed, sin(true) = k sin(recorded).
        k = scenario.sound_speed_true_m_s / scenario.sound_speed_recorded_m_s
        true_tilts = np.arcsin(k * np.sin(tilts))
        swing, exists = swing_rad(k * np.sin(steered), true_tilts)
        paths, directions = self._bent(origins, R_target_from_mbes, swing, true_tilts)
        paths = self._corners(paths, origins, directions)
        paths = paths + scenario.range_sigma_m * self.random["range"].standard_normal(shape)
        paths = self._surface(paths, origins, directions)
        dice = self.random["outlier"].random((*shape, 2))
        random_paths = _SHORTEST_M + dice[..., 1] * (scenario.max_range_m - _SHORTEST_M)
        paths = np.where(dice[..., 0] < scenario.outlier_share, random_paths, paths)
        ping, beam = np.nonzero(np.isfinite(paths) & exists & (paths > 0.1) & (paths <= scenario.max_range_m))
        return {
            "t_ns": self.recorded_ns[part][ping],
            "ping": self.ping[part][ping],
            "beam": beam.astype(np.int16),
            "two_way_time_s": 2 * paths[ping, beam] / scenario.sound_speed_true_m_s,
            "angle_rad": self.angles_rad[beam],
            "transmit_tilt_rad": tilts[ping, beam],
            "sound_speed_m_s": np.full(len(ping), float(np.float32(scenario.sound_speed_recorded_m_s))),
        }

    def _bent(
        self, origins: Floats, R_target_from_mbes: Floats, swing: Floats, tilts: Floats
    ) -> tuple[Floats, Floats]:
        """Return paths and directions of the beams. The beams are bent if the sound speed changes with depth.

        With dc/d(depth) = g, a ray curves upward by g/c per metre, times the part of the vector "up" that is normal to
        the ray. After a path r, its chord is turned upward by r g / 2c times this part. The part is split into the two
        directions in which ψ and τ of the ray grow. The mean sound speed down to a depth is g · depth / 2 higher.
        """
        gradient, speed = self.scenario.sound_speed_gradient_1_s, self.scenario.sound_speed_true_m_s
        paths, directions = self.beams.paths(origins, R_target_from_mbes, swing, tilts)
        if not gradient:
            return paths, directions
        up = R_target_from_mbes[:, 2, :]
        sideways = np.einsum("pi,pbi->pb", up, directions_in_mbes(swing + np.pi / 2, np.zeros_like(tilts)))
        ahead = np.einsum("pi,pbi->pb", up, directions_in_mbes(swing, tilts + np.pi / 2))
        turn = gradient / (2 * speed) * np.where(np.isfinite(paths), paths, 0.0)
        swing, tilts = swing + turn * sideways / np.cos(tilts), tilts + turn * ahead
        paths, directions = self.beams.paths(origins, R_target_from_mbes, swing, tilts)
        depths = -directions[..., 2] * np.where(np.isfinite(paths), paths, 0.0)
        return paths * (1 - gradient * depths / (2 * speed)), directions

    def _corners(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the paths, some of them near an inner corner replaced by the path to the corner's line.

        The echo comes from the nearest point of the line within the beam.
        """
        scenario = self.scenario
        dice = self.random["corner"].random(paths.shape)
        ping, beam = np.nonzero(np.isfinite(paths) & (dice < scenario.corner_share))
        hits = origins[ping] + paths[ping, beam, None] * directions[ping, beam]
        half = paths[ping, beam] * np.radians(scenario.beam_deg[0]) / 2
        result = paths.copy()
        for x, y, low, high in self.pool.corner_lines:
            near = np.hypot(hits[:, 0] - x, hits[:, 1] - y) < scenario.corner_reach_m
            near &= (hits[:, 2] > low) & (hits[:, 2] < high)
            start = origins[ping[near]]
            height = np.clip(start[:, 2], hits[near, 2] - half[near], hits[near, 2] + half[near])
            points = np.column_stack([np.full(len(height), x), np.full(len(height), y), np.clip(height, low, high)])
            result[ping[near], beam[near]] = np.linalg.norm(points - start, axis=1)
        return result

    def _surface(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the paths, some replaced by the path to the water surface: along the beam, or else straight up."""
        dice = self.random["surface"].random(paths.shape)
        chosen = (dice < self.scenario.surface_share) & (directions[..., 2] > np.sin(UPWARD_RAD))
        depth = np.broadcast_to((self.pool.water_level_m - origins[:, 2])[:, None], paths.shape)
        rise = directions[..., 2]
        along = np.divide(depth, rise, out=np.full(paths.shape, np.inf), where=rise > 1e-3)
        return np.where(chosen, np.where(along <= self.scenario.max_range_m, along, depth), paths)
