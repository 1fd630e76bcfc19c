"""The adjustment's iteration: read all points, solve, move; until neither values nor weights change any more."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.accumulation import Reading, read, refactored, scales_of
from pipeline.adjustment.observation_model import Scene
from pipeline.adjustment.weighting import Weighting
from pipeline.artefacts.streams import Stream
from pipeline.config.pool import Adjust
from pipeline.config.session import Ins
from pipeline.maths.adjustment.design_constraints import Known
from pipeline.maths.adjustment.design_matrix import of_poses
from pipeline.maths.adjustment.eliminate_drift import Eliminated
from pipeline.maths.adjustment.interval_sums import EpochSums
from pipeline.maths.adjustment.normal_equations import moved, normal_equations, settle
from pipeline.maths.adjustment.parameters import SIX, State
from pipeline.maths.adjustment.pose_errors import Drift, PoseNoise, knots_of
from pipeline.maths.adjustment.solution import Solution, solve
from pipeline.maths.adjustment.variance_components import Common, Scatter, common, scatter

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
NONE = (1e-3, 1e-10, 1e-9)  # a step below this share of its sigma, or below so many rad or m, is none
SETTLED = (0.05, 1e-6, 1e-5)  # after one as small as this the weights would change too little for another reading
NEAR_RAD_M = 1e-3  # the soundings have come near enough for everything else
SURE, UNLIKELY = 0.1, 100.0  # the white noise's factor is applied if its sigma is below, within these bounds
LEAST_READINGS = 3  # to see the drift, to see outliers against it, and to know their scale
CLOSING = 3  # steps, at most, with the last weights
SETTLING = 10  # steps, at most, to come there


@dataclass(frozen=True)
class Adjusted:
    """Where the iteration ended; ``shared``: by sensor the variance factor of what an epoch's points have in common,
    of which the laser's has been applied to the INS's white noise."""

    state: State
    drift: Drift
    weighting: Weighting
    reading: Reading
    shared: Mapping[str, Common]
    equations: Eliminated
    solution: Solution
    converged: bool
    iterations: int

    @property
    def redundancy(self) -> float:
        """Observations with their robust weights, less the unknowns; pose errors are no unknowns: they have a prior."""
        return sum(one.weights for one in self.reading.counts.values()) - len(self.solution.free)

    @property
    def between(self) -> Scatter:
        """What the sums of squares hold beyond the scatter within epochs: how well epochs, passes and sensors agree."""
        everywhere = [scatter(one, np.ones(len(one), dtype=bool)) for one in self.reading.sums.values()]
        within = sum(one.squares for one in everywhere), sum(one.free for one in everywhere)
        return Scatter(self.equations.squares - within[0], self.redundancy - within[1])


def noise_of(ins: Ins) -> PoseNoise:
    """The INS's noise as the session states it, target frame (z up: heading turns about it)."""
    drift, white = ins.drift, ins.white
    angles = np.radians([drift.roll_pitch_deg, drift.roll_pitch_deg, drift.heading_deg])
    return PoseNoise(
        np.r_[[white.position_m] * 3, [np.radians(white.attitude_deg)] * 3],
        np.r_[drift.horizontal_m, drift.horizontal_m, drift.vertical_m, angles],
        drift.time_constant_s,
    )


def free_unknowns(state: State, further: Sequence[str] = ()) -> list[int]:
    """The six, the surfaces, and what the config frees besides."""
    shared = range(state.shared.start, state.shared.stop)
    return sorted({*range(SIX), *shared, *(state.names.index(name) for name in further)})


@dataclass(frozen=True)
class Given:
    """What is known beside the observations: noise of the poses, what the surfaces are known to be (at a state), and
    which of the six are to be held, from the normal equations of all unknowns at the first reading."""

    noise: PoseNoise
    surfaces: Callable[[State], Known] | None = None
    held: Callable[[Array], Sequence[int]] | None = None


