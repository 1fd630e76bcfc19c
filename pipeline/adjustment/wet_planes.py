"""The adjustment at walls that nobody has surveyed: wet faces that contradict the others are left out, and named.

That a wall goes straight on below the water is an assumption. A ledge, a footing, a bulge, a wall that was mended are
where it fails. Soundings on such a face turn the mount, and the adjustment spreads its error over all faces. So after
each adjustment every wet face is tested (:mod:`~pipeline.maths.adjustment.plane_tests`). What is left out:

* squares in which something stands before the wall (:mod:`~pipeline.adjustment.wall_squares`), first of all;
* faces with too few soundings to trust, and faces whose soundings fill their gate: the wall is not there;
* heights at which a face is not the plane that it is elsewhere (:mod:`~pipeline.adjustment.wall_stripes`);
* the face whose test is worst, if it exceeds the limit of all tests together, and explains more than any other. Then
  the rest is adjusted anew.

Four rules keep this from hiding other errors. Where another face explains nearly as much, nobody can tell which of
them is wrong. An error of a sensor moves all faces: it may be one, where a parameter of a sensor explains nearly as
much. Faces vote: more must be left than are left out. And the tests are linear: where the adjustment has gone farther
from the coarse mount than anyone measures wrong, they hold no more, and it may be any face. If a rule forbids it,
nothing is left out, and the faces are in doubt, for which the verdict rejects.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.face_errors import FinalSolution
from pipeline.adjustment.iteration import MountAdjustment, adjust_mount
from pipeline.adjustment.parameter_strengths import parameter_tests
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.wall_squares import MixedCells, adjust_clear_squares
from pipeline.adjustment.wall_stripes import OutsideStripes, Stripe, profiles_by_height, stripes_off
from pipeline.artefacts.catalogue.results import LEFT_OUT
from pipeline.artefacts.streams import Stream
from pipeline.config.pool import Adjust
from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.adjustment.parameters import WET_PARAMETERS, kind_of
from pipeline.maths.adjustment.plane_tests import PlaneTest, plane_test
from pipeline.maths.adjustment.profiles import Profiles
from pipeline.maths.adjustment.residual_means import BinMean
from pipeline.maths.mount_parameters import too_far

FEWEST_SOUNDINGS = 30  # on a family of faces: with fewer its labels are not reliable
# Largest RMS of a family's residuals as a share of the gate. Noise of which a gate leaves k sigmas on either side has
# 0.20 for k = 5, 0.33 for 3, 0.39 for 2.5, 0.44 for 2; without any centre, spread over the gate, 0.58.
LARGEST_SHARE_OF_GATE = 0.4
ROUNDS = 8  # adjustments, at most
LEVEL = 0.01  # of the tests of wet faces together: to leave out a good face costs little, to keep a bad one much
NEARLY_AS_WELL = 9.0  # a fall of the sum of squares, 3 sigmas: explanations that differ by less are not told apart


@dataclass(frozen=True)
class FaceLimits:
    """Limits beyond which faces are left out, or cannot be judged.

    gates_m: largest distance of a labelled sounding from its face, as labelled, by head of the sonar; correction (6,):
    of the coarse mount, rad and m.
    """

    gates_m: Mapping[str, float]
    correction: NDArray[np.float64]


@dataclass(frozen=True)
class LeftOut:
    """A surface, or a stripe or squares of it, whose soundings are left out.

    family; why: "mixed", "few", "scatter", "step" or "off", or "doubt" if it is not left out; points: their number;
    sensor: that saw them; low_m, high_m: heights above the water, infinite at the ends of the face. unknown, value,
    sigma: the wet face's parameter that is farthest off, rad or m; of a stripe value is what it stands off by, m;
    otherwise "" and NaN. area_m2, share: of mixed squares, and of the face's soundings in them; otherwise NaN.
    """

    family: str
    why: str
    points: int
    sensor: str = "mbes"
    low_m: float = float("-inf")
    high_m: float = float("inf")
    unknown: str = ""
    value: float = float("nan")
    sigma: float = float("nan")
    area_m2: float = float("nan")
    share: float = float("nan")

    @property
    def whole(self) -> bool:
        """Return whether the surface is left out at all heights."""
        return self.why != "doubt" and not np.isfinite([self.low_m, self.high_m]).any()


def adjust_true_faces(
    problem: CalibrationProblem,
    streams: Mapping[str, Stream],
    passes: pd.DataFrame,
    settings: Adjust,
    gap_s: float,
    limits: FaceLimits,
) -> tuple[MountAdjustment, dict[str, Stream], pd.DataFrame]:
    """Return the adjustment of the faces that agree, the points it has used, and table ``left_out``.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    streams : mapping of Stream
        Labelled points by sensor.
    passes : DataFrame
        Table passes.
    settings : Adjust
        Limits of the iteration, robust weights, level of the tests.
    gap_s : float
        A longer time (s) without observations interrupts the knots of the drift.
    limits : FaceLimits
        Of the labels, and of the mount.
    """
    adjustment, streams, squares = adjust_clear_squares(problem, streams, passes, settings, gap_s)
    points, found = dict(streams), [_of_squares(problem, one) for one in squares]
    stripes, rough_to = list[Stripe](), set[str]()
    for rounds in range(1, ROUNDS + 1):
        rough_to |= {sensor for sensor, rough in adjustment.rough.items() if rough.shown}
        if not problem.prior.from_start or adjustment.solution.deficiency:
            break
        profiles = {sensor: profiles_by_height(problem, adjustment, sensor, points[sensor]) for sensor in points}
        more, off = _not_there(problem, profiles, limits.gates_m), list[Stripe]()
        if not more:
            all_off = stripes_off(problem, adjustment, profiles, settings.test_tolerance_m)
            off = [stripe for stripe in all_off if not stripe.within(stripes)]
            more = [_of_stripe(problem, stripe) for stripe in off] or _contradicting(problem, adjustment, found, limits)
        seen = {number for name, number in adjustment.accumulation.groups if kind_of(name) == "mbes"}
        if rounds == ROUNDS or len({one.family for one in more if one.whole and one.sensor != "laser"}) >= len(seen):
            more = [replace(one, why="doubt") for one in more]  # nothing would be left, or it does not end
        found += more
        if not more or any(one.why == "doubt" for one in more):
            break
        stripes += off or list(_whole_faces(problem, more))
        state, cuts = adjustment.state, tuple(stripes)
        points = {
            sensor: stream.changed(OutsideStripes(problem.model, state, sensor, cuts))
            for sensor, stream in streams.items()
        }
        adjustment = adjust_mount(problem, points, settings, gap_s, rough_to)
    columns = [column.name for column in LEFT_OUT.columns]
    return adjustment, points, pd.DataFrame([vars(one) for one in found], columns=columns)


def _of_squares(problem: CalibrationProblem, squares: MixedCells) -> LeftOut:
    family, place = _family(problem, squares.face), (squares.head, squares.low_m, squares.high_m)
    return LeftOut(family, "mixed", squares.points, *place, area_m2=squares.area_m2, share=squares.share)


def _of_stripe(problem: CalibrationProblem, stripe: Stripe) -> LeftOut:
    heights_m = stripe.low_m, stripe.high_m
    return LeftOut(_family(problem, stripe.face), "step", stripe.points, stripe.sensor, *heights_m, value=stripe.off_m)


def _family(problem: CalibrationProblem, face: int) -> str:
    return problem.model.coarse.surfaces[int(problem.model.faces.surface[face])].family


def _whole_faces(problem: CalibrationProblem, left_out: Sequence[LeftOut]) -> Iterator[Stripe]:
    """Yield stripes over all heights of all faces of these families."""
    families = [surface.family for surface in problem.model.coarse.surfaces]
    for one in left_out:
        for face in np.flatnonzero(problem.model.faces.surface == families.index(one.family)).tolist():
            for head in problem.model.coarse.heads:
                yield Stripe(head, face, -np.inf, np.inf, one.value, one.points)


def _not_there(
    problem: CalibrationProblem, profiles: Mapping[str, Profiles], gates_m: Mapping[str, float]
) -> list[LeftOut]:
    """Return the surfaces with few soundings, or with soundings all over the gate, if the laser sees them, too."""
    surface_of, by_surface = problem.model.faces.surface, dict[int, list[tuple[float, BinMean]]]()
    dry = {int(surface_of[face]) for face in profiles["laser"]}
    for head, gate_m in gates_m.items():
        for face, means in profiles[head].items():
            by_surface.setdefault(int(surface_of[face]), []).extend((gate_m, mean) for mean in means)
    found = []
    for surface, bins in sorted(by_surface.items()):
        if surface not in dry:
            continue
        family, count = problem.model.coarse.surfaces[surface].family, sum(mean.count for _, mean in bins)
        in_gates = sum(mean.count * (mean.rms_m**2 - mean.mean_m**2) / gate_m**2 for gate_m, mean in bins) / count
        if count < FEWEST_SOUNDINGS:
            found.append(LeftOut(family, "few", count))
        elif in_gates > LARGEST_SHARE_OF_GATE**2:
            found.append(LeftOut(family, "scatter", count))
    return found


def _contradicting(
    problem: CalibrationProblem, adjustment: MountAdjustment, before: Sequence[LeftOut], limits: FaceLimits
) -> list[LeftOut]:
    """Return the surface that contradicts the others most; "doubt" with all that it may be if nobody can tell."""
    state, known, names = adjustment.state, problem.prior.parameters, adjustment.state.names
    if known is None:
        return []
    deviation = state.deviation_from(known.known) + adjustment.solution.step
    tests: dict[int, tuple[PlaneTest, list[int]]] = {}
    for sensor, number in sorted(adjustment.accumulation.groups):
        own = {f"wet_{state.surfaces[number].family}_{name}" for name in WET_PARAMETERS}
        numbers = [k for k in known.numbers.tolist() if names[k] in own]
        if kind_of(sensor) == "mbes" and numbers and number not in tests:
            test = plane_test(adjustment.solution, deviation, problem.consider, numbers)
            if test.rank:  # a face that the sonar alone sees stands where it does
                tests[number] = test, numbers
    count = sum(1 + len(numbers) for _, numbers in tests.values())
    largest = joint_limit(count, LEVEL)
    suspects = [number for number, (test, _) in tests.items() if test.deviate > largest]
    if not suspects:
        return []
    if _gone_far(problem, adjustment, limits):
        return [_off(adjustment, number, "doubt", *tests[number]) for number in suspects]
    falls = {number: test.fall for number, (test, _) in tests.items()}
    least = max(falls.values()) - NEARLY_AS_WELL
    final = FinalSolution(names, deviation, deviation, adjustment.equations, adjustment.solution)
    single = parameter_tests(problem, final)
    others = [test.strength**2 for test in single if not names[test.parameter].startswith("wet_")]
    chosen = [number for number, fall in falls.items() if fall > least]
    voted_out = 1 + sum(one.why == "off" for one in before)
    told = len(chosen) == 1 and max(others, default=0.0) <= least and 2 * voted_out < len(tests) + voted_out - 1
    return [_off(adjustment, number, "off" if told else "doubt", *tests[number]) for number in chosen]


def _gone_far(problem: CalibrationProblem, adjustment: MountAdjustment, limits: FaceLimits) -> bool:
    """Return whether a head's mount lies beyond the limits of the coarse one's correction."""
    state, solution = adjustment.state, adjustment.solution
    deviation, sigma = state.deviation_from(problem.model.coarse) + solution.step, np.zeros(state.size)
    sigma[solution.estimated] = np.sqrt(np.diag(solution.covariance))
    heads = [state.mount_columns(head) for head in state.heads]
    return any(too_far(deviation[columns], sigma[columns], limits.correction) for columns in heads)


def _off(adjustment: MountAdjustment, number: int, why: str, test: PlaneTest, parameters: Sequence[int]) -> LeftOut:
    k = int(np.argmax(np.abs(test.error) / np.maximum(test.sigma, 1e-12)))
    return LeftOut(
        family=adjustment.state.surfaces[number].family,
        why=why,
        points=sum(
            group.count
            for (sensor, surface), group in adjustment.accumulation.groups.items()
            if surface == number and kind_of(sensor) == "mbes"
        ),
        unknown=adjustment.state.names[parameters[k]],
        value=float(test.error[k]),
        sigma=float(test.sigma[k]),
    )
