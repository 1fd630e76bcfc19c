"""Records of the laser scanner: lines athwart to starboard, in the scanner's own frame."""

import numpy as np

from pipeline.gps_time import NS
from pipeline.simulation.ins import Columns
from pipeline.simulation.laser_returns import Rays, measured_ranges
from pipeline.simulation.motion import Movement, Times
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.random_streams import generator
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario_laser import LaserScenario
from pipeline.simulation.site import Floats

_CHUNK = 200_000
_SHORTEST_M = 0.5
BELOW_WATER_M = 0.3


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
        measured = measured_ranges(self.scenario, self.pool, Rays(origins, directions, ranges, surfaces))
        if self.scenario.splash_share:
            reach = np.where(np.isfinite(ranges), ranges, np.nan)
            measured = measured - self._splash_m(reach * directions[:, 2] - height)
        return np.where(ranges < to_water, measured, echo)

    def _splash_m(self, heights_m: Floats) -> Floats:
        """Return how much before the face each ray (n,) ends in drops; ``heights_m``: where it meets one, NaN: none."""
        scenario = self.scenario
        dice = self.random["splash"].random((len(heights_m), 2))
        near = (heights_m > 0) & (heights_m < scenario.splash_height_m)
        return np.where(near & (dice[:, 0] < scenario.splash_share), scenario.splash_depth_m * dice[:, 1], 0.0)
