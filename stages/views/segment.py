"""Stage segment: the pool frame's transform, the target by design, and the labelled laser points by family."""

from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.target import FACES, LASER_LABELLED, TARGET_POSE
from pipeline.artefacts.from_tables import family_names, target_frame
from pipeline.artefacts.streams import point_array
from pipeline.results.pages.families import styles_of_families
from pipeline.run.results import Tables
from stages.views.recording import COLOURS, DOT_M, MOST_POINTS


def log(recording: Any, tables: Tables) -> None:
    """Log the transform of the pool frame, the target by design, and the labelled laser points."""
    import rerun as rr

    frame = target_frame(tables.table(TARGET_POSE))
    placed = rr.Transform3D(translation=frame.shift_m, mat3x3=frame.R_target_from_pool)
    recording.log("pool", placed, static=True)

    faces = tables.table(FACES)
    family_of = faces["family"].to_numpy()
    laser, step = tables.sample(
        LASER_LABELLED, MOST_POINTS, "face", *(f"{axis}_target_m" for axis in "xyz")
    )
    points, family = point_array(laser, "target_m").astype(np.float32), family_of[laser["face"].astype(int)]
    for name, colour in styles_of_families(family_names(faces), COLOURS).items():
        corners = [np.reshape(c, (-1, 3)) for c in faces.loc[family_of == name, "vertices_target_m"]]
        outlines = [np.vstack([one, one[:1]]).astype(np.float32) for one in corners]
        recording.log(f"target/model/{name}", rr.LineStrips3D(outlines, radii=0.008, colors=colour), static=True)
        cloud = rr.Points3D(points[family == name], radii=DOT_M, colors=colour)
        recording.log(f"target/laser/{name}", cloud, rr.AnyValues(one_in=step), static=True)
