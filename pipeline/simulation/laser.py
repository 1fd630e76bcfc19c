"""Records of the laser scanner: lines athwart to starboard, in the scanner's own frame."""

import numpy as np
from numpy.typing import NDArray

from pipeline.gps_time import NS
from pipeline.simulation.echoes import range_bias
from pipeline.simulation.ins import Columns
from pipeline.simulation.motion import Movement, Times
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.random_streams import generator
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario_sensors import LaserScenario
from pipeline.simulation.site import Floats

_CHUNK = 200_000
_SHORTEST_M = 0.5
BELOW_WATER_M = 0.3
_PULSE_M = 0.5  # echoes farther apart than this are told apart


def scan_directions(zenith_rad: Floats, azimuth_rad: Floats) -> Floats:
    """Return unit vectors (n, 3), laser frame: (sin t cos p, sin t sin p, cos t); t from zenith, p from starboard."""
    return np.stack(
        [np.sin(zenith_rad) * np.cos(azimuth_rad), np.sin(zenith_rad) * np.sin(azimuth_rad), np.cos(zenith_rad)], axis=1
    )


def record_laser(
    scenario: LaserScenario, movement: Movement, pool: Pool, seed: int
) -> tuple[Columns, list[int]]:
    """Simulate the records of the laser scanner.

    Parameters
    ----------
    scenario : LaserScenario
        The scanner, its mount and its errors.
    movement : Movement
        True poses.
    pool : Pool
        Surfaces that its rays meet.
    seed : int
        Seed of the session.

    Returns
    -------
    columns : Columns
        Canonical raw columns.
    first_rows : list of int
        First row of each pass, and the number of rows.
    """
    pieces = [(np.empty(0, dtype=np.int64), np.empty((3, 0)))]
    rows = [0]
    for k in movement.passes:
        scan = _LaserPass(scenario, movement, pool, seed, k)
        pieces += [scan.chunk(start) for start in range(0, scan.count, _CHUNK)]
        rows.append(sum(len(t) for t, _ in pieces))
    columns: Columns = {"t_ns": np.concatenate([t for t, _ in pieces])}
    for axis, name in enumerate(("x_m", "y_m", "z_m")):
        columns[name] = np.concatenate([points[axis] for _, points in pieces])
    return columns, rows


