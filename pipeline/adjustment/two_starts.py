"""The weighted iteration from two starts, where the sum of squares may have two minima.

Walls of one direction show the sonar's yaw mostly as a scale of the ranges, which is the same for a fan turned to the
other side (:mod:`~pipeline.maths.adjustment.mirrored_mount`). The first start, the mount alone brought onto the walls,
takes wet walls that stand off by centimetres for errors of yaw and lever arm y, and may come to lie on the wrong side:
two sessions of 24 at a pier of sheet piling so had a yaw that was wrong by 3.5°, ten of its sigmas. So the iteration
starts from the other side as well. Mostly both end in one minimum; then the result is the first's. Otherwise it is that
with the smaller sum of squares, both by the same variances, since each iteration scales its own residuals to one. (The
squares of soundings that robust weights cut are not in the sums.) With several heads, each of which could be on either
side, the result is in doubt.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.accumulation import accumulate
from pipeline.adjustment.iterate import Iterate
from pipeline.adjustment.observation_model import CurrentValues
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.wall_roughness import with_roughness
from pipeline.adjustment.weighted_iteration import IterationSettings, WeightedIteration, weighted_iteration
from pipeline.artefacts.streams import Stream
from pipeline.maths.adjustment.mirrored_mount import mirrored_mount
from pipeline.maths.adjustment.normal_equations import Linearisation
from pipeline.maths.adjustment.ping_noise import with_design_effects
from pipeline.maths.adjustment.roughness import Roughness
from pipeline.maths.adjustment.solution import solve
from pipeline.maths.adjustment.weighting import Weighting
from pipeline.maths.mount_parameters import N_MOUNT

Array = NDArray[np.float64]
SAME = 3.0  # random sigmas by which the mounts of one minimum may differ


@dataclass(frozen=True)
class Rival:
    """The other minimum: its mount less that of the result, (6,) rad and m, and its strength.

    The strength is the root of the amount by which its sum of squares is larger.
    """

    apart: Array
    strength: float


@dataclass(frozen=True)
class ChosenIteration:
    """The iteration that ends in the lower minimum, and the other minimum, None if there is none."""

    weighted: WeightedIteration
    rival: Rival | None = None


def chosen_iteration(
    problem: CalibrationProblem,
    streams: Mapping[str, Stream],
    settings: IterationSettings,
    gap_s: float,
    rough: Mapping[str, Roughness] | None = None,
) -> ChosenIteration:
    """Return the iteration with the smaller sum of squares; parameters as for :func:`weighted_iteration`.

    ``rough``: by sensor, what is known of the roughness of the place.
    """
    first = weighted_iteration(problem, streams, settings, gap_s)
    prior, coarse = problem.prior, problem.model.coarse
    may_differ = prior.from_start and not prior.of_mount(coarse) and "mbes" in streams and not first.deficient
    mirrored = None if not may_differ else mirrored_mount(first.last.linearisation)
    if mirrored is None:
        return ChosenIteration(first)
    if len(coarse.heads) > 1:  # each could be on either side: that is not tried, but doubted
        return ChosenIteration(first, Rival(mirrored.deviation_from(first.last.linearisation.state)[:N_MOUNT], 0.0))
    start = replace(coarse, R_body_from_sensor=mirrored.R_body_from_sensor, lever_arm_m=mirrored.lever_arm_m)
    second = weighted_iteration(problem, streams, settings, gap_s, start)
    if second.deficient or not second.settled:
        return ChosenIteration(first)
    apart = _apart(first, second)
    _, seen = with_roughness(first.last, rough or {}, problem.model.body, gap_s)
    squares, covariance = _minimum(first, problem, streams, first.weighting, seen)
    if float(apart @ np.linalg.solve(covariance, apart)) < SAME**2:
        return ChosenIteration(first)
    excess = _minimum(second, problem, streams, first.weighting, seen)[0] - squares
    if excess > 0 and first.settled:
        return ChosenIteration(first, Rival(apart, float(np.sqrt(excess))))
    return ChosenIteration(second, Rival(-apart, float(np.sqrt(max(-excess, 0.0)))))


def _apart(one: WeightedIteration, other: WeightedIteration) -> Array:
    """Return the second's mount less the first's, (6,) rad and m."""
    return other.last.linearisation.state.deviation_from(one.last.linearisation.state)[:N_MOUNT]


def _minimum(
    weighted: WeightedIteration,
    problem: CalibrationProblem,
    streams: Mapping[str, Stream],
    weighting: Weighting,
    rough: Mapping[str, Roughness],
) -> tuple[float, Array]:
    """Return the least sum of squares by these weights, and the random covariance (6, 6) of the mount there.

    On a rough wall the soundings of a patch count as few: else any excess would be significant.
    """
    state, drift = weighted.last.linearisation.state, weighted.last.drift
    read = accumulate(streams, problem.model, CurrentValues(state, drift, weighting)).sums
    sums = {name: one.stored(partial(with_design_effects, effects=rough[name].effects)) for name, one in read.items()}
    linearisation = Linearisation(sums, state, problem.model.body, drift, problem.mapper)
    at_values = Iterate(linearisation, drift, problem.prior.priors)
    noise = replace(problem.prior.noise, white=weighting.white)
    equations = at_values.equations(noise, weighted.estimated)
    solution = solve(equations.normal, equations.right, range(len(weighted.estimated)))
    squares = equations.squares + float(equations.right @ solution.step)
    return squares, solution.covariance[:N_MOUNT, :N_MOUNT]
