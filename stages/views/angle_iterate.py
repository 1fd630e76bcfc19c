"""The patent's angle iteration, step by step: soundings and normals turn towards the laser's planes."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.patent import ANGLES, ITERATIONS
from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.target import FACES, PLANES, SOUNDING_MOMENTS, SOUNDINGS_LABELLED, TARGET_POSE
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import laser_planes, rotation_vector_deg, trajectory_in_target
from pipeline.artefacts.streams import point_array
from pipeline.maths.geometry.planes import fit_plane
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.patent.lifted_moments import plane_moments
from pipeline.mount import mount_of
from pipeline.report.plane_agreement import lifted_moments_by_family
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from stages.views.fit_planes import faces_on_plane
from stages.views.recording import COLOURS, GREY, SONAR, log_curve, text_document

SOUNDINGS = 20_000  # most soundings in one step, all families together
STEPS = 60  # most steps that are shown
FAMILIES = ("P1", "P2", "P3")
ANGLE_COLOURS = dict(zip((*FAMILIES, "P4"), COLOURS.values(), strict=False))


def log(recording: Any, tables: Tables) -> None:
    """Log the patent's angle iteration step by step."""
    import rerun as rr

    faces, iterations = tables.table(FACES), tables.table(ITERATIONS)
    mount = mount_of(read_settings(tables.run).session.sonar.mount)
    trajectory = trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE))
    columns, step = tables.sample(
        SOUNDINGS_LABELLED, SOUNDINGS, "t_ns", "face", *(f"{axis}_mbes_m" for axis in "xyz")
    )
    positions, R_target_from_body = trajectory.poses_at(columns["t_ns"].astype(np.int64))
    body = point_array(columns, "mbes_m") @ mount.R_body_from_sensor.T
    family = faces["family"].to_numpy()[columns["face"].astype(int)]
    laser = laser_planes(tables.table(PLANES))
    lifted = lifted_moments_by_family(faces, tables.table(SOUNDING_MOMENTS))
    _curves(recording, iterations)
    log_reasons(recording, "angles", tables.table(ANGLES))
    for row in iterations.iloc[:: max(1, -(-len(iterations) // STEPS))].to_dict("records"):
        recording.set_time("iteration", sequence=int(row["iteration"]))
        correction = exp_so3(np.radians(rotation_vector_deg(row)))
        turned = body @ correction.T + mount.lever_arm_body_m
        points = (positions + np.einsum("nij,nj->ni", R_target_from_body, turned)).astype(np.float32)
        for name in FAMILIES:
            cloud = rr.Points3D(points[family == name], radii=0.01, colors=COLOURS[name])
            recording.log(f"iteration/soundings/{name}", cloud, rr.AnyValues(one_in=step))
        families = [name for name in FAMILIES if name in lifted and (ALL_PASSES, name) in laser]
        planes = {name: laser[(ALL_PASSES, name)] for name in families}
        sonar = {
            name: fit_plane(plane_moments(lifted[name], correction, mount.lever_arm_body_m), planes[name].normal)
            for name in families
        }
        for name in families:
            polygons = faces_on_plane(faces, name, sonar[name])
            outlines = [np.vstack([corners, corners[:1]]).astype(np.float32) for corners in polygons]
            recording.log(f"iteration/planes/{name}", rr.LineStrips3D(outlines, radii=0.008, colors=SONAR))
        for sensor, of_sensor, colour in (("laser", planes, GREY), ("mbes", sonar, SONAR)):
            centres = np.array([planes[name].centroid_m for name in families], dtype=np.float32).reshape(-1, 3)
            normals = np.array([of_sensor[name].normal for name in families], dtype=np.float32).reshape(-1, 3)
            arrows = rr.Arrows3D(origins=centres, vectors=normals, radii=0.02, colors=colour, labels=families)
            recording.log(f"iteration/normals/{sensor}", arrows)


def _curves(recording: Any, iterations: pd.DataFrame) -> None:
    import rerun as rr

    deviations = dict(zip(("roll", "pitch", "yaw"), COLOURS.values(), strict=False))
    for folder, stem, colours in (("deviation", "deviation", deviations), ("planes", "angle", ANGLE_COLOURS)):
        for name, colour in colours.items():
            column = f"{stem}_{name}_deg"
            if column in iterations:
                style = rr.SeriesLines(colors=colour, names=name)
                values = iterations[column].to_numpy()
                log_curve(recording, f"curves/{folder}/{name}", style, partial(iteration_column, iterations), values)


def log_reasons(recording: Any, quantity: str, result: pd.DataFrame) -> None:
    """Log as text why the patent's step has no result. The viewer reports an empty recording as broken.

    Parameters
    ----------
    recording
        The rerun recording stream.
    quantity
        The result of the step: angles or offsets.
    result
        The step's table, with a column ``reason``.
    """
    reasons = [reason for reason in dict.fromkeys(result["reason"]) if reason]
    if reasons:
        lines = "\n".join([f"No {quantity} by the patent's steps:", *reasons])
        recording.log(f"tables/{quantity}", text_document(lines), static=True)


def iteration_column(rows: pd.DataFrame) -> Any:
    """Return the numbers of the steps as a column of the timeline ``iteration``."""
    import rerun as rr

    return rr.TimeColumn("iteration", sequence=rows["iteration"].to_numpy())
