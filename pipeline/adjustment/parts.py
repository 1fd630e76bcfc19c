"""Calibrations from parts of the session: without one pass, from one half of the passes, from near or far passes alone.

At walls that nobody has surveyed also without the soundings on each: what hangs on one wall alone shows here.

The parts need no further reading of the points: they are solved at the final values and with the final weights. White
noise is eliminated once for all, because no error of a record reaches from one pass into another. A calibration that
hangs on one pass, or that changes with time or distance, shows here.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.accumulation import by_divisors
from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.artefacts.catalogue.results import PARTS
from pipeline.maths.adjustment.normal_equations import reduced_by_group
from pipeline.maths.adjustment.parameters import kind_of
from pipeline.maths.adjustment.parts import Deviation, deviation
from pipeline.maths.adjustment.solution import Solution, solve
from pipeline.maths.geometry.passes import pass_of
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.maths.target.bottom_names import shown_name

Integers = NDArray[np.int64]
NO_WEIGHT = 1e12  # divisor of the weights of soundings that are left out
APART_M = 0.5  # near and far passes differ by at least this distance


@dataclass(frozen=True)
class Part:
    """A part of the session: its name, and the numbers of its passes."""

    name: str
    passes: tuple[int, ...]


def parts_of(passes: pd.DataFrame) -> list[Part]:
    """Return the parts of a session with these rows of table passes; none of a single pass."""
    numbers = passes["pass"].tolist()
    if len(numbers) < 2:
        return []
    parts = [
        Part(f"without pass {left_out}", tuple(number for number in numbers if number != left_out))
        for left_out in numbers
    ]
    half = len(numbers) // 2
    in_time = passes.sort_values("start_ns")["pass"].tolist()
    parts += [Part("first half", tuple(in_time[:half])), Part("second half", tuple(in_time[half:]))]
    distance_m = passes["distance_m"].abs().sort_values(kind="stable")
    if distance_m.iloc[half] - distance_m.iloc[half - 1] >= APART_M:
        by_distance = passes["pass"].loc[distance_m.index].tolist()
        parts += [Part("near passes", tuple(by_distance[:half])), Part("far passes", tuple(by_distance[half:]))]
    return parts


def parts_table(problem: CalibrationProblem, adjustment: MountAdjustment, passes: pd.DataFrame) -> pd.DataFrame:
    """Return table ``parts``: by how much the mount changes if only a part of the session is used.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    passes : DataFrame
        Table passes.
    """
    whole = tuple(passes["pass"].tolist())
    rows = [_row(name, part, difference) for name, part, difference in _deviations(problem, adjustment, passes)]
    rows += [_row(name, Part(name, whole), difference) for name, difference in _without_faces(problem, adjustment)]
    return pd.DataFrame(rows, columns=[column.name for column in PARTS.columns])


def _deviations(
    problem: CalibrationProblem, adjustment: MountAdjustment, passes: pd.DataFrame
) -> Iterator[tuple[str, Part, Deviation]]:
    """Yield the deviations of each part that determines all parameters: of each head's mount, with a name."""
    whole = adjustment.solution
    if whole.deficiency:
        return
    last, noise = adjustment.last, adjustment.drift_figures.noise
    starts, ends = passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy()
    pass_of_record = pass_of(problem.model.body.trajectory.t_ns, starts, ends).astype(np.int64)
    of_sensor = {sensor: _passes_of(sums.record, pass_of_record) for sensor, sums in last.linearisation.sums.items()}
    records = adjustment.accumulation.records
    group = np.zeros(len(last.drift.knots.record) - 1, dtype=np.int64)
    group[last.drift.knots.interval_of(records)] = 1 + _passes_of(records, pass_of_record)
    reduced = reduced_by_group(last.linearisation, last.drift.knots, noise.white, group)
    for part in parts_of(passes):
        if not all(np.isin(seen, part.passes).any() for seen in of_sensor.values()):
            continue
        groups = [1 + number for number in part.passes if number < len(reduced.others) - 1]
        equations = last.equations(noise, reduced=reduced.of(groups))
        solution = solve(equations.normal, equations.right, whole.estimated.tolist())
        if not solution.deficiency:
            for name, difference in _of_heads(part.name, problem, adjustment, solution):
                yield name, part, difference


def _of_heads(
    part: str, problem: CalibrationProblem, adjustment: MountAdjustment, solution: Solution
) -> Iterator[tuple[str, Deviation]]:
    """Yield the deviation of each head's mount in a part's solution, with a name."""
    state, whole = adjustment.state, adjustment.solution
    for head in state.heads:
        name = part if head == state.calibrated else f"{part} ({head})"
        yield name, deviation(solution, whole, problem.consider, state.mount_columns(head))


def _without_faces(problem: CalibrationProblem, adjustment: MountAdjustment) -> Iterator[tuple[str, Deviation]]:
    """Yield the deviations without the soundings on each surface, where nobody has surveyed the walls.

    The pieces of the bottom are left out together: what hangs on one of two dozen says little.
    """
    whole, last, noise = adjustment.solution, adjustment.last, adjustment.drift_figures.noise
    heads = {head: sums for head, sums in last.linearisation.sums.items() if kind_of(head) == "mbes"}
    if whole.deficiency or not problem.prior.from_start or not heads:
        return
    surfaces = adjustment.state.surfaces
    seen = np.unique(np.concatenate([soundings.surface for soundings in heads.values()])).tolist()
    names = np.array([shown_name(surface.family) for surface in surfaces])
    told = list(dict.fromkeys(names[seen].tolist()))
    for name in told if len(told) > 1 else ():
        change = partial(by_divisors, divisors=np.where(names == name, NO_WEIGHT, 1.0))
        left = last.linearisation
        for head, soundings in heads.items():
            left = left.with_sums(head, soundings.changed(change))
        equations = replace(last, linearisation=left).equations(noise)
        solution = solve(equations.normal, equations.right, whole.estimated.tolist())
        if not solution.deficiency:
            yield from _of_heads(f"without the soundings on {name}", problem, adjustment, solution)


def _passes_of(record: Integers, pass_of_record: Integers) -> Integers:
    """Return the pass of each interval, by the record (g,) before it, or by the next one if that lies in no pass."""
    before, after = pass_of_record[record], pass_of_record[record + 1]
    return np.where(before >= 0, before, after)


def _row(name: str, part: Part, difference: Deviation) -> dict[str, Any]:
    row: dict[str, Any] = {"part": name, "passes": " ".join(map(str, part.passes))}
    row |= {"normalised": difference.normalised, "dof": difference.dof}
    for parameter, number, _, unit in PARAMETERS:
        scale = float(np.degrees(1.0)) if unit == "deg" else 1.0
        for kind, values in (("change", difference.change), ("sigma", difference.sigma)):
            row[f"{kind}_{parameter}"] = scale * float(values[number])
    return row
