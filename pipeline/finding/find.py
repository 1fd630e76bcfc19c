"""From a session's INS and laser files to a place that can serve as a target."""

from dataclasses import replace

from pipeline.artefacts.streams import Stream
from pipeline.config.stage_settings import LaserPlacement
from pipeline.finding.dry_planes import dry_planes, reaching_water, water_level_m
from pipeline.finding.kept_points import kept_points, level_context
from pipeline.finding.place import FoundPlace, found_place
from pipeline.readers.track_tables import trajectory_table


def find_place(ins: Stream, laser: Stream, placement: LaserPlacement, depth_m: float) -> FoundPlace:
    """Return the target that a session's laser points show.

    Parameters
    ----------
    ins, laser : Stream
        Records of the INS, and points of the laser, as the readers give them.
    placement : LaserPlacement
        The laser's mount and frame.
    depth_m : float
        Depth below the water to which faces are continued.
    """
    track, _ = trajectory_table([batch for batch in ins.batches() if len(batch)])
    context = level_context(track)
    points = kept_points(laser, context, placement)
    planes = dry_planes(points.level_m, context.trajectory.positions_m.mean(axis=0))
    level_m = water_level_m(planes)
    place = found_place(reaching_water(planes, level_m), level_m, context.frame, depth_m)
    return replace(place, read=points.read, used=len(points))
