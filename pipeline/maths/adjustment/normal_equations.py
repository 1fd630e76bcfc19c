"""The rigorous solution: both sensors observe the same planes, one weighted least squares for all unknowns.

Observation: a point lies on its surface,

    v = n · (X - c) - shift,       X = p + T (Exp(ε) R x + l),

with p, T the body's pose in the target frame, n the family's normal and c a fixed point near the surface. Horizontal
faces are one family H: X is reduced by the design height of its face along their normal (X - h n), so that all are one
plane: they are parallel and their distances known. (On a target out of plumb X_z - h would be wrong by h (1 - n_z).)

The pose is known but for white noise of each record and drift (:mod:`pipeline.maths.adjustment.pose_errors`), which
both sensors share: what the laser sees of the same planes at the same moment tells them. An adjustment that takes the
trajectory, or the laser's planes, as given throws that away: under ordinary drift its yaw is wrong by 0.1°.

The way: points -> sums by epoch (:mod:`~pipeline.maths.adjustment.interval_sums`) -> white noise eliminated
(:mod:`~pipeline.maths.adjustment.eliminate_white_noise`) -> drift eliminated
(:mod:`~pipeline.maths.adjustment.eliminate_drift`) -> normal equations of the unknowns
(:mod:`~pipeline.maths.adjustment.parameters`) -> solution (:mod:`~pipeline.maths.adjustment.solution`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import Poses, of_poses, of_unknowns
from pipeline.maths.adjustment.eliminate_drift import Eliminated, eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import Observed, reduce_white
from pipeline.maths.adjustment.interval_sums import EpochSums
from pipeline.maths.adjustment.parameters import SIX, State
from pipeline.maths.adjustment.pose_errors import Drift, PoseNoise
from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.geometry.trajectory import Trajectory

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
NS = 1e9
REACH_S = 0.2  # rates are taken over this time on either side: between two records noise of 2 mm is 0.5 m/s


@dataclass(frozen=True)
class Body:
    """How the body moved: the trajectory in the target frame, its records' velocity and turning (n, 6) m/s and rad/s,
    and the laser's lever arm."""

    trajectory: Trajectory
    rates: Array
    laser_lever_arm_m: Array

    @classmethod
    def of(cls, trajectory: Trajectory, laser_lever_arm_m: Array) -> "Body":
        return cls(trajectory, trajectory.rates(REACH_S), laser_lever_arm_m)

    @property
    def seconds(self) -> Array:
        """Times of the records since the first (n,)."""
        return np.asarray((self.trajectory.t_ns - self.trajectory.t_ns[0]) / NS)

    def moments(self, record: Integers, share: Array) -> Array:
        """Times at these shares of the step from each record to the next, (g,) s."""
        seconds = self.seconds
        return np.asarray(seconds[record] + share * (seconds[record + 1] - seconds[record]))

    def poses(self, record: Integers, share: Array, drift: Drift | None) -> Poses:
        """At these moments, corrected by the drift found so far: the design is wanted where the body is."""
        positions, T = self.trajectory.poses_within(record, share)
        if drift is not None:
            error = drift.at(self.moments(record, share))
            positions, T = positions + error[:, :3], exp_so3(error[:, 3:]) @ T
        return Poses(positions, T, self.rates[record])

    def lever_arm(self, sensor: str, state: State) -> Array:
        return state.lever_arm_m if sensor == state.calibrated else self.laser_lever_arm_m


@dataclass(frozen=True)
class OnSurface:
    """The epochs ``rows`` of a sensor's sums: those on one surface."""

    sensor: str
    surface: int
    sums: EpochSums
    rows: Integers
    state: State
    body: Body
    drift: Drift | None
    wanted: Integers | None

    @property
    def record(self) -> Integers:
        return np.asarray(self.sums.record[self.rows])

    def observed(self, rows: slice) -> Observed:
        sums = self.sums.taken(self.rows[rows])
        lever = self.body.lever_arm(self.sensor, self.state)
        poses = self.body.poses(sums.record, sums.share, self.drift)
        design = of_unknowns(self.state, self.sensor, lever, self.surface, poses, sums.normal.shape[1])
        pose = of_poses(self.state.surfaces, np.array([self.surface]))[0]
        columns = self.state.columns(self.sensor, self.surface)
        if self.wanted is None:
            return Observed(sums, design, columns, pose)
        kept = np.isin(columns, self.wanted)
        return Observed(sums, design[:, :, kept], np.searchsorted(self.wanted, columns[kept]), pose)