def adjust(
    streams: Mapping[str, Stream], scene: Scene, given: Given, settings: Adjust, gap_s: float
) -> Adjusted:
    """From the coarse mount to the solution."""
    noise = given.noise
    state = _near(streams["mbes"], scene) if "mbes" in streams else scene.coarse
    free = np.array(free_unknowns(state, settings.free))
    weighting, known, settled = Weighting(), None, False
    for iteration in range(1, settings.max_iterations + 1):
        reading, weighting = refactored(read(streams, scene, state, known, weighting), state, weighting)
        drift = known or _no_drift(reading, scene, noise, gap_s)
        before = _Point(state, drift, reading.sums, given.surfaces)
        if iteration == 1 and given.held is not None:
            held = given.held(before.equations(scene, noise).normal)
            free = np.setdiff1d(free, np.array(held, dtype=np.int64))
        now, solution = before.stepped(scene, noise, free)
        if solution.deficiency:
            return before.adjusted(scene, noise, free, weighting, reading, {}, False, iteration)
        state, known = now.state, now.drift
        settled = weighting.robust is not None and _small(solution, free, *SETTLED)
        if settled and iteration >= LEAST_READINGS:
            break
        known_scales = scales_of(reading) if iteration > 1 else {}  # of the groups that there are
        scales = {**weighting.scales, **known_scales}
        weighting = replace(weighting, scales=scales, robust=(settings.robust_k0, settings.robust_k1))
    poses = of_poses(state.surfaces, np.arange(len(state.surfaces)))
    shared = {sensor: common(one, poses, noise.white) for sensor, one in now.sums.items()}
    if shared["laser"].sigma < SURE:
        noise = noise.scaled(min(max(shared["laser"].factor, 1 / UNLIKELY), UNLIKELY), 1.0)
    converged = False
    for _ in range(CLOSING):  # the weights as they are
        now, solution = now.stepped(scene, noise, free)
        converged = settled and _small(solution, free, *NONE)
        if converged:
            break
    return now.adjusted(scene, noise, free, weighting, reading, shared, converged, iteration)


@dataclass(frozen=True)
class _Point:
    """Where the iteration stands: values, and the sums taken there."""

    state: State
    drift: Drift
    sums: Mapping[str, EpochSums]
    surfaces: Callable[[State], Known] | None

    def equations(self, scene: Scene, noise: PoseNoise, wanted: Integers | None = None) -> Eliminated:
        """Normal equations of all unknowns, or of those ``wanted``, with what is known of the surfaces."""
        found = normal_equations(self.sums, self.state, scene.body, noise, self.drift, wanted)
        if self.surfaces is None:
            return found
        more = self.surfaces(self.state)
        places = np.arange(self.state.size) if wanted is None else wanted
        return replace(
            found,
            normal=found.normal + more.normal[np.ix_(places, places)],
            right=found.right + more.right[places],
            squares=found.squares + more.squares,
        )

    def stepped(self, scene: Scene, noise: PoseNoise, free: Integers) -> tuple["_Point", Solution]:
        """After a step of the free unknowns; and their solution, numbered as in ``free``."""
        equations = self.equations(scene, noise, free)
        solution = solve(equations.normal, equations.right, range(len(free)))
        step, drift_step = np.zeros(self.state.size), equations.knots(solution.step)
        step[free] = solution.step
        sums = moved(self.sums, self.state, scene.body, self.drift, step, drift_step)
        moved_to = replace(self, state=self.state.moved(step), drift=self.drift.moved(drift_step), sums=sums)
        return moved_to, solution

    def adjusted(
        self,
        scene: Scene,
        noise: PoseNoise,
        free: Integers,
        weighting: Weighting,
        reading: Reading,
        shared: Mapping[str, Common],
        converged: bool,
        iterations: int,
    ) -> Adjusted:
        """The end: equations of all unknowns, those held as well."""
        equations = self.equations(scene, noise)
        solution = solve(equations.normal, equations.right, free.tolist())
        reading = replace(reading, sums=self.sums)
        ended = (self.state, self.drift, weighting, reading, shared, equations, solution)
        return Adjusted(*ended, converged and not solution.deficiency, iterations)


def _near(soundings: Stream, scene: Scene) -> State:
    """The coarse mount brought so far that the soundings lie on the laser's planes."""
    state = scene.coarse
    for _ in range(SETTLING):
        sums = read({"mbes": soundings}, scene, state, None, Weighting()).sums["mbes"]
        step = settle(sums, state, scene.body)
        state = state.moved(step)
        if np.max(np.abs(step)) < NEAR_RAD_M:
            break
    return state


def _no_drift(reading: Reading, scene: Scene, noise: PoseNoise, gap_s: float) -> Drift:
    record = np.unique(np.concatenate([one.record for one in reading.sums.values()]))
    knots = knots_of(record, scene.body.seconds, noise.spacing_s, gap_s)
    return Drift(knots, np.zeros((len(knots.record), SIX)))


def _small(solution: Solution, free: Integers, sigmas: float, rad: float, m: float) -> bool:
    """Whether the step of the six, or of those that are free, is below this share of their sigmas, or below these
    values."""
    six = np.flatnonzero(free < SIX)
    sigma = np.sqrt(np.diag(solution.covariance))[six]
    return bool(np.all(np.abs(solution.step[six]) <= np.maximum(sigmas * sigma, np.repeat([rad, m], 3)[free[six]])))
