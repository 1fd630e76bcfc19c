"""The iteration, step by step: soundings swing from the coarse mount towards the laser's planes, normals close."""

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
from pipeline.report.plane_agreement import families_of
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from stages.views.fit_planes import cut_out
from stages.views.recording import COLOURS, GREY, SONAR, curve, words

SOUNDINGS = 20_000  # for all the family's points of one step
STEPS = 60  # that are replayed
FAMILIES = ("P1", "P2", "P3")
ANGLE_COLOURS = dict(zip((*FAMILIES, "P4"), COLOURS.values(), strict=False))


def log(recording: Any, tables: Tables) -> None:
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
    lifted = families_of(faces, tables.table(SOUNDING_MOMENTS))
    _curves(recording, iterations)
    say_why(recording, "angles", tables.table(ANGLES))
    for row in iterations.iloc[:: max(1, -(-len(iterations) // STEPS))].to_dict("records"):
        recording.set_time("iteration", sequence=int(row["iteration"]))
        correction = exp_so3(np.radians(rotation_vector_deg(row)))
        turned = body @ correction.T + mount.lever_arm_body_m
        points = (positions + np.einsum("nij,nj->ni", R_target_from_body, turned)).astype(np.float32)
        for name in FAMILIES:
            cloud = rr.Points3D(points[family == name], radii=0.01, colors=COLOURS[name])
            recording.log(f"iteration/soundings/{name}", cloud, rr.AnyValues(one_in=step))
        seen = [name for name in FAMILIES if name in lifted and (ALL_PASSES, name) in laser]
        planes = {name: laser[(ALL_PASSES, name)] for name in seen}
        sonar = {
            name: fit_plane(plane_moments(lifted[name], correction, mount.lever_arm_body_m), planes[name].normal)
            for name in seen
        }
        for name in seen:
            outlines = [np.vstack([one, one[:1]]).astype(np.float32) for one in cut_out(faces, name, sonar[name])]
            recording.log(f"iteration/planes/{name}", rr.LineStrips3D(outlines, radii=0.008, colors=SONAR))
        for sensor, found, colour in (("laser", planes, GREY), ("mbes", sonar, SONAR)):
            centres = np.array([planes[name].centroid_m for name in seen], dtype=np.float32).reshape(-1, 3)
            normals = np.array([found[name].normal for name in seen], dtype=np.float32).reshape(-1, 3)
            arrows = rr.Arrows3D(origins=centres, vectors=normals, radii=0.02, colors=colour, labels=seen)
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
                curve(recording, f"curves/{folder}/{name}", style, partial(steps_of, iterations), values)


def say_why(recording: Any, what: str, result: pd.DataFrame) -> None:
    """In words why the patent's step has none; a recording with nothing at all the viewer calls broken."""
    reasons = [reason for reason in dict.fromkeys(result["reason"]) if reason]
    if reasons:
        said = "\n".join([f"No {what} by the patent's steps:", *reasons])
        recording.log(f"tables/{what}", words(said), static=True)


def steps_of(rows: pd.DataFrame) -> Any:
    """The timeline ``iteration``."""
    import rerun as rr

    return rr.TimeColumn("iteration", sequence=rows["iteration"].to_numpy())
