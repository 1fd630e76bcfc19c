"""From a session's INS and laser files to a place that can serve as a target."""

from dataclasses import replace

from pipeline.artefacts.streams import Stream
from pipeline.config.session import SessionConfig
from pipeline.config.stage_settings import LaserPlacement, LaserPoints, narrow
from pipeline.finding.dry_planes import dry_planes, reaching_water, water_level_m
from pipeline.finding.kept_points import kept_points, level_context
from pipeline.finding.place import FoundPlace, found_place
from pipeline.finding.reading import noise_over_all, read_files
from pipeline.finding.without_drift import track_without_drift
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import mount_of

TRACK = 2000  # places of the boat that are kept for pictures
PROVISIONAL = 150_000  # points of the planes that the drift is taken from


def find_place(ins: Stream, laser: Stream, session: SessionConfig, depth_m: float) -> FoundPlace:
    """Return the target that a session's laser points show.

    Parameters
    ----------
    ins, laser : Stream
        Records of the INS, and points of the laser, as the readers give them.
    session : SessionConfig
        The session's settings.
    depth_m : float
        Depth below the water to which faces are continued.
    """
    records, sigmas, drawn = read_files(ins, laser)
    context, mount = level_context(records), mount_of(session.laser.mount)
    _load(context.trajectory)
    points = kept_points(drawn, context, narrow(LaserPlacement, session.laser))
    boat_m = context.trajectory.positions_m.mean(axis=0)
    some = points.level_m[:: max(1, len(points) // PROVISIONAL)]
    serving = [plane for plane in dry_planes(some, boat_m, laser.here) if not plane.refused]
    noise = noise_over_all(session.ins, sigmas, records["t_ns"].to_numpy())
    trajectory = track_without_drift(points, serving, mount, narrow(LaserPoints, session.laser), noise, laser.here)
    planes = dry_planes(points.along(trajectory, mount).level_m, boat_m, laser.here)
    level_m = water_level_m(planes)
    place = found_place(reaching_water(planes, level_m), level_m, context.frame, depth_m)
    track = trajectory.positions_m[:: max(1, len(trajectory.positions_m) // TRACK), :2]
    boat = float(boat_m[0]), float(boat_m[1])
    return replace(place, read=points.read, used=len(points), boat_m=boat, track_m=track)


def _load(trajectory: Trajectory) -> None:
    """Load, while workers unpack points, what is used afterwards: two libraries and machine code, a second's work."""
    import scipy.linalg
    import scipy.spatial  # noqa: F401  loaded for those that use it later

    trajectory.poses_at(trajectory.t_ns[:1])
