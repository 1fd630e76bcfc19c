"""Stage georeference: the track of each pass, and the points near the target, in the pool frame."""

from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.points import LASER_POOL, PASSES, POSES, SOUNDINGS_POOL
from pipeline.artefacts.streams import point_array
from pipeline.maths.geometry.passes import pass_of
from pipeline.run.results import Tables
from stages.views.recording import DOT_M, GREY, MOST_POINTS, SONAR

TRACK_POINTS = 2000  # a long pass has one to two times this number


def log(recording: Any, tables: Tables) -> None:
    """Log the tracks of the passes and the points near the target."""
    import rerun as rr

    poses, passes = tables.table(POSES), tables.table(PASSES)
    number = pass_of(*(column.to_numpy() for column in (poses["t_ns"], passes["start_ns"], passes["end_ns"])))
    track = poses[["x_pool_m", "y_pool_m", "z_pool_m"]].to_numpy()
    for pass_number in passes["pass"].tolist():
        points = track[number == pass_number]
        points = points[:: max(1, len(points) // TRACK_POINTS)]
        if len(points):
            line = rr.LineStrips3D([points.astype(np.float32)], radii=0.02, colors=GREY)
            recording.log(f"pool/trajectory/pass_{pass_number}", line, static=True)
    for name, artefact, colour in (
        ("laser", LASER_POOL, GREY),
        ("soundings", SOUNDINGS_POOL, SONAR),
    ):
        columns, step = tables.sample(artefact, MOST_POINTS, *(f"{axis}_pool_m" for axis in "xyz"))
        cloud = rr.Points3D(point_array(columns, "pool_m").astype(np.float32), radii=DOT_M, colors=colour)
        recording.log(f"pool/{name}", cloud, rr.AnyValues(one_in=step), static=True)
