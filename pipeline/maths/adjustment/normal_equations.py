"""The rigorous solution: both sensors observe the same planes, one weighted least squares for all parameters.

Observation: a point lies on its surface,

    v = n · (X - c) - shift,       X = p + T (Exp(ε) R x + l),

with p, T the body's pose in the target frame, n the family's normal and c a fixed point near the surface. Horizontal
faces are one family H, because they are parallel and their distances are known. X is reduced by the design height of
its face along their normal (X - h n), so that all lie in one plane. (On a target out of plumb X_z - h would be wrong by
h (1 - n_z).)

The pose is known except for white noise of each record and drift (:mod:`pipeline.maths.adjustment.pose_errors`). Both
sensors share these errors, so the laser's points on the same planes at the same instant determine them. An adjustment
that takes the trajectory, or the laser's planes, as true loses this information: under ordinary drift its yaw is wrong
by 0.1°.

Order: points -> sums by interval (:mod:`~pipeline.maths.adjustment.interval_sums`) -> white noise eliminated
(:mod:`~pipeline.maths.adjustment.eliminate_white_noise`) -> drift eliminated
(:mod:`~pipeline.maths.adjustment.eliminate_drift`) -> normal equations of the parameters
(:mod:`~pipeline.maths.adjustment.parameters`) -> solution (:mod:`~pipeline.maths.adjustment.solution`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.design_matrix import SensorOnSurface, parameter_design, pose_design
from pipeline.maths.adjustment.eliminate_drift import NormalEquations, eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import (
    LinearisedIntervals,
    ReducedGroups,
    ReducedIntervals,
    TimeAxis,
    eliminate_white_noise,
)
from pipeline.maths.adjustment.interval_sums import BLOCK, Intervals
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pose_errors import (
    DriftEstimate,
    Knots,
    PoseNoise,
)
from pipeline.maths.mount_parameters import N_MOUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Linearisation:
    """Interval sums by sensor, and the values at which their observations were taken.

    ``mapper``, like ``map``, spreads the elimination of the records' noise.
    """

    sums: Mapping[str, Intervals]
    state: State
    body: BodyMotion
    drift: DriftEstimate | None = None
    mapper: Callable[..., Iterable[Any]] = map

    def with_sums(self, sensor: str, sums: Intervals) -> "Linearisation":
        """Return this linearisation with other sums of one sensor."""
        return replace(self, sums={**self.sums, sensor: sums})

    def by_surface(self, selected: Integers | None = None) -> Iterator["SurfaceIntervals"]:
        """Yield each sensor's intervals, surface by surface; ``selected``: the parameters (ascending) of the design."""
        for sensor, sums in self.sums.items():
            for surface in range(len(self.state.surfaces)):
                rows = np.flatnonzero(sums.surface == surface)
                yield SurfaceIntervals(
                    linearisation=self,
                    sensor=sensor,
                    surface=surface,
                    rows=rows,
                    record=sums.record[rows],
                    selected=selected,
                )


@dataclass(frozen=True)
class SurfaceIntervals:
    """One sensor's intervals on one surface: their rows in its sums, and the last INS record before each.

    ``selected``: the parameters (ascending) of the design; None: all.
    """

    linearisation: Linearisation
    sensor: str
    surface: int
    rows: Integers
    record: Integers
    selected: Integers | None

    def linearised(self, rows: slice) -> LinearisedIntervals:
        """Return the intervals in these rows, with their designs."""
        state, body = self.linearisation.state, self.linearisation.body
        sums = self.linearisation.sums[self.sensor].selected(self.rows[rows])
        poses = body.poses(sums.record, sums.share, self.linearisation.drift)
        lever_arm_m, features = body.lever_arm(self.sensor, state), sums.normal.shape[1]
        design = parameter_design(state, SensorOnSurface(self.sensor, lever_arm_m, self.surface, features), poses)
        pose = pose_design(state.surfaces, np.array([self.surface]))[0]
        columns = state.columns(self.sensor, self.surface)
        if self.selected is None:
            return LinearisedIntervals(sums, design, columns, pose)
        kept = np.isin(columns, self.selected)
        return LinearisedIntervals(sums, design[:, :, kept], np.searchsorted(self.selected, columns[kept]), pose)


def normal_equations(linearisation: Linearisation, drift: DriftEstimate, noise: PoseNoise) -> NormalEquations:
    """Return the normal equations of all parameters.

    Parameters
    ----------
    linearisation : Linearisation
        Interval sums, and the values at which they were taken.
    drift : DriftEstimate
        The drift with which the observations were taken.
    noise : PoseNoise
        Standard deviations of the pose errors.
    """
    return eliminate_drift(reduced_intervals(linearisation, drift.knots, noise.white), noise, drift)


