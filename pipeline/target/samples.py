"""Samples of the points for the searches of the target's pose and of the mounts."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import Voxels, points_above, sample_rows, voxel_means, voxel_sums
from pipeline.artefacts.streams import Batch, Stream, point_array
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.target.coverage import Scan
from pipeline.mount import Mounted

Array = NDArray[np.float64]
Singles = tuple[NDArray[np.int64], Array, Array]  # times (k,), places in the pool frame and in the scanner's (k, 3) m
VOXEL_M = 0.1  # laser points are averaged over cubes of this size
SOUNDING_SAMPLE = 8_000  # about this many soundings
LASER_SAMPLE = 2_000_000  # about this many laser points at most, which are averaged over voxels
RAYS = 40_000  # of the scanner, by which a search knows where it looked
RAW_SAMPLE = 50_000  # about this many of them at most, as single points


@dataclass(frozen=True)
class LaserSample:
    """Dry laser points in the pool frame: means over voxels (n, 3) m, and a sample of single points (k, 3) m.

    The search uses the means, because their density is even. They are biased if a face lies along the sides of voxels:
    the points before and behind the face then have separate means. So the pose is estimated from the points.

    ``t_ns`` (k,) and ``points_laser_m`` (k, 3) are the times of the single points, and their places in the scanner's
    frame.
    """

    voxel_means_m: Array
    points_m: Array
    t_ns: NDArray[np.int64]
    points_laser_m: Array


@dataclass(frozen=True)
class LaserPoses:
    """Laser points with poses of the body in the pool frame: positions (n, 3), R (n, 3, 3); points_laser_m (n, 3)."""

    positions_m: Array
    R_pool_from_body: Array
    points_laser_m: Array


@dataclass(frozen=True)
class SoundingSample:
    """Soundings with poses of the body in the target frame: positions (n, 3), R (n, 3, 3); points_mbes_m (n, 3)."""

    positions_m: Array
    R_target_from_body: Array
    points_mbes_m: Array


def laser_sample(laser_pool: Stream, count: float, lowest_m: float) -> LaserSample:
    """Return the voxel means of about two million laser points, and about fifty thousand single points, at most.

    Parameters
    ----------
    laser_pool
        Laser points in the pool frame.
    count
        Number of points in the stream.
    lowest_m
        Height in the pool frame below which points do not count.
    """
    singles: list[Singles] = []

    def voxels() -> Iterator[Voxels]:
        for sums, of_batch in laser_pool.fold(_voxels_and_points, count, lowest_m):
            singles.append(of_batch)
            yield sums

    means = voxel_means(voxels())
    t_ns, points_m, points_laser_m = (np.concatenate(columns) for columns in zip(*singles, strict=True))
    return LaserSample(means, points_m, t_ns, points_laser_m)


def _voxels_and_points(batch: Batch, count: float, lowest_m: float) -> tuple[Voxels, Singles]:
    sample = sample_rows(batch, count / LASER_SAMPLE)
    singles = sample_rows(sample, count / RAW_SAMPLE)  # chosen by the same hash: a part of the sample
    voxels = voxel_sums(points_above(sample, "pool_m", lowest_m), VOXEL_M)
    dry = singles["z_pool_m"] >= lowest_m
    return voxels, (singles["t_ns"][dry], point_array(singles, "pool_m", dry), point_array(singles, "laser_m", dry))


def laser_poses(sample: LaserSample, trajectory: Trajectory) -> LaserPoses:
    """Return the single points in the scanner's frame, with the poses of the body.

    Parameters
    ----------
    sample
        Laser points.
    trajectory
        Poses of the body in the pool frame.
    """
    return LaserPoses(*trajectory.poses_at(sample.t_ns), sample.points_laser_m)


def scan_of(sample: LaserSample, trajectory: Trajectory, laser: Mounted) -> Scan:
    """Return the voxel means, and rays that the scanner sent, whether they came back or not; pool frame.

    A ray that does not come back leaves no record. But the scanner repeats its directions: in each of them from which a
    point came back at some time, it also looked at all other times. So each ray here has the origin of one point and
    the direction, in the scanner's frame, of another one.

    Parameters
    ----------
    sample
        Laser points.
    trajectory
        Poses of the body in the pool frame.
    laser
        Coarse mount of the laser.
    """
    points = len(sample.t_ns)
    origins, directions = np.random.default_rng(0).integers(0, max(1, points), (2, RAYS if points else 0))
    positions_m, R_pool_from_body = trajectory.poses_at(sample.t_ns[origins])
    body = sample.points_laser_m[directions] @ laser.R_body_from_sensor.T
    body /= np.linalg.norm(body, axis=1)[:, None]
    return Scan(
        points_m=sample.voxel_means_m,
        origins_m=positions_m + R_pool_from_body @ laser.lever_arm_body_m,
        directions=np.einsum("nij,nj->ni", R_pool_from_body, body),
    )


def sounding_sample(soundings_pool: Stream, count: float, trajectory: Trajectory) -> SoundingSample:
    """Return about eight thousand soundings at most, in the mbes frame, with the poses of the body.

    Parameters
    ----------
    soundings_pool
        Soundings in the pool frame.
    count
        Number of soundings in the stream.
    trajectory
        Poses of the body in the target frame.
    """
    pieces = list(soundings_pool.fold(sample_rows, count / SOUNDING_SAMPLE))
    t_ns = np.concatenate([piece["t_ns"] for piece in pieces])
    points = np.column_stack([np.concatenate([piece[f"{axis}_mbes_m"] for piece in pieces]) for axis in "xyz"])
    return SoundingSample(*trajectory.poses_at(t_ns), points)
