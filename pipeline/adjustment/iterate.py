"""Values during the iteration of the adjustment: normal equations at them, a step from them, figures of the noise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.design_matrix import pose_design
from pipeline.maths.adjustment.drift_likelihood import DriftFigures, DriftPrior, drift_figures
from pipeline.maths.adjustment.eliminate_drift import NormalEquations, eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import ReducedIntervals
from pipeline.maths.adjustment.normal_equations import Linearisation, reduced_intervals, updated_sums
from pipeline.maths.adjustment.pose_errors import DriftEstimate, PoseNoise
from pipeline.maths.adjustment.pseudo_observations import Prior, PseudoObservations, all_pseudo_observations
from pipeline.maths.adjustment.record_noise import record_noise_factor
from pipeline.maths.adjustment.solution import Solution, solve
from pipeline.maths.adjustment.weighting import EpochVarianceFactor, Weighting

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Iterate:
    """Current values, and the interval sums linearised at them."""

    linearisation: Linearisation
    drift: DriftEstimate
    priors: Sequence[Prior]

    def reduced(self, white: Array, selected: Integers | None = None) -> ReducedIntervals:
        """Return the normal equations before the drift is eliminated; ``white`` (6,): sigmas of a record's noise."""
        return reduced_intervals(self.linearisation, self.drift.knots, white, selected)

    def equations(
        self, noise: PoseNoise, selected: Integers | None = None, reduced: ReducedIntervals | None = None
    ) -> NormalEquations:
        """Return the normal equations of all parameters, or of the selected ones, with the prior information.

        ``reduced``: those of :meth:`reduced` with the same white noise and parameters, if they are at hand.
        """
        reduced = self.reduced(noise.white, selected) if reduced is None else reduced
        equations, state = eliminate_drift(reduced, noise, self.drift), self.linearisation.state
        prior = self.prior
        places = np.arange(state.size) if selected is None else selected
        return replace(
            equations,
            normal=equations.normal + prior.normal[np.ix_(places, places)],
            right=equations.right + prior.right[places],
            squares=equations.squares + prior.squares,
        )

    @property
    def prior(self) -> PseudoObservations:
        """The prior information, at these values."""
        return all_pseudo_observations(self.priors, self.linearisation.state)

    def drift_figures(
        self, noise: PoseNoise, prior: DriftPrior, estimated: Integers, reduced: ReducedIntervals
    ) -> DriftFigures:
        """Return the figures of the drift by data and session; ``reduced``: as for :meth:`equations`."""
        return drift_figures(lambda tried: self.equations(tried, estimated, reduced), noise, prior)

    def stepped(
        self, noise: PoseNoise, estimated: Integers, reduced: ReducedIntervals | None = None
    ) -> tuple["Iterate", Solution]:
        """Return the values after a step of the estimated parameters, and the solution for these parameters alone.

        ``reduced``: as for :meth:`equations`.
        """
        state = self.linearisation.state
        equations = self.equations(noise, estimated, reduced)
        solution = solve(equations.normal, equations.right, range(len(estimated)))
        step, drift_step = np.zeros(state.size), equations.knots(solution.step)
        step[estimated] = solution.step
        sums = updated_sums(self.linearisation, step, DriftEstimate(self.drift.knots, drift_step))
        drift = self.drift.updated(drift_step)
        linearisation = replace(self.linearisation, sums=sums, state=state.updated(step), drift=drift)
        return Iterate(linearisation, drift, self.priors), solution

    def record_noise(self, noise: PoseNoise, weighting: Weighting) -> EpochVarianceFactor:
        """Return the variance factor of the records' white noise, from the laser's points; without them unknown.

        ``weighting``: that of the sums.
        """
        if "laser" not in self.linearisation.sums:
            return EpochVarianceFactor(1.0, np.inf)
        surfaces = self.linearisation.state.surfaces
        designs = pose_design(surfaces, np.arange(len(surfaces)))
        return record_noise_factor(self.linearisation.sums["laser"], designs, noise.white, weighting.robust_effects)
