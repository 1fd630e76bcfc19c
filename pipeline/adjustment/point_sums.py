"""Sums of one batch of labelled points by compiled loops: intervals, and statistics of the observations.

The same as :meth:`~pipeline.adjustment.observation_model.ObservationModel.linearise`, weights and
:func:`~pipeline.maths.adjustment.interval_sums.interval_sums` one after the other give, in one pass over the points:
:mod:`pipeline.maths.kernels.laser_sums` and :mod:`~pipeline.maths.kernels.sounding_sums`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import N_FEATURES, CurrentValues, ObservationModel
from pipeline.artefacts.streams import Batch
from pipeline.maths.adjustment.interval_sums import N_MOVED, IntervalSums, Runs
from pipeline.maths.adjustment.normal_equations import residual_shift
from pipeline.maths.adjustment.parameters import State, kind_of
from pipeline.maths.adjustment.robust_weights import BINS
from pipeline.maths.adjustment.weighting import Weighting
from pipeline.maths.kernels.interval_group import (
    FIRST_BIN,
    OBSERVED,
    Noise,
    Points,
    Records,
    Sums,
    Surfaces,
    group_scratch,
)
from pipeline.maths.kernels.interval_slots import slots_of
from pipeline.maths.kernels.laser_sums import LaserPoses, sum_laser_points
from pipeline.maths.kernels.sounding_sums import SonarPoses, sum_soundings

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
COLUMNS = {  # of the labelled points that the sums need, by kind of sensor
    "laser": ("t_ns", "face", *(f"{axis}_{frame}_m" for frame in ("laser", "target") for axis in "xyz"), "edge_weight"),
    "mbes": ("t_ns", "face", *(f"{axis}_mbes_m" for axis in "xyz"), "edge_weight"),
}


@dataclass(frozen=True)
class SummedBatch:
    """Sums of the intervals (not ordered), and of each surface (s, 4 + bins) the columns of ``interval_group``.

    points: the batch in order of time; record, share (n,): INS record before each, and place from there to the next;
    surface (n,): its surface; observed (6, n): rows of ``interval_group.OBSERVED``, or (6, 0).
    """

    sums: IntervalSums
    statistics: Array
    points: Batch
    record: Integers
    share: Array
    surface: Integers
    observed: Array


@dataclass(frozen=True)
class _Slots:
    """Of each point (n,): INS record before it, place to the next, slot. Of each slot (g,): record and surface."""

    record: Integers
    share: Array
    slot: Integers
    record_of: Integers
    surface_of: Integers

    @classmethod
    def of(cls, t_ns: Integers, surface: Integers, record_ns: Integers, surfaces: int) -> "_Slots":
        record, slot, record_of, surface_of = np.empty((4, len(t_ns)), dtype=np.int64)
        t_ns, record_ns = (np.require(times, np.int64, ("C", "W")) for times in (t_ns, record_ns))
        share = np.empty(len(t_ns))
        last = np.empty(surfaces, dtype=np.int64)
        number = slots_of(t_ns, surface, record_ns, record, share, slot, record_of, surface_of, last)
        return cls(record, share, slot, record_of[:number].copy(), surface_of[:number].copy())  # views would keep all


def summed(
    batch: Batch, model: ObservationModel, sensor: str, values: CurrentValues, residuals: bool = False
) -> SummedBatch:
    """Return the sums of a batch at the current values.

    Parameters
    ----------
    batch : Batch
        Columns of n labelled points.
    model : ObservationModel
        Model that turns points into observations.
    sensor : str
        The sensor that observed the points: the laser, or a head of the sonar.
    values : CurrentValues
        Parameters, drift and weights at which to linearise.
    residuals : bool
        Whether to return the residual of each point, and the sums of each interval and face, with the number of the
        face in place of that of its surface.
    """
    points, state, features = _in_order_of_time(batch), values.state, N_FEATURES[kind_of(sensor)]
    surface = model.faces.surface[points["face"]].astype(np.int64)
    surfaces = len(state.surfaces)
    apart = points["face"].astype(np.int64) if residuals else surface
    slots = _Slots.of(points["t_ns"], apart, model.body.trajectory.t_ns, max(surfaces, len(model.faces.names)))
    of_record = Runs.of(slots.record)
    errors = model.pose_errors(values.drift, slots.record[of_record.starts])
    of_points = Points(
        place_m=_laser_places(points, model, state) if sensor == "laser" else _axes(points, "mbes_m"),
        edge=_line(points["edge_weight"]),
        surface=surface,
        height_m=_line(model.height_of_face[points["face"]]),
        record=np.repeat(np.arange(len(errors.record)), of_record.lengths),
        share=slots.share,
        slot=slots.slot,
    )
    of_records = Records(
        _line(errors.error[:, N_MOVED:]), _line(residual_shift(state, sensor, model.body, errors, features))
    )
    of_surfaces = Surfaces(
        np.array([[*surface.tangents, surface.normal] for surface in state.surfaces]),
        np.array([surface.distance_m for surface in state.surfaces]),
    )
    noise = _noise(model, sensor, values.weighting, surfaces)
    sums = _empty_sums(len(slots.record_of), surfaces, features, len(surface) if residuals else 0)
    memory = group_scratch(int(of_record.lengths.max(initial=1)), surfaces, features)
    if sensor == "laser":
        poses = _laser_poses(points, model, state, errors.record)
        sum_laser_points(of_points, poses, of_records, of_surfaces, noise, sums, memory)
    else:
        pings = _sonar_poses(points, model, state, sensor)
        sum_soundings(of_points, pings, of_records, of_surfaces, noise, sums, memory)
    return SummedBatch(
        sums=_interval_sums(slots, sums),
        statistics=sums.statistics,
        points=points,
        record=slots.record,
        share=slots.share,
        surface=surface,
        observed=sums.observed,
    )


def _laser_places(points: Batch, model: ObservationModel, state: State) -> Array:
    """Return the laser's points (3, n) in the target frame; with the mount of the state if it is calibrated."""
    if state.calibrated == "laser":
        return _line(model.points_in_target("laser", points, state).T)
    return _axes(points, "target_m")


