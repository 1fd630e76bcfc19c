"""Values during the iteration of the adjustment: their normal equations, and a step from them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.eliminate_drift import NormalEquations
from pipeline.maths.adjustment.interval_sums import IntervalSums
from pipeline.maths.adjustment.normal_equations import Linearisation, normal_equations, updated_sums
from pipeline.maths.adjustment.pose_errors import DriftEstimate, PoseNoise
from pipeline.maths.adjustment.pseudo_observations import SurfacePrior
from pipeline.maths.adjustment.solution import Solution, solve
from pipeline.maths.adjustment.weighting import EpochVarianceFactor, epoch_variance_factors

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Iterate:
    """Current values, and the interval sums linearised at them."""

    linearisation: Linearisation
    drift: DriftEstimate
    surfaces: SurfacePrior | None

    def of(self, sums: Mapping[str, IntervalSums]) -> "Iterate":
        """Return the same values for other sums, linearised at them."""
        return replace(self, linearisation=replace(self.linearisation, sums=sums))

    def equations(self, noise: PoseNoise, selected: Integers | None = None) -> NormalEquations:
        """Return the normal equations of all parameters, or of the selected ones, with the prior of the surfaces."""
        equations, state = normal_equations(self.linearisation, self.drift, noise, selected), self.linearisation.state
        if self.surfaces is None:
            return equations
        prior = self.surfaces.pseudo_observations(state)
        places = np.arange(state.size) if selected is None else selected
        return replace(
            equations,
            normal=equations.normal + prior.normal[np.ix_(places, places)],
            right=equations.right + prior.right[places],
            squares=equations.squares + prior.squares,
        )

    def stepped(self, noise: PoseNoise, estimated: Integers) -> tuple["Iterate", Solution]:
        """Return the values after a step of the estimated parameters, and the solution for these parameters alone."""
        state = self.linearisation.state
        equations = self.equations(noise, estimated)
        solution = solve(equations.normal, equations.right, range(len(estimated)))
        step, drift_step = np.zeros(state.size), equations.knots(solution.step)
        step[estimated] = solution.step
        sums = updated_sums(self.linearisation, step, DriftEstimate(self.drift.knots, drift_step))
        drift = self.drift.updated(drift_step)
        linearisation = Linearisation(sums, state.updated(step), self.linearisation.body, drift)
        return Iterate(linearisation, drift, self.surfaces), solution

    def epoch_factors(self, noise: PoseNoise) -> dict[str, EpochVarianceFactor]:
        """Return the variance factor of the common error of an interval's points, by sensor."""
        linearisation = self.linearisation
        return epoch_variance_factors(linearisation.sums, linearisation.state.surfaces, noise.white)
