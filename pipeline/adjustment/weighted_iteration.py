"""Readings of all labelled points, each with a step, until values and weights stay: the first part of an adjustment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.accumulation import Accumulation, accumulate, reweighted
from pipeline.adjustment.initial_mount import initial_mounts
from pipeline.adjustment.iterate import Iterate
from pipeline.adjustment.observation_model import CurrentValues
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.artefacts.streams import Stream
from pipeline.maths.adjustment.normal_equations import Linearisation
from pipeline.maths.adjustment.parameters import State, of_head
from pipeline.maths.adjustment.solution import Solution
from pipeline.maths.adjustment.weighting import Weighting, noise_seen_by_laser
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


SETTLED = StepLimits(0.05, 1e-6, 1e-5)  # after such a step another reading would hardly change the weights
LEAST_PASSES = 3  # readings of the points: for the drift, for outliers beside it, for their scale and the white noise


def estimated_columns(state: State, additional: Sequence[str] = (), mount: bool = True) -> list[int]:
    """Return the numbers of the parameters to estimate: mounts, surfaces, and the ones named in ``additional``.

    A parameter of the first head names those of all heads.
    """
    surfaces = range(state.surface_slice.start, state.surface_slice.stop)
    further = (number for number, name in enumerate(state.names) if of_head(name)[1] in additional)
    return sorted({*(state.mounts if mount else ()), *surfaces, *further})


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
    problem: CalibrationProblem,
    streams: Mapping[str, Stream],
    settings: IterationSettings,
    gap_s: float,
    begin: State | None = None,
) -> WeightedIteration:
    """Read all points, solve and step, until the weights do not change, or a direction is open.

    Without points of the calibrated sensor, surfaces and drift alone are estimated.

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
    begin : State, optional
        Where to start; by default, the coarse mount, brought near the surfaces unless it is known beforehand.
    """
    model, prior = problem.model, problem.prior
    begin = model.coarse if begin is None and prior.of_mount(model.coarse) else begin
    state = initial_mounts(streams, model) if begin is None else begin
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
        settled = weighting.robust is not None and is_small(solution, SETTLED, mounts)
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
            white = noise_seen_by_laser(prior.noise, stepped.record_noise(prior.noise, weighting)).white
            weighting = replace(weighting, scales=accumulation.robust_scales(len(state.surfaces)), white=white)
        values = CurrentValues(stepped.linearisation.state, stepped.drift, weighting)
        del accumulation, linearisation, start, stepped  # the next reading needs their memory


def is_small(solution: Solution, limits: StepLimits, mounts: Integers) -> bool:
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