class _LaserPass:
    """Records of one pass. Chunks must be taken in order, because they share the generators."""

    def __init__(self, scenario: LaserScenario, movement: Movement, pool: Pool, seed: int, k: int) -> None:
        self.scenario, self.movement, self.pool, self.k = scenario, movement, pool, k
        self.start_ns, end_ns = movement.sensors_run_ns(k)
        self.count = int((end_ns - self.start_ns) / NS * scenario.point_rate_hz)
        self.R_body_from_laser = R_body_from_sensor(scenario.mount)
        names = ("range", "angle", "outlier", "water", "splash")
        self.random = {name: generator(seed, f"laser_{name}", k) for name in names}

    def chunk(self, start: int) -> tuple[Times, Floats]:
        """Return recorded times (m,) and points (3, m) of the rays from number ``start`` on, at most _CHUNK of them."""
        scenario = self.scenario
        number = np.arange(start, min(start + _CHUNK, self.count))
        t_ns = self.start_ns + np.rint(number * (NS / scenario.point_rate_hz)).astype(np.int64)
        low, high = np.radians(scenario.field_deg)
        zenith = low + (high - low) * ((number * (scenario.line_rate_hz / scenario.point_rate_hz)) % 1.0)
        ranges = self._true_ranges(t_ns, scan_directions(zenith, np.zeros(len(number))))
        ranges = ranges + scenario.range_sigma_m * self.random["range"].standard_normal(len(number))
        angles = np.radians(scenario.angle_sigma_deg) * self.random["angle"].standard_normal((len(number), 2))
        dice = self.random["outlier"].random((len(number), 2))
        random_ranges = _SHORTEST_M + dice[:, 1] * (scenario.max_range_m - _SHORTEST_M)
        ranges = np.where(dice[:, 0] < scenario.outlier_share, random_ranges, ranges)
        kept = np.isfinite(ranges) & (ranges <= scenario.max_range_m) & (ranges > _SHORTEST_M / 2)
        points = ranges[kept] * scan_directions(zenith[kept] + angles[kept, 0], angles[kept, 1]).T
        return t_ns[kept] + round(scenario.latency_s * NS), points

    def _true_ranges(self, t_ns: Times, direction_laser: Floats) -> Floats:
        """Return ranges (n,) to surfaces above the water, for some rays to just below the water surface; inf: none."""
        pose = self.movement.pose(self.k, t_ns)
        direction_body = self.R_body_from_laser.apply(direction_laser)
        directions = np.einsum("nij,nj->ni", pose.R_target_from_body, direction_body)
        origins = pose.position_target_m + pose.R_target_from_body @ lever_arm_m(self.scenario.mount)
        ranges, surfaces = self.pool.caster.cast(origins, directions)
        height = self.pool.water_level_m - origins[:, 2]
        down = directions[:, 2] < -1e-9
        to_water = np.divide(height, directions[:, 2], out=np.full(len(height), np.inf), where=down)
        dice = self.random["water"].random((len(t_ns), 2))
        echo = np.where(dice[:, 0] < self.scenario.water_return_share, to_water + BELOW_WATER_M * dice[:, 1], np.inf)
        measured = self._mixed(ranges, surfaces, origins, directions)
        if self.scenario.incidence_bias_m or self.scenario.level_bias_m:
            normals = self.pool.caster.normals(origins, directions)
            measured = measured + range_bias(self.scenario, normals, directions, "tangent_squared")
        return np.where(ranges < to_water, measured - self._splash_m(origins, directions, ranges), echo)

    def _mixed(self, ranges: Floats, surfaces: NDArray[np.int64], origins: Floats, directions: Floats) -> Floats:
        """Return the ranges (n,) of beams with a width, from those of their axes and the surfaces that these meet.

        A beam that meets more than one plane is four rays round its axis beside the axis itself, which counts twice.
        Their mean is measured, without those that end in water or whose echoes can be told apart from the axis's.
        """
        scenario = self.scenario
        if not (scenario.spot_m or scenario.spot_divergence_deg):
            return ranges
        side = np.cross(directions, [0.0, 0.0, 1.0])
        side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
        total, count, mixed = 2 * ranges, np.full(len(ranges), 2.0), np.zeros(len(ranges), dtype=bool)
        widening = np.tan(np.radians(scenario.spot_divergence_deg) / 2)
        for way in (side, -side, np.cross(side, directions), -np.cross(side, directions)):
            leaning = (directions + widening * way) / np.hypot(1.0, widening)
            found, surface = self.pool.caster.cast(origins + scenario.spot_m / 2 * way, leaning)
            near = np.abs(found - np.where(np.isfinite(ranges), ranges, 0.0)) < _PULSE_M
            near &= origins[:, 2] + np.where(near, found, 0.0) * leaning[:, 2] > self.pool.water_level_m
            total, count = np.where(near, total + found, total), count + near
            mixed |= near & (surface != surfaces)
        return np.where(mixed, total / count, ranges)

    def _splash_m(self, origins: Floats, directions: Floats, ranges: Floats) -> Floats:
        """Return how much before the face each ray (n,) ends in drops; zero for most, and all that end higher up."""
        scenario = self.scenario
        if not scenario.splash_share:
            return np.zeros(len(ranges))
        dice = self.random["splash"].random((len(ranges), 2))
        height = origins[:, 2] + np.where(np.isfinite(ranges), ranges, 0.0) * directions[:, 2] - self.pool.water_level_m
        wet = (dice[:, 0] < scenario.splash_share) & (height > 0) & (height < scenario.splash_height_m)
        return np.where(wet, scenario.splash_depth_m * dice[:, 1], 0.0)
