"""The adjustment with corrected poses: both sensors' points, group by group, with drift and white noise of the INS."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline import config
from pipeline.maths.adjustment import GROUPS, State, weights_of
from pipeline.maths.design import features, of_common, of_poses
from pipeline.maths.epochs import EpochSums, adjusted, epoch_sums, merged
from pipeline.maths.pose_errors import (
    SIX,
    Eliminated,
    Knots,
    PoseNoise,
    blocks_of,
    drift_at,
    eliminate_drift,
    joined,
    knots_of,
    reduce_white,
)
from pipeline.maths.robust import histogram, scale_of
from pipeline.scene import Scene
from pipeline.streams import Batch, Stream
from pipeline.times import NS

Array = NDArray[np.float64]
SPACING_S = 0.5  # of knots
FEWEST, LEAST_FREE = 8, 30  # points of a group, degrees of freedom of all, for a variance factor


@dataclass(frozen=True)
class Drift:
    """The drift found so far at knots, in the target frame: (k, 6) m and rad."""

    knots: Knots
    values: Array


@dataclass(frozen=True)
class Linearised:
    """One batch, or all: the sums of its groups, and by group of observations |v| / σ as a histogram."""

    sums: EpochSums
    histograms: Mapping[str, Array]


def noise_of(ins: config.Ins) -> PoseNoise:
    drift, white = ins.drift, ins.white
    angles = np.radians([drift.roll_pitch_deg, drift.roll_pitch_deg, drift.heading_deg])
    return PoseNoise(
        np.r_[[white.position_m] * 3, [np.radians(white.attitude_deg)] * 3],
        np.r_[drift.horizontal_m, drift.horizontal_m, drift.vertical_m, angles],
        drift.time_constant_s,
    )


def linearised(batch: Batch, scene: Scene, sensor: str, state: State, drift: Drift | None) -> Linearised:
    """A batch at the current state: v with the drift so far, features at the adjusted points."""
    seen = scene.observed(sensor, batch, state)
    rows, record = seen.rows, seen.record
    q = features(state.surfaces, rows.surface, seen.r_m)
    residual = rows.residual_m
    if drift is not None and len(record):
        first, last = int(record.min()), int(record.max())
        seconds = scene.seconds[first : last + 2]
        error = drift_at(drift.knots, drift.values, (seconds[:-1] + seconds[1:]) / 2)
        every = np.arange(len(state.surfaces))
        pull = np.einsum("sqe,ge->qgs", of_poses(state.surfaces, every), error).reshape(3, -1)
        residual = residual + np.einsum("qn,qn->n", pull[:, (record - first) * len(every) + rows.surface], q)
    rows = replace(rows, residual_m=residual)
    _, weight = weights_of(state, rows)
    normal = np.array([one.normal for one in state.surfaces])[rows.surface]
    at = features(state.surfaces, rows.surface, adjusted(seen.r_m, normal, residual, seen.spread))
    sums = epoch_sums(record, seen.share, rows.surface, len(state.surfaces), at, weight, residual)
    size = residual / rows.sigma_m
    return Linearised(sums, {GROUPS[k]: histogram(size[rows.group == k]) for k in np.unique(rows.group).tolist()})


def all_of(streams: Mapping[str, Stream], scene: Scene, state: State, drift: Drift | None) -> dict[str, Linearised]:
    found = {}
    for sensor, stream in streams.items():
        pieces = list(stream.fold(linearised, scene, sensor, state, drift))
        histograms: dict[str, Array] = {}
        for piece in pieces:
            for name, counts in piece.histograms.items():
                histograms[name] = histograms.get(name, 0) + counts
        found[sensor] = Linearised(merged(piece.sums for piece in pieces), histograms)
    return found


def knots_for(scene: Scene, found: Mapping[str, Linearised], gap_s: float) -> Knots:
    record = np.unique(np.concatenate([one.sums.record for one in found.values()]))
    return knots_of(record, scene.seconds, SPACING_S, gap_s)


def solved(
    found: Mapping[str, Linearised], scene: Scene, state: State, drift: Drift, noise: PoseNoise
) -> tuple[Eliminated, Array]:
    """The normal equations of the common unknowns, and their step."""
    parts = []
    for sensor, one in found.items():
        sums = one.sums
        start = scene.trajectory.t_ns[sums.record]
        width = scene.trajectory.t_ns[sums.record + 1] - start
        poses = scene.trajectory.poses_at(start + (sums.share * width).astype(np.int64))
        common = of_common(state, sums.surface, *poses, mount=sensor == "mbes")
        parts.append(blocks_of(sums, common, of_poses(state.surfaces, sums.surface)))
    reduced = reduce_white(joined(parts), drift.knots, scene.seconds, noise.white)
    equations = eliminate_drift(reduced, drift.knots, noise, drift.values)
    return equations, -np.linalg.solve(equations.normal, equations.right)


def factors_of(found: Mapping[str, Linearised], state: State) -> dict[str, float]:
    """Variance factors by group from the scatter of each group of observations about its own plane.

    With v fitted by q within a group, neither pose nor mount nor surface matters: Σ w v² - bᵀ N⁻¹ b over n - 3.
    """
    horizontal = np.array([one.family == "H" for one in state.surfaces])
    factors = dict(state.factors)
    for sensor, one in found.items():
        sums = one.sums
        flat = horizontal[sums.surface]
        for name in GROUPS[:1] if sensor == "laser" else GROUPS[1:]:
            use = (sums.count >= FEWEST) & (flat == (name == "mbes_horizontal") if sensor == "mbes" else True)
            free = float((sums.count[use] - 3).sum())
            if free >= LEAST_FREE:
                normal, right = sums.normal[use, 0], sums.right[use, 0]
                fitted = np.einsum("gij,gj->gi", np.linalg.pinv(normal, rcond=1e-10, hermitian=True), right)
                factors[name] *= float((sums.squares[use] - np.einsum("gi,gi->g", right, fitted)).sum()) / free
    return factors


def corrected(
    streams: Mapping[str, Stream], scene: Scene, state: State, noise: PoseNoise, settings: config.Adjust, gap_s: float
) -> tuple[State, Drift, Eliminated, Array]:
    """State, drift, the last equations and their step."""
    state = replace(state, robust=None, factors=dict.fromkeys(GROUPS, 1.0), scales=dict.fromkeys(GROUPS, 1.0))
    drift: Drift | None = None
    for turn in range(4):
        found = all_of(streams, scene, state, drift)
        if drift is None:
            knots = knots_for(scene, found, gap_s)
            drift = Drift(knots, np.zeros((len(knots.record), SIX)))
        equations, step = solved(found, scene, state, drift, noise)
        if turn == 3:
            break
        state = state.moved(step)
        drift = replace(drift, values=drift.values + equations.knots(step))
        if turn < 2:
            scales = {name: scale_of(c) for one in found.values() for name, c in one.histograms.items()}
            if turn == 1:
                state = replace(state, scales={**state.scales, **scales})
            state = replace(state, robust=(settings.robust_k0, settings.robust_k1) if turn else None)
        if turn:
            state = replace(state, factors=factors_of(found, state))
    return state, drift, equations, step
