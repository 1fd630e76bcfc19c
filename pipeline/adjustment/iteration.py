"""The iteration of the adjustment: read all points, solve and step, until neither values nor weights change."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.accumulation import Accumulation, accumulate, reweighted
from pipeline.adjustment.initial_mount import initial_mounts
from pipeline.adjustment.iterate import Iterate
from pipeline.adjustment.observation_model import CurrentValues
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.artefacts.streams import Stream
from pipeline.maths.adjustment.drift_likelihood import DriftFigures
from pipeline.maths.adjustment.eliminate_drift import NormalEquations
from pipeline.maths.adjustment.normal_equations import Linearisation
from pipeline.maths.adjustment.parameters import State, kind_of, of_head
from pipeline.maths.adjustment.ping_noise import PingNoise, ping_noise, with_ping_noise
from pipeline.maths.adjustment.pose_errors import DriftEstimate
from pipeline.maths.adjustment.solution import Solution, solve
from pipeline.maths.adjustment.weighting import (
    EpochVarianceFactor,
    Scatter,
    Weighting,
    noise_seen_by_laser,
    scatter,
)
from pipeline.maths.mount_parameters import N_MOUNT

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class IterationSettings(Protocol):
    """Settings of the iteration."""

    @property
    def free(self) -> Sequence[str]:
        """Names of the additional parameters to estimate."""
        ...

    @property
    def max_iterations(self) -> int:
        """Largest number of readings of the points."""
        ...

    @property
    def robust_k0(self) -> float:
        """Largest normalised residual with full weight."""
        ...

    @property
    def robust_k1(self) -> float:
        """Largest normalised residual with any weight."""
        ...


@dataclass(frozen=True)
class StepLimits:
    """Bounds of a small step of a parameter: a share of its sigma, or a value in rad or m if that is larger."""

    sigmas: float
    rad: float
    m: float


CONVERGED = StepLimits(1e-3, 1e-10, 1e-9)  # after such a step no further step is necessary
SETTLED = StepLimits(0.05, 1e-6, 1e-5)  # after such a step another reading would hardly change the weights
LEAST_PASSES = 3  # readings of the points: for the drift, for outliers beside it, for their scale and the white noise
CLOSING_STEPS = 8  # largest number of steps after the last reading, with its weights: known parameters join in then


@dataclass(frozen=True)
class MountAdjustment:
    """Result of the iteration.

    accumulation: sums at the final values; epoch_factors: by sensor, the variance factor of the error common to all
    points of an interval (empty without a solution; the laser's factor, if it is well known, is already in the INS's
    white noise of the solution); pings: by head of the sonar, noise that the soundings of a ping share, as the sums
    have it (empty without a sonar or a solution); drift_figures: the figures of the drift, which the solution has;
    equations: normal equations of all parameters, also of the fixed ones; last: the values of the final solution.
    """

    state: State
    drift: DriftEstimate
    weighting: Weighting
    accumulation: Accumulation
    epoch_factors: Mapping[str, EpochVarianceFactor]
    pings: Mapping[str, PingNoise]
    drift_figures: DriftFigures
    equations: NormalEquations
    solution: Solution
    converged: bool
    iterations: int
    last: Iterate

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
        return self.weighting.kept * observations + self.last.prior.count - len(self.solution.estimated)

    @property
    def between(self) -> Scatter:
        """Sum of squares and degrees of freedom beyond the scatter within intervals.

        They show how well intervals, passes and sensors agree.
        """
        kept, shares = self.weighting.kept, self.weighting.edge_shares
        parts = [
            scatter(sums, np.ones(len(sums), dtype=bool), kept, shares[sensor])
            for sensor, sums in self.accumulation.sums.items()
        ]
        within = sum(part.squares for part in parts), sum(part.dof for part in parts)
        return Scatter(self.equations.squares - within[0], self.redundancy - within[1])


def estimated_columns(state: State, additional: Sequence[str] = (), mount: bool = True) -> list[int]:
    """Return the numbers of the parameters to estimate: mounts, surfaces, and the ones named in ``additional``.

    A parameter of the first head names those of all heads.
    """
    surfaces = range(state.surface_slice.start, state.surface_slice.stop)
    further = (number for number, name in enumerate(state.names) if of_head(name)[1] in additional)
    return sorted({*(state.mounts if mount else ()), *surfaces, *further})


def adjust_mount(
    problem: CalibrationProblem, streams: Mapping[str, Stream], settings: IterationSettings, gap_s: float
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
    """
    prior = problem.prior
    figures, pings = DriftFigures.of_session(prior.noise), dict[str, PingNoise]()
    weighted = weighted_iteration(problem, streams, settings, gap_s)
    # parameters that the points tell of, and that are known beforehand, are estimated with the last weights
    last, estimated = weighted.last, np.union1d(weighted.estimated, prior.known_parameters)
    mounts = np.flatnonzero(np.isin(estimated, last.linearisation.state.mounts))
    factors: dict[str, EpochVarianceFactor] = {}
    converged = False
    if not weighted.deficient:
        # take the INS's noise from the data: white noise, then drift; further steps have the last weights
        factors["laser"] = last.record_noise(prior.noise)
        last, pings = _with_ping_noise(last, prior.noise.white, factors["laser"])
        factors |= {head: ping.epoch for head, ping in pings.items()}
        noise = noise_seen_by_laser(prior.noise, factors["laser"])
        reduced = last.reduced(noise.white, estimated)
        figures = last.drift_figures(noise, prior.drift, estimated, reduced)
        for closing in range(CLOSING_STEPS):
            last, solution = last.stepped(figures.noise, estimated, None if closing else reduced)
            converged = weighted.settled and _is_small(solution, CONVERGED, mounts)
            if converged:
                break
    # solve with the equations of all parameters: total covariance and tests need the fixed parameters
    equations = last.equations(figures.noise)
    solution = solve(equations.normal, equations.right, estimated.tolist(), last.prior.normal)
    return MountAdjustment(
        state=last.linearisation.state,
        drift=last.drift,
        weighting=weighted.weighting,
        accumulation=replace(weighted.accumulation, sums=last.linearisation.sums),
        epoch_factors=factors,
        pings=pings,
        drift_figures=figures,
        equations=equations,
        solution=solution,
        converged=converged and not solution.deficiency,
        iterations=weighted.iterations,
        last=last,
    )


