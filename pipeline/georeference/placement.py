"""Points of both sensors in the pool frame, by mount, pose at the time of the point, and refraction."""


import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch
from pipeline.config.stage_settings import LaserPlacement, SonarPlacement
from pipeline.georeference.pool_context import PoolContext
from pipeline.maths.sonar.ray_tracing import Cast
from pipeline.maths.sonar.soundings import points_in_mbes, refracted_points
from pipeline.mount import mount_of

Array = NDArray[np.float64]


def laser_in_pool(
    t_ns: NDArray[np.int64], points: Array, context: PoolContext, laser: LaserPlacement
) -> tuple[Array, Array]:
    """Return laser points (n, 3) m in the scanner's frame and in the pool frame.

    Parameters
    ----------
    t_ns
        Times (n,).
    points
        Points (n, 3) m of the files: in the scanner's frame or in ECEF, by ``laser.frame``.
    context
        The trajectory in the pool.
    laser
        The laser's mount and frame.
    """
    mount = mount_of(laser.mount)
    if laser.frame == "laser":
        placed = context.trajectory.points_from_sensor(t_ns, points, mount.R_body_from_sensor, mount.lever_arm_body_m)
        return points, placed
    pool = context.frame.points_from_ecef(points)
    positions, R_pool_from_body = context.trajectory.poses_at(t_ns)
    body = np.einsum("nji,nj->ni", R_pool_from_body, pool - positions)
    return (body - mount.lever_arm_body_m) @ mount.R_body_from_sensor, pool


def soundings_in_pool(
    columns: Batch, context: PoolContext, mbes: SonarPlacement, water_level_m: float | Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return soundings (n, 3) m in the mbes frame and in the pool frame, and a mask (n,): true for possible ones.

    Parameters
    ----------
    columns
        Columns of n soundings: times, travel times, angles, tilts, sound speeds.
    context
        The trajectory in the pool.
    mbes
        The sonar's mount, sound speed and cast.
    water_level_m
        Height of the water, or heights (n,), pool frame.
    """
    t_ns, recorded_m_s = columns["t_ns"], columns["sound_speed_m_s"]
    sensor, possible = points_in_mbes(
        columns["two_way_time_s"],
        columns["angle_rad"],
        columns["transmit_tilt_rad"],
        recorded_m_s,
        true_sound_speed_m_s=mbes.sound_speed_m_s,
        projector_offset_m=None if mbes.projector_offset_m is None else np.array(mbes.projector_offset_m),
    )
    mount = mount_of(mbes.mount)
    if mbes.svp is not None:
        # The cast bends the rays. Its depths count from the surface of the water.
        positions, R_pool_from_body = context.trajectory.poses_at(t_ns)
        head = positions + R_pool_from_body @ mount.lever_arm_body_m
        sensor = refracted_points(
            sensor,
            recorded_m_s if mbes.sound_speed_m_s is None else np.full(len(t_ns), mbes.sound_speed_m_s),
            R_pool_from_body @ mount.R_body_from_sensor,
            water_level_m - head[:, 2],
            Cast(*np.array(mbes.svp, dtype=np.float64).T),
        )
    placed = context.trajectory.points_from_sensor(t_ns, sensor, mount.R_body_from_sensor, mount.lever_arm_body_m)
    return sensor, placed, possible