def by_surface(
    sums: Mapping[str, EpochSums],
    state: State,
    body: Body,
    drift: Drift | None = None,
    wanted: Integers | None = None,
) -> list[OnSurface]:
    """Each sensor's epochs, surface by surface; ``wanted``: the unknowns (ascending) that they are to speak of."""
    return [
        OnSurface(sensor, surface, one, np.flatnonzero(one.surface == surface), state, body, drift, wanted)
        for sensor, one in sums.items()
        for surface in range(len(state.surfaces))
    ]


def normal_equations(
    sums: Mapping[str, EpochSums],
    state: State,
    body: Body,
    noise: PoseNoise,
    drift: Drift,
    wanted: Integers | None = None,
) -> Eliminated:
    """Of all unknowns, or of those ``wanted`` (ascending); ``drift``: that with which v was taken."""
    sources = by_surface(sums, state, body, drift, wanted)
    count = state.size if wanted is None else len(wanted)
    reduced = reduce_white(sources, count, drift.knots, body.seconds, noise.white)
    return eliminate_drift(reduced, noise, drift)


BLOCK = 50_000  # epochs whose designs are made at a time


def moved(
    sums: Mapping[str, EpochSums], state: State, body: Body, drift: Drift, step: Array, drift_step: Array
) -> dict[str, EpochSums]:
    """The sums after a step of the unknowns (u,) and of the drift (k, 6), without reading the points again."""
    changed = Drift(drift.knots, drift_step)
    changes = {sensor: np.zeros_like(one.right) for sensor, one in sums.items()}
    for source in by_surface(sums, state, body, drift):
        for start in range(0, len(source.rows), BLOCK):
            part = slice(start, start + BLOCK)
            seen = source.observed(part)
            change = seen.design @ step[seen.columns]
            moments = body.moments(seen.sums.record, seen.sums.share)
            change[:, : len(seen.pose)] += changed.at(moments) @ seen.pose.T
            changes[source.sensor][source.rows[part]] = change
    return {sensor: one.moved(changes[sensor]) for sensor, one in sums.items()}


def settle(sums: EpochSums, state: State, body: Body) -> Array:
    """Step of the six (u,) that brings the soundings onto the surfaces as they are, poses taken as true.

    To come near enough from a coarse mount: first order in errors of degrees needs a few such steps.
    """
    normal, right = np.zeros((SIX, SIX)), np.zeros(SIX)
    for source in by_surface({"mbes": sums}, state, body):
        seen = source.observed(slice(None))
        six = np.flatnonzero(seen.columns < SIX)
        design = seen.design[:, :, six]
        normal += np.einsum("gfi,gfh,ghj->ij", design, seen.sums.normal, design, optimize=True)
        right += np.einsum("gfi,gf->i", design, seen.sums.right)
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    step = np.zeros(state.size)
    step[:SIX] = -scale * np.linalg.lstsq(normal * np.outer(scale, scale), scale * right, rcond=1e-9)[0]
    return step


def pull_of(state: State, sensor: str, body: Body, record: Integers, drift: Array, features: int) -> Array:
    """By how much the drift (r, 6) after each of these records and the parameters in ``state.other`` move v: (r, s, F),
    by the features of an epoch on each surface."""
    found = np.zeros((len(record), len(state.surfaces), features))
    values = state.values_of_other()
    for surface in range(len(state.surfaces)):
        pose = of_poses(state.surfaces, np.array([surface]))[0]
        found[:, surface, : len(pose)] = drift @ pose.T
        mine = values[state.columns(sensor, surface)]
        if np.any(mine):
            poses = body.poses(record, np.full(len(record), 0.5), None)
            lever = body.lever_arm(sensor, state)
            found[:, surface] += of_unknowns(state, sensor, lever, surface, poses, features) @ mine
    return found
