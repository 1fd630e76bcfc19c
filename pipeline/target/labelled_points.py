"""Points of both sensors labelled by the faces of the target, batch by batch."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch, BatchResult, point_array
from pipeline.artefacts.to_tables import xyz_columns
from pipeline.config.pool import Segment
from pipeline.config.stage_settings import SonarBeams
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import Labels, label_points, near_planes, weight_beside_shadows
from pipeline.maths.target.model import TargetModel
from pipeline.mount import Mounted, mount_of
from pipeline.target.label_limits import laser_limits, sonar_limits
from pipeline.target.search_results import LocatedTarget, ProvisionalMount
from pipeline.target.sonar_beams import beams_in_target
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
Labelled = tuple[Batch, dict[str, int]]  # rows of the stream of labelled points, and the number of points by reason


@dataclass(frozen=True)
class LabellingContext:
    """Inputs of labelling that are the same for all points.

    Parameters
    ----------
    model, surface
        The target by design, and the search for points on its surface.
    target
        The pose of the target.
    mount
        Provisional mount of the sensor that is calibrated.
    water
        Table water_levels.
    trajectory, corrected
        Poses of the body in the target frame, as recorded, and without the drift of the INS as far as it is known.
    laser, laser_beam_m
        Coarse mount of the laser, and the diameter of its beam at the target.
    mbes
        The sonar's coarse mount and beams; None: the laser is calibrated.
    settings
        Settings of stage segment.
    """

    model: TargetModel
    surface: ClosestSurface
    target: LocatedTarget
    mount: ProvisionalMount
    trajectory: Trajectory
    corrected: Trajectory
    water: pd.DataFrame
    laser: Mounted
    laser_beam_m: float
    mbes: SonarBeams | None
    settings: Segment

    @property
    def coarse_mount(self) -> Mounted:
        """The coarse mount of the sensor that is calibrated."""
        return self.laser if self.mbes is None else mount_of(self.mbes.mount)

    @property
    def provisional_mount(self) -> Mounted:
        """The provisional mount of the sensor that is calibrated."""
        return self.mount.total(self.coarse_mount)


def label_batch(source: str, batch: Batch, context: LabellingContext) -> BatchResult:
    """Label the points of one batch.

    The corrected poses place the points and their rays for the labels. The stored points have the recorded poses,
    because the adjustment estimates the drift itself.

    Parameters
    ----------
    source
        Stream of the points: "laser_pool" or "soundings_pool".
    batch
        Points in the frame of their sensor, and in the pool frame.
    context
        Target, mounts and poses.

    Returns
    -------
    BatchResult
        Rows of the stream of labelled points, and the number of points by reason.
    """
    if source == "laser_pool":
        stream, label = "laser_labelled", partial(_label_laser, context=context)
    elif context.mbes is None:
        raise TypeError("soundings without a sonar")
    else:
        stream, label = "soundings_labelled", partial(_label_soundings, context=context, mbes=context.mbes)
    levels_m = context.water["level_m"].to_numpy()[batch["pass"]]
    starts = np.flatnonzero(np.diff(levels_m)) + 1  # the water's level is another from there on
    pieces = [
        label({name: column[low:high] for name, column in batch.items()}, float(levels_m[low]) if high else 0.0)
        for low, high in pairwise([0, *starts.tolist(), len(levels_m)])
    ]
    if len(pieces) == 1:
        return BatchResult({stream: pieces[0][0]}, pieces[0][1])
    columns = {name: np.concatenate([rows[name] for rows, _ in pieces]) for name in pieces[0][0]}
    counts: Counter[str] = Counter()
    for _, of_piece in pieces:
        counts.update(of_piece)
    return BatchResult({stream: columns}, dict(counts))


def _label_laser(batch: Batch, level_m: float, context: LabellingContext) -> Labelled:
    model = context.model
    mount = context.laser if context.mbes is not None else context.provisional_mount
    settings = laser_limits(context.settings, level_m, context.target.gate_m, context.laser_beam_m)
    R_body_from_laser, lever_arm_m = mount.R_body_from_sensor, mount.lever_arm_body_m
    sensor = point_array(batch, "laser_m")
    points = context.corrected.points_from_sensor(batch["t_ns"], sensor, R_body_from_laser, lever_arm_m)
    dry = points[:, 2] > level_m + context.settings.water_margin_m / 2
    near = np.flatnonzero(near_planes(model, points, settings.gate_m, dry, settings.seen))
    points = points[near]
    rays = TargetBeams.from_origins(context.corrected.track_of_point(batch["t_ns"][near], lever_arm_m), points)
    labels = label_points(model, points, rays, settings)
    on = np.flatnonzero(labels.face >= 0)
    rows = near[on]
    t_ns = batch["t_ns"][rows]
    placed = context.trajectory.points_from_sensor(t_ns, sensor[rows], R_body_from_laser, lever_arm_m)
    columns = {"t_ns": t_ns, "pass": batch["pass"][rows], "face": labels.face[on]}
    columns |= xyz_columns("{}_laser_m", [batch[f"{axis}_laser_m"][rows] for axis in "xyz"])
    columns |= xyz_columns("{}_target_m", placed.T)
    columns["cos_incidence"], columns["edge_weight"] = labels.cos_incidence[on], labels.edge_weight[on]
    return columns, _counts("below or near the water line", dry, len(near), "near an edge", labels)


def _label_soundings(batch: Batch, level_m: float, context: LabellingContext, mbes: SonarBeams) -> Labelled:
    model, mount, trajectory = context.model, context.provisional_mount, context.corrected
    lever_arm_m = mount.lever_arm_body_m
    sensor = point_array(batch, "mbes_m")
    points = trajectory.points_from_sensor(batch["t_ns"], sensor, mount.R_body_from_sensor, lever_arm_m)
    settings = sonar_limits(context.settings, level_m, context.mount.gate_m)
    wet = points[:, 2] < level_m - context.settings.water_margin_m / 2
    near = np.flatnonzero(near_planes(model, points, settings.gate_m, wet, settings.seen))
    _, R_target_from_body = trajectory.poses_at(batch["t_ns"][near])
    beams = beams_in_target(R_target_from_body, mount.R_body_from_sensor, sensor[near], mbes)
    labels = label_points(model, points[near], beams, settings)
    on = np.flatnonzero(labels.face >= 0)
    origins = trajectory.track_of_point(batch["t_ns"][near[on]], lever_arm_m)
    on_faces = _BeamsOnFaces(labels.face[on], on, beams, origins, context.surface)
    weight = weight_beside_shadows(model, on_faces, settings.ramp_m)
    seen, hidden = weight > 0, int((weight == 0).sum())
    on, weight = on[seen], np.minimum(weight[seen], labels.edge_weight[on[seen]])
    rows = near[on]
    names = ("t_ns", "pass", "ping", "beam", "x_mbes_m", "y_mbes_m", "z_mbes_m")
    columns = {name: batch[name][rows] for name in names} | {"face": labels.face[on], "edge_weight": weight}
    counts = _counts("above or near the water line", wet, len(near), "footprint near an edge", labels)
    counts |= {"footprint partly on another face": hidden, "used": len(on)}
    return columns, counts


@dataclass(frozen=True)
class _BeamsOnFaces:
    """Beams with a face each: their faces (n,), their rows (n,) among ``beams``, and the sonar's positions (n, 3)."""

    faces: NDArray[np.int16]
    beam: NDArray[np.int64]
    beams: TargetBeams
    origins_m: Array
    surface: ClosestSurface

    def faces_at_corners(self, rows: NDArray[np.int64], beyond_m: float) -> Iterator[NDArray[np.int64]]:
        """Yield the numbers of the faces that rays along the corners meet first."""
        for rays in self.beams.corners(self.beam[rows], beyond_m):
            yield self.surface.first_met(self.origins_m[rows], rays)


def _counts(other_side: str, own_side: NDArray[np.bool_], near: int, edge: str, labels: Labels) -> dict[str, int]:
    """Return the number of points by reason why they have no label, and the labelled ones as ``used``.

    ``near``: the number of those on their own side of the water that lie near a plane; ``labels`` are theirs.
    """
    return {
        other_side: int((~own_side).sum()),
        "off every face": int(own_side.sum()) - near + int(labels.off_surface.sum()),
        edge: int(labels.near_edge.sum()),
        "ray too flat": int(labels.grazing.sum()),
        "used": int((labels.face >= 0).sum()),
    } | ({"masked": int(labels.masked.sum())} if labels.masked.any() else {})
