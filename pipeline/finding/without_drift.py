"""The boat's track without the INS's drift, which planes show that the laser sees again and again.

Over a minute the position of an INS wanders by a centimetre or two. The laser sees the parts of a narrow wall one after
the other, so that such a drift turns its plane by half a degree. So points on the planes found first are adjusted.
Planes and drift are unknown, as in a calibration; no mount is.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.problem import CalibrationProblem, PointNoise, PriorInformation, sensor_sigmas
from pipeline.adjustment.weighted_iteration import weighted_iteration
from pipeline.artefacts.streams import Batch, Mapper, MemoryPart, Stream, serial
from pipeline.config.pool import Adjust, Ingest
from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.kept_points import KeptPoints
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.geometry.trajectory import NS_PER_S, Trajectory
from pipeline.maths.surfaces.flatness import plane_axes
from pipeline.maths.surfaces.outline import inside
from pipeline.mount import Mounted

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
MOST, MOST_RECORDS = 200_000, 15_000  # points that are adjusted; INS records after which they lie, if that is enough
BURST, APART_S = 50, 3.0  # records that are used together, for neighbours show their white noise; longest time without
READINGS = 3  # of these points, for weights and scales: the planes are found anew along the track, and need not settle
GATE_M = 0.1  # of a point from its plane: the drift, and the plane's own error


def track_without_drift(
    points: KeptPoints,
    planes: Sequence[DryPlane],
    mount: Mounted,
    sigmas: PointNoise,
    noise: PoseNoise,
    mapper: Mapper = serial,
) -> Trajectory:
    """Return the trajectory, corrected by the drift; as it is if the points do not show it.

    Parameters
    ----------
    points : KeptPoints
        The laser's points.
    planes : sequence of DryPlane
        Planes among them, frame of the points.
    mount : Mounted
        The laser's mount.
    sigmas : PointNoise
        Its noise.
    noise : PoseNoise
        The errors of the INS.
    mapper : Mapper, optional
        Spreads the work on the memory of this process.
    """
    trajectory = points.context.trajectory
    batch = _points_on(planes, points)
    if not len(batch["t_ns"]):
        return trajectory
    problem = replace(_problem(planes, trajectory, mount, sigmas, noise), mapper=mapper)
    stream = Stream((MemoryPart("laser", batch),))
    adjusted = weighted_iteration(problem, {"laser": stream}, Adjust(max_iterations=READINGS), Ingest().max_gap_s)
    return trajectory if adjusted.deficient else adjusted.last.drift.corrected(trajectory)


def _points_on(planes: Sequence[DryPlane], points: KeptPoints) -> Batch:
    """Return columns of the points on the planes, each on the nearest, within the outlines."""
    rows = _fewer(points)
    level_m = points.level_m[rows]
    face, nearest = np.full(len(rows), -1, dtype=np.int16), np.full(len(rows), GATE_M)
    for k, plane in enumerate(planes):
        away = np.abs(level_m @ plane.normal - plane.distance_m)
        near = np.flatnonzero(away < nearest)
        near = near[inside(plane.outline_m, level_m[near] @ plane_axes(plane.normal).T)]
        face[near], nearest[near] = k, away[near]
    used = np.flatnonzero(face >= 0)
    columns: dict[str, np.ndarray] = {"t_ns": points.t_ns[rows[used]], "face": face[used]}
    columns["edge_weight"] = np.ones(len(used))
    for frame, places in (("laser", points.own_m[rows[used]]), ("target", level_m[used])):
        columns |= {f"{axis}_{frame}_m": places[:, k] for k, axis in enumerate("xyz")}
    return columns


def _fewer(points: KeptPoints) -> Integers:
    """Return the rows (k,) of the points to adjust: of a long session those of some bursts of records, evenly spread.

    Each record with points costs as much as a hundred points; the drift of a second needs no more than a few dozen.
    """
    trajectory = points.context.trajectory
    record, _ = trajectory.interval_of(points.t_ns)
    _, burst = np.unique(record // BURST, return_inverse=True)
    burst_s = BURST * float(np.median(np.diff(trajectory.t_ns))) / NS_PER_S
    every = min(-(-len(np.unique(record)) // MOST_RECORDS), int(APART_S / burst_s))
    rows = np.flatnonzero(burst % max(1, every) == 0)
    return rows[:: max(1, -(-len(rows) // MOST))]


def _problem(
    planes: Sequence[DryPlane], trajectory: Trajectory, mount: Mounted, sigmas: PointNoise, noise: PoseNoise
) -> CalibrationProblem:
    surfaces = tuple(
        ObservedSurface.at(f"plane-{k}", plane.normal, plane.corners_m(plane.outline_m).mean(axis=0))
        for k, plane in enumerate(planes)
    )
    state = State.at(np.eye(3), np.zeros(3), surfaces, "mbes")  # of a sonar that sees nothing here
    numbers = np.arange(len(planes))
    model = ObservationModel(
        body=BodyMotion.of(trajectory, mount.lever_arm_body_m),
        faces=Faces(tuple(surface.family for surface in surfaces), numbers, np.ones(len(planes))),
        height_of_face=np.zeros(len(planes)),
        coarse=state,
        sigmas={"laser": sensor_sigmas(sigmas)},
        wet_heights_m=(-1.0, 0.0),
    )
    return CalibrationProblem(model, PriorInformation(noise), ConsiderErrors(np.zeros(state.size)))
