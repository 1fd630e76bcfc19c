"""The iteration of the adjustment: read all points, solve and step, until neither values nor weights change."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.accumulation import Accumulation
from pipeline.adjustment.iterate import Iterate
from pipeline.adjustment.observation_model import CurrentValues
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.two_starts import Rival, chosen_iteration
from pipeline.adjustment.wall_roughness import with_roughness
from pipeline.adjustment.weighted_iteration import IterationSettings, StepLimits, is_small
from pipeline.artefacts.streams import Stream
from pipeline.maths.adjustment.drift_likelihood import DriftFigures
from pipeline.maths.adjustment.eliminate_drift import NormalEquations
from pipeline.maths.adjustment.eliminate_white_noise import ReducedIntervals
from pipeline.maths.adjustment.parameters import State, kind_of
from pipeline.maths.adjustment.ping_noise import PingNoise, ping_noise, with_ping_noise
from pipeline.maths.adjustment.pose_errors import DriftEstimate, PoseNoise
from pipeline.maths.adjustment.robust_weights import RobustEffects
from pipeline.maths.adjustment.roughness import Roughness
from pipeline.maths.adjustment.solution import Solution, solve
from pipeline.maths.adjustment.weighting import (
    EpochVarianceFactor,
    Scatter,
    Weighting,
    noise_seen_by_laser,
    scatter,
)

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


CONVERGED = StepLimits(1e-3, 1e-10, 1e-9)  # after such a step no further step is necessary
ROUGH_ROUNDS = 2  # of roughness and drift: what the drift has taken for its own at first shows in the second
CLOSING_STEPS = 8  # largest number of steps after the last reading, with its weights: known parameters join in then


@dataclass(frozen=True)
class MountAdjustment:
    """Result of the iteration.

    accumulation: sums at the final values; epoch_factors: by sensor, the variance factor of the error common to all
    points of an interval (empty without a solution; the laser's factor, if it is well known, is already in the INS's
    white noise of the solution); pings: by head of the sonar, noise that the soundings of a ping share, as the sums
    have it (empty without a sonar or a solution); rough: by sensor, the roughness of walls that nobody has surveyed, as
    the sums have it; drift_figures: the figures of the drift, which the solution has; equations: normal equations of
    all parameters, also of the fixed ones; last: the values of the final solution; rival: another minimum of the sum of
    squares, if there is one.
    """

    state: State
    drift: DriftEstimate
    weighting: Weighting
    accumulation: Accumulation
    epoch_factors: Mapping[str, EpochVarianceFactor]
    pings: Mapping[str, PingNoise]
    rough: Mapping[str, Roughness]
    drift_figures: DriftFigures
    equations: NormalEquations
    solution: Solution
    converged: bool
    iterations: int
    last: Iterate
    rival: Rival | None

    @property
    def values(self) -> CurrentValues:
        """The final values, at which the residuals are computed."""
        return CurrentValues(self.state, self.drift, self.weighting)

    @property
    def redundancy(self) -> float:
        """Expectation of the sum of squares: observations with a weight, prior information, less estimated parameters.

        Observations count as the part of their variance that robust weights leave, and, with those near edges, as their
        effective number. Pose errors do not count: each has one pseudo-observation.
        """
        observations = sum(
            group.information / float(self.weighting.edge_shares[sensor][surface])
            for (sensor, surface), group in self.accumulation.groups.items()
        )
        return self.weighting.robust_effects.kept * observations + self.last.prior.count - len(self.solution.estimated)

    @property
    def between(self) -> Scatter:
        """Sum of squares and degrees of freedom beyond the scatter within intervals.

        They show how well intervals, passes and sensors agree.
        """
        kept, shares = self.weighting.robust_effects.kept, self.weighting.edge_shares
        parts = [
            scatter(sums, np.ones(len(sums), dtype=bool), kept, shares[sensor])
            for sensor, sums in self.accumulation.sums.items()
        ]
        within = sum(part.squares for part in parts), sum(part.dof for part in parts)
        return Scatter(self.equations.squares - within[0], self.redundancy - within[1])


def adjust_mount(
    problem: CalibrationProblem,
    streams: Mapping[str, Stream],
    settings: IterationSettings,
    gap_s: float,
    rough_to: Collection[str] = (),
) -> MountAdjustment:
    """Return the result of the iteration from the coarse mount to the solution.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    streams : mapping of Stream
        Labelled points by sensor.
    settings : IterationSettings
        Limits of the iteration, robust weights, additional parameters to estimate.
    gap_s : float
        A longer time (s) without observations interrupts the knots of the drift.
    rough_to : collection of str
        Sensors to which a test with more faces has shown that the place is rough.
    """
    prior, converged = problem.prior, False
    figures, pings = DriftFigures.of_session(prior.noise), dict[str, PingNoise]()
    rough = {sensor: Roughness.none(len(problem.model.coarse.surfaces), shown=True) for sensor in rough_to}
    chosen = chosen_iteration(problem, streams, settings, gap_s, rough)
    weighted = chosen.weighted
    # parameters that the points tell of, and that are known beforehand, are estimated with the last weights
    last, estimated = weighted.last, np.union1d(weighted.estimated, prior.known_parameters)
    factors = dict[str, EpochVarianceFactor]()
    if not weighted.deficient:
        # take the INS's noise from the data: white noise, then drift; further steps have the last weights
        laser = last.record_noise(prior.noise, weighted.weighting)
        last, pings = _with_ping_noise(last, prior.noise.white, laser, weighted.weighting.robust_effects)
        factors |= {"laser": laser} | {head: ping.epoch for head, ping in pings.items()}
        noise = noise_seen_by_laser(prior.noise, laser)
        for _ in range(ROUGH_ROUNDS if prior.from_start else 1):
            if prior.from_start:  # a wall that nobody has surveyed may be rough
                last, rough = with_roughness(last, rough, problem.model.body, gap_s)
            reduced = last.reduced(noise.white, estimated)
            figures = last.drift_figures(noise, prior.drift, estimated, reduced)
            last, converged = _closed(last, figures.noise, estimated, reduced)
    equations = last.equations(figures.noise)  # of all parameters: total covariance and tests need the fixed ones
    solution = solve(equations.normal, equations.right, estimated.tolist(), last.prior.normal)
    return MountAdjustment(
        state=last.linearisation.state,
        drift=last.drift,
        weighting=weighted.weighting,
        accumulation=replace(weighted.accumulation, sums=last.linearisation.sums),
        epoch_factors=factors,
        pings=pings,
        rough=rough,
        drift_figures=figures,
        equations=equations,
        solution=solution,
        converged=converged and weighted.settled and not solution.deficiency,
        iterations=weighted.iterations,
        last=last,
        rival=chosen.rival,
    )


def _closed(last: Iterate, noise: PoseNoise, estimated: Integers, reduced: ReducedIntervals) -> tuple[Iterate, bool]:
    """Return the values after steps with the last weights, and whether the last step was small."""
    mounts = np.flatnonzero(np.isin(estimated, last.linearisation.state.mounts))
    for closing in range(CLOSING_STEPS):
        last, solution = last.stepped(noise, estimated, None if closing else reduced)
        if is_small(solution, CONVERGED, mounts):
            return last, True
    return last, False


def _with_ping_noise(
    last: Iterate, white: Array, laser: EpochVarianceFactor, robust: RobustEffects
) -> tuple[Iterate, dict[str, PingNoise]]:
    """Return the values with the noise that the soundings of a ping share in their sums; and this noise by head.

    Parameters
    ----------
    last : Iterate
        The values.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    laser : EpochVarianceFactor
        Variance factor of this noise, from the laser's points.
    robust : RobustEffects
        What robust weights do to the means of the soundings.
    """
    pings = {}
    for head, soundings in last.linearisation.sums.items():
        if kind_of(head) == "mbes":
            surfaces = last.linearisation.state.surfaces
            pings[head] = ping_noise(soundings, surfaces, white, laser, robust)
            with_pings = soundings.stored(partial(with_ping_noise, noise=pings[head], surfaces=surfaces, white=white))
            last = replace(last, linearisation=last.linearisation.with_sums(head, with_pings))
    return last, pings
