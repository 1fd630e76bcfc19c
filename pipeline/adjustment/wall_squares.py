"""Squares of unsurveyed walls before which something stands: their soundings are left out, and counted.

A reading of all soundings sorts the residuals by face, cell, pass and size. Which squares are mixed is said by
:mod:`~pipeline.maths.adjustment.mixed_squares`. The laser's spot is small, so it has none.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.face_cells import CELL_M, OutsideCells, codes_of, faces_of, places_of
from pipeline.adjustment.iteration import MountAdjustment, adjust_mount
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.adjustment.point_sums import summed
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.weighted_iteration import IterationSettings
from pipeline.artefacts.streams import Batch, Stream
from pipeline.maths.adjustment.mixed_squares import OverlappingSquares, PassExcess, mixed
from pipeline.maths.adjustment.parameters import State, kind_of
from pipeline.maths.geometry.passes import pass_of

Integers = NDArray[np.int64]
BINS, OF_SIGMA = 128, 0.5  # of residuals, about zero; width in expected sigmas
INSIDE = 0.5  # least edge weight of a sounding that is counted
PASSES = 1 << 10  # that are told apart
MERGED = 1_000_000  # codes of batches that wait, beyond twice those that are known


@dataclass(frozen=True)
class MixedCells:
    """Cells of the mixed squares of a face, and beside them, as a head of the sonar sees it.

    code (c,): as :func:`~pipeline.adjustment.face_cells.codes_of` gives it; points: soundings in them;
    share: of all on the face; low_m, high_m: heights above the water between which they lie.
    """

    head: str
    face: int
    code: Integers
    points: int
    share: float
    low_m: float
    high_m: float

    @property
    def area_m2(self) -> float:
        """Return their area."""
        return len(self.code) * CELL_M**2


def adjust_clear_squares(
    problem: CalibrationProblem,
    streams: Mapping[str, Stream],
    passes: pd.DataFrame,
    settings: IterationSettings,
    gap_s: float,
) -> tuple[MountAdjustment, Mapping[str, Stream], list[MixedCells]]:
    """Return the adjustment without the soundings in mixed squares, the points it has used, and the squares.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    streams : mapping of Stream
        Labelled points by sensor.
    passes : DataFrame
        Table passes.
    settings : IterationSettings
        Limits of the iteration, robust weights.
    gap_s : float
        A longer time (s) without observations interrupts the knots of the drift.
    """
    first = adjust_mount(problem, streams, settings, gap_s)
    if not problem.prior.from_start or not first.converged:
        return first, streams, []
    squares = mixed_squares(problem, first, streams, passes)
    if squares:
        left = without_cells(problem, first, streams, squares)
        adjustment = adjust_mount(problem, left, settings, gap_s)
        if not adjustment.solution.deficiency:
            return adjustment, left, squares
    return first, streams, []


def mixed_squares(
    problem: CalibrationProblem, adjustment: MountAdjustment, streams: Mapping[str, Stream], passes: pd.DataFrame
) -> list[MixedCells]:
    """Return the mixed squares of all upright and sloping faces, by head and face.

    Parameters
    ----------
    problem : CalibrationProblem
        Model of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    streams : mapping of Stream
        Labelled points by sensor.
    passes : DataFrame
        Table passes.
    """
    model, state, found = problem.model, adjustment.state, list[MixedCells]()
    times_ns = passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy()
    for head in (name for name in streams if kind_of(name) == "mbes"):
        code, number = _merged(streams[head].fold(_counted, model, head, adjustment.values, times_ns))
        face_of = faces_of(code // (PASSES * BINS))
        for face in np.unique(face_of).tolist():
            first, last = np.searchsorted(face_of, [face, face + 1])
            if not state.surfaces[int(model.faces.surface[face])].level:
                found += _of_face(model, state, (head, face), code[first:last], number[first:last])
    return found


def without_cells(
    problem: CalibrationProblem, adjustment: MountAdjustment, streams: Mapping[str, Stream], left: Iterable[MixedCells]
) -> dict[str, Stream]:
    """Return the streams without the soundings in these cells."""
    codes: dict[str, list[Integers]] = {}
    for one in left:
        codes.setdefault(one.head, []).append(one.code)
    return dict(streams) | {
        head: streams[head].changed(OutsideCells(problem.model, adjustment.state, head, np.concatenate(of_head)))
        for head, of_head in codes.items()
    }


def _counted(
    batch: Batch, model: ObservationModel, head: str, values: CurrentValues, times_ns: tuple[Integers, Integers]
) -> tuple[Integers, Integers]:
    """Return the codes of cells, passes and bins of residuals, ascending, and the number of soundings of each."""
    observed = summed(batch, model, head, values, residuals=True)
    edge_weight = np.asarray(observed.points["edge_weight"], dtype=np.float64)
    inside = edge_weight >= INSIDE
    points = {name: column[inside] for name, column in observed.points.items()}
    v_m, _, _, weight, _, _ = observed.observed[:, inside]
    bin_ = np.floor(v_m * np.sqrt(weight / edge_weight[inside]) / OF_SIGMA) + BINS // 2
    run = np.minimum(pass_of(points["t_ns"], *times_ns).astype(np.int64) + 1, PASSES - 1)
    code = (codes_of(points, model, head, values.state) * PASSES + run) * BINS
    return np.unique(code + np.clip(bin_, 0, BINS - 1).astype(np.int64), return_counts=True)


def _merged(pieces: Iterable[tuple[Integers, Integers]]) -> tuple[Integers, Integers]:
    """Return the codes of all batches, ascending, and the numbers of all together."""
    waiting, codes = list[tuple[Integers, Integers]](), 0
    for piece in pieces:
        waiting.append(piece)
        if sum(len(code) for code, _ in waiting) > 2 * codes + MERGED:
            waiting = [_together(waiting)]
            codes = len(waiting[0][0])
    return _together(waiting)


def _together(pieces: Sequence[tuple[Integers, Integers]]) -> tuple[Integers, Integers]:
    empty = np.empty(0, dtype=np.int64)
    code, row = np.unique(np.concatenate([empty, *(codes for codes, _ in pieces)]), return_inverse=True)
    numbers = np.concatenate([empty, *(number for _, number in pieces)])
    return code, np.bincount(row, numbers, len(code)).astype(np.int64)


def _of_face(
    model: ObservationModel, state: State, seen: tuple[str, int], code: Integers, number: Integers
) -> list[MixedCells]:
    """Return the mixed squares of a face as a head has ``seen`` it, from codes (n,) and their numbers; or nothing."""
    cells, row = np.unique(code // (PASSES * BINS), return_inverse=True)
    soundings, run = np.bincount(row, number).astype(np.int64), code // BINS % PASSES
    place = places_of(cells)
    squares, passes = OverlappingSquares.of(place), []
    for each in np.unique(run).tolist():
        mine, count = run == each, np.zeros((len(cells) + 1, BINS), dtype=np.int32)
        count[row[mine], code[mine] % BINS] = number[mine]
        passes.append(PassExcess.of(squares, count))
    is_mixed = mixed(squares, soundings, passes)
    if not is_mixed.any():
        return []
    surface = state.surfaces[int(model.faces.surface[seen[1]])]
    corners = CELL_M * np.concatenate([place[is_mixed] + corner for corner in product((0, 1), repeat=2)])
    off_m = surface.shift_m + model.height_of_face[seen[1]]
    z = corners @ surface.tangents[:, 2] + surface.centre_m[2] + off_m * surface.normal[2] - model.wet_heights_m[1]
    points = int(soundings[is_mixed].sum())
    return [MixedCells(*seen, cells[is_mixed], points, points / soundings.sum(), float(z.min()), float(z.max()))]