def _laser_poses(points: Batch, model: ObservationModel, state: State, record: Integers) -> LaserPoses:
    trajectory, own = model.body.trajectory, _axes(points, "laser_m")
    return LaserPoses(
        range_m=np.sqrt(own[0] ** 2 + own[1] ** 2 + own[2] ** 2),
        position_m=_line(trajectory.positions_m[record[:, None] + np.arange(2)]),
        lever_arm_m=_line(trajectory.R_frame_from_body[record] @ model.body.lever_arm("laser", state)),
    )


def _sonar_poses(points: Batch, model: ObservationModel, state: State, sensor: str) -> SonarPoses:
    R_body_from_mbes, lever_arm_m = state.mount_of(sensor)
    pings = Runs.of(points["t_ns"])  # beams of a ping share their pose
    positions, R_target_from_body = model.body.trajectory.poses_at(points["t_ns"][pings.starts])
    return SonarPoses(
        ping=np.repeat(np.arange(len(pings.starts)), pings.lengths),
        position_m=_line(positions),
        R_target_from_mbes=_line(R_target_from_body @ R_body_from_mbes),
        lever_arm_m=_line(R_target_from_body @ lever_arm_m),
        wet_m=np.array(model.wet_heights_m, dtype=np.float64),
    )


def _noise(model: ObservationModel, sensor: str, weighting: Weighting, surfaces: int) -> Noise:
    numbers, sigmas = np.arange(surfaces), model.sigmas[sensor]
    k0, k1 = weighting.robust or (np.inf, np.inf)
    return Noise(
        factor=_line(weighting.factors_of(sensor, numbers)),
        edge_share=_line(weighting.edge_shares_of(sensor, numbers)),
        scale=_line(weighting.scales.get(sensor, np.ones(surfaces))),
        k0=float(k0),
        k1=float(k1),
        white=_line(weighting.white),
        bin_width=float(BINS[1]),
        range_m=float(sigmas.range_m),
        angle_rad=float(sigmas.angle_rad),
    )


def _empty_sums(slots: int, surfaces: int, features: int, observed: int) -> Sums:
    return Sums(
        statistics=np.zeros((surfaces, FIRST_BIN + len(BINS) - 1)),
        normal=np.zeros((slots, features, features)),
        swept=np.zeros((slots, N_MOVED, features)),
        swept_twice=np.zeros((slots, N_MOVED, N_MOVED)),
        right=np.zeros((slots, features)),
        right_swept=np.zeros((slots, N_MOVED)),
        scalars=np.zeros((slots, 3)),
        observed=np.empty((len(OBSERVED), observed)),
    )


def _in_order_of_time(batch: Batch) -> Batch:
    t_ns = batch["t_ns"]
    if np.all(t_ns[1:] >= t_ns[:-1]):
        return batch
    order = np.argsort(t_ns, kind="stable")
    return {name: column[order] for name, column in batch.items()}


def _line(values: NDArray[np.generic]) -> Array:
    """Return values as one block of memory that may be written, as compiled loops ask for."""
    return np.require(values, np.float64, ("C", "W"))


def _axes(points: Batch, suffix: str) -> Array:
    """Return points (3, n), axis by axis."""
    return np.array([points[f"{axis}_{suffix}"] for axis in "xyz"], dtype=np.float64)


def _interval_sums(slots: _Slots, sums: Sums) -> IntervalSums:
    intervals = IntervalSums(
        record=slots.record_of,
        surface=slots.surface_of,
        normal=sums.normal,
        swept=sums.swept,
        swept_twice=sums.swept_twice,
        right=sums.right,
        right_swept=sums.right_swept,
        squares=sums.scalars[:, 0],
        count=sums.scalars[:, 1],
        squared_count=sums.scalars[:, 2],
    )
    used = sums.normal[:, 0, 0] > 0
    return intervals if used.all() else intervals.selected(np.flatnonzero(used))