def reduced_intervals(
    linearisation: Linearisation, knots: Knots, white: Array, selected: Integers | None = None
) -> ReducedIntervals:
    """Return the normal equations of parameters and knots: they hold for any figures of the drift.

    Parameters
    ----------
    linearisation : Linearisation
        Interval sums, and the values at which they were taken.
    knots : Knots
        The knots of the drift.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    selected : (s,) array, optional
        Parameters, ascending; all by default.
    """
    return reduced_by_group(linearisation, knots, white, np.zeros(len(knots.inner), dtype=np.int64), selected).of([0])


def reduced_by_group(
    linearisation: Linearisation, knots: Knots, white: Array, group: Integers, selected: Integers | None = None
) -> ReducedGroups:
    """Return the normal equations of parameters and knots, with sums by group of spans.

    Parameters
    ----------
    linearisation, knots, white, selected
        As for :func:`reduced_intervals`.
    group : (k - 1,) array
        Number of the group of the span after each knot but the last, from 0.
    """
    sources = list(linearisation.by_surface(selected))
    n_parameters = linearisation.state.size if selected is None else len(selected)
    times = TimeAxis(linearisation.body.seconds, knots)
    return eliminate_white_noise(sources, n_parameters, times, white, group, linearisation.mapper)


def updated_sums(linearisation: Linearisation, step: Array, drift_step: DriftEstimate) -> dict[str, Intervals]:
    """Return the sums after a step of the parameters and of the drift, without reading the points again.

    Parameters
    ----------
    linearisation : Linearisation
        Interval sums, and the values at which they were taken.
    step : (u,) array
        Step of all parameters.
    drift_step : DriftEstimate
        Step of the drift at its knots.
    """
    changes = {sensor: np.zeros((len(sums), sums.features)) for sensor, sums in linearisation.sums.items()}
    for source in linearisation.by_surface():
        for start in range(0, len(source.rows), BLOCK):
            block = slice(start, start + BLOCK)
            intervals = source.linearised(block)
            change = intervals.design @ step[intervals.columns]
            times = linearisation.body.times(intervals.sums.record, intervals.sums.share)
            change[:, : len(intervals.pose)] += drift_step.at(times) @ intervals.pose.T
            changes[source.sensor][source.rows[block]] = change
    return {sensor: sums.shifted(changes[sensor]) for sensor, sums in linearisation.sums.items()}


def mount_step(linearisation: Linearisation, sensor: str) -> Array:
    """Return the step (u,) of a sensor's mount that brings its points onto the current surfaces, poses being true.

    It leads from a coarse mount to one near enough for the adjustment. The step is of first order, so that errors of
    degrees need a few steps. The sums are those of this sensor alone.
    """
    mount = linearisation.state.mount_columns(sensor)
    normal, right = np.zeros((N_MOUNT, N_MOUNT)), np.zeros(N_MOUNT)
    for source in linearisation.by_surface():
        for start in range(0, len(source.rows), BLOCK):
            intervals = source.linearised(slice(start, start + BLOCK))
            design = intervals.design[:, :, np.isin(intervals.columns, mount)]
            normal += np.einsum("gfi,gfh,ghj->ij", design, intervals.sums.normal, design, optimize=True)
            right += np.einsum("gfi,gf->i", design, intervals.sums.right)
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    step = np.zeros(linearisation.state.size)
    step[mount] = -scale * np.linalg.lstsq(normal * np.outer(scale, scale), scale * right, rcond=1e-9)[0]
    return step


@dataclass(frozen=True)
class RecordErrors:
    """INS records (r,), ascending, and the pose error (r, 6), m and rad, in the middle of the interval after each."""

    record: Integers
    error: Array


def residual_shift(state: State, sensor: str, body: BodyMotion, errors: RecordErrors, features: int) -> Array:
    """Return the change of v by drift and additional parameters: its factors (r, s, F) of q, by record and surface.

    Parameters
    ----------
    state : State
        Current values; the additional ones change v.
    sensor : str
        The sensor that observes.
    body : BodyMotion
        The motion of the body.
    errors : RecordErrors
        Records, and the drift after each.
    features : int
        Number F of the sensor's features.
    """
    shift = np.zeros((len(errors.record), len(state.surfaces), features))
    values, lever_arm_m = state.additional_values(), body.lever_arm(sensor, state)
    for surface in range(len(state.surfaces)):
        pose = pose_design(state.surfaces, np.array([surface]))[0]
        shift[:, surface, : len(pose)] = errors.error @ pose.T
        additional = values[state.columns(sensor, surface)]
        if np.any(additional):
            poses = body.poses(errors.record, np.full(len(errors.record), 0.5), None)
            observed = SensorOnSurface(sensor, lever_arm_m, surface, features)
            shift[:, surface] += parameter_design(state, observed, poses) @ additional
    return shift
