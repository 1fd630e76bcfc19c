"""Samples of the points for the searches of the target's pose and of the mounts."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import Voxels, points_above, sample_rows, voxel_means, voxel_sums
from pipeline.artefacts.streams import Batch, Stream, point_array
from pipeline.maths.geometry.trajectory import Trajectory

Array = NDArray[np.float64]
VOXEL_M = 0.1  # laser points are averaged over cubes of this size
SOUNDING_SAMPLE = 8_000  # about this many soundings
LASER_SAMPLE = 2_000_000  # about this many laser points at most, which are averaged over voxels
RAW_SAMPLE = 50_000  # about this many of them at most, as single points


@dataclass(frozen=True)
class LaserSample:
    """Dry laser points in the pool frame: means over voxels (n, 3) m, and a sample of single points (k, 3) m.

    The search uses the means, because their density is even. They are biased if a face lies along the sides of voxels:
    the points before and behind the face then have separate means. So the pose is estimated from the points.
    """

    voxel_means_m: Array
    points_m: Array


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
    points: list[Array] = []

    def voxels() -> Iterator[Voxels]:
        for sums, points_of_batch in laser_pool.fold(_voxels_and_points, count, lowest_m):
            points.append(points_of_batch)
            yield sums

    return LaserSample(voxel_means(voxels()), np.concatenate(points))


def _voxels_and_points(batch: Batch, count: float, lowest_m: float) -> tuple[Voxels, Array]:
    sample = sample_rows(batch, count / LASER_SAMPLE)
    singles = sample_rows(sample, count / RAW_SAMPLE)  # chosen by the same hash: a part of the sample
    voxels = voxel_sums(points_above(sample, "pool_m", lowest_m), VOXEL_M)
    return voxels, points_above(singles, "pool_m", lowest_m)


def laser_poses(laser_pool: Stream, count: float, lowest_m: float, trajectory: Trajectory) -> LaserPoses:
    """Return about fifty thousand laser points at most, in the scanner's frame, with the poses of the body.

    Parameters
    ----------
    laser_pool
        Laser points in the pool frame.
    count
        Number of points in the stream.
    lowest_m
        Height in the pool frame below which points do not count.
    trajectory
        Poses of the body in the pool frame.
    """
    pieces = list(laser_pool.fold(_points_of_scanner, count / RAW_SAMPLE, lowest_m))
    t_ns, points = (np.concatenate([piece[k] for piece in pieces]) for k in range(2))
    return LaserPoses(*trajectory.poses_at(t_ns), points)


def _points_of_scanner(batch: Batch, one_in: float, lowest_m: float) -> tuple[NDArray[np.int64], Array]:
    sample = sample_rows(batch, one_in)
    dry = sample["z_pool_m"] >= lowest_m
    return sample["t_ns"][dry], point_array(sample, "laser_m", dry)


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