def _with_ping_noise(last: Iterate, white: Array, laser: EpochVarianceFactor) -> tuple[Iterate, dict[str, PingNoise]]:
    """Return the values with the noise that the soundings of a ping share in their sums; and this noise by head.

    Parameters
    ----------
    last : Iterate
        The values.
    white : (6,) array
        Standard deviations of a record's white noise, m and rad.
    laser : EpochVarianceFactor
        Variance factor of this noise, from the laser's points.
    """
    pings = {}
    for head, soundings in last.linearisation.sums.items():
        if kind_of(head) == "mbes":
            surfaces = last.linearisation.state.surfaces
            pings[head] = ping_noise(soundings, surfaces, white, laser)
            with_pings = soundings.stored(partial(with_ping_noise, noise=pings[head], surfaces=surfaces, white=white))
            last = replace(last, linearisation=last.linearisation.with_sums(head, with_pings))
    return last, pings


@dataclass(frozen=True)
class WeightedIteration:
    """The iteration after its last reading of the points; ``deficient``: the data leave directions open."""

    last: Iterate
    estimated: Integers
    weighting: Weighting
    accumulation: Accumulation
    settled: bool
    deficient: bool
    iterations: int


def weighted_iteration(
    problem: CalibrationProblem, streams: Mapping[str, Stream], settings: IterationSettings, gap_s: float
) -> WeightedIteration:
    """Read all points, solve and step, until the weights do not change, or a direction is open.

    Without points of the calibrated sensor, surfaces and drift alone are estimated. Parameters: as for
    :func:`adjust_mount`.
    """
    model, prior = problem.model, problem.prior
    state = initial_mounts(streams, model)
    values = CurrentValues(state, weighting=Weighting(white=prior.noise.white))
    estimated = np.array(estimated_columns(state, settings.free, mount=state.calibrated in streams))
    estimated = np.union1d(estimated, prior.known_parameters) if prior.from_start else estimated
    mounts = np.flatnonzero(np.isin(estimated, state.mounts))
    iteration = 0
    while True:
        iteration += 1
        # read all points, and take the variance factors of sensors and surfaces from their scatter
        accumulation, weighting = reweighted(accumulate(streams, model, values), values.state, values.weighting)
        drift = values.drift or model.body.zero_drift(accumulation.records, prior.noise, gap_s)
        linearisation = Linearisation(accumulation.sums, values.state, model.body, drift, problem.mapper)
        start = Iterate(linearisation, drift, prior.priors)
        # solve and step
        stepped, solution = start.stepped(replace(prior.noise, white=weighting.white), estimated)
        deficient = solution.deficiency > 0
        settled = weighting.robust is not None and _is_small(solution, SETTLED, mounts)
        if deficient or (settled and iteration >= LEAST_PASSES) or iteration >= settings.max_iterations:
            return WeightedIteration(
                last=start if deficient else stepped,
                estimated=estimated,
                weighting=weighting,
                accumulation=accumulation,
                settled=settled,
                deficient=deficient,
                iterations=iteration,
            )
        # from the next reading on reduce the weights of outliers
        weighting = replace(weighting, robust=(settings.robust_k0, settings.robust_k1))
        if iteration > 1:  # scales and the INS's white noise come from residuals without the drift and outliers
            white = noise_seen_by_laser(prior.noise, stepped.record_noise(prior.noise)).white
            weighting = replace(weighting, scales=accumulation.robust_scales(len(state.surfaces)), white=white)
        values = CurrentValues(stepped.linearisation.state, stepped.drift, weighting)
        del accumulation, linearisation, start, stepped  # the next reading needs their memory


def _is_small(solution: Solution, limits: StepLimits, mounts: Integers) -> bool:
    """Return whether the step of each estimated mount parameter is within the limits.

    Parameters
    ----------
    solution : Solution
        Solution of the estimated parameters alone.
    limits : StepLimits
        Bounds of the steps.
    mounts : (6 h,) array
        Places of the h mounts among its parameters. Without any the first six count, which are those of surfaces.
    """
    judged = mounts if len(mounts) else np.arange(min(N_MOUNT, len(solution.estimated)))
    sigma = np.sqrt(np.diag(solution.covariance))[judged]
    absolute = np.where(np.arange(len(judged)) % N_MOUNT < 3, limits.rad, limits.m)
    return bool(np.all(np.abs(solution.step[judged]) <= np.maximum(limits.sigmas * sigma, absolute)))
