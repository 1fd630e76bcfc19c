"""Squares of unsurveyed walls before which something stands: their soundings are left out, and counted.

A reading of all soundings sorts the residuals by face, square and size. Which squares are mixed is said by
:mod:`~pipeline.maths.adjustment.mixed_squares`. The laser's spot is small, so it has none.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.adjustment.point_sums import summed
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.residual_places import places_on_surface
from pipeline.artefacts.streams import Batch, Stream
from pipeline.maths.adjustment.mixed_squares import mixed
from pipeline.maths.adjustment.parameters import State, kind_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SIDE_M = 0.25  # of a square
BINS, OF_SIGMA = 128, 0.5  # of residuals, about zero; width in expected sigmas
MERGED = 1_000_000  # codes of batches that wait, beyond twice those that are known
REACH = 1 << 14  # numbers of squares along a face: within ± this many, 4 km


@dataclass(frozen=True)
class Squares:
    """Mixed squares of a face as a head of the sonar sees it.

    code (c,): as :func:`codes_of` gives it; points: soundings in them; low_m, high_m: heights above the water between
    which they lie.
    """

    head: str
    face: int
    code: Integers
    points: int
    low_m: float
    high_m: float

    @property
    def area_m2(self) -> float:
        """Return their area."""
        return len(self.code) * SIDE_M**2


@dataclass(frozen=True)
class OutsideSquares:
    """Leaves those of a head's soundings that do not lie in squares (c,); they are placed by the mount of a state."""

    model: ObservationModel
    state: State
    head: str
    codes: Integers

    def __call__(self, batch: Batch) -> Batch:
        """Return the rows that are left."""
        kept = ~np.isin(codes_of(batch, self.model, self.head, self.state), self.codes)
        return {name: column[kept] for name, column in batch.items()}


def codes_of(batch: Batch, model: ObservationModel, head: str, state: State) -> Integers:
    """Return a number (n,) for the face of each sounding and the square of it that its ray meets."""
    surface, face = model.faces.surface[batch["face"]], batch["face"].astype(np.int64)
    tangents = np.array([each.tangents for each in state.surfaces])
    centres = np.array([each.centre_m for each in state.surfaces])
    from_centre_m = places_on_surface(model, head, batch, state) - centres[surface]
    place = np.floor(np.einsum("nki,ni->nk", tangents[surface], from_centre_m) / SIDE_M)
    column, row = np.clip(place, -REACH, REACH - 1).astype(np.int64).T + REACH
    return np.asarray((face * 2 * REACH + column) * 2 * REACH + row)


def mixed_squares(
    problem: CalibrationProblem, adjustment: MountAdjustment, streams: Mapping[str, Stream]
) -> list[Squares]:
    """Return the mixed squares of all upright and sloping faces, by head and face.

    Parameters
    ----------
    problem : CalibrationProblem
        Model of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    streams : mapping of Stream
        Labelled points by sensor.
    """
    model, state, found = problem.model, adjustment.state, list[Squares]()
    for head, stream in streams.items():
        if kind_of(head) != "mbes":
            continue
        code, number = _merged(stream.fold(_counted, model, head, adjustment.values))
        square, row = np.unique(code // BINS, return_inverse=True)
        face_of = square // (2 * REACH) ** 2
        for face in np.unique(face_of).tolist():
            if state.surfaces[int(model.faces.surface[face])].level:
                continue
            first, last = np.searchsorted(face_of, [face, face + 1])
            count, ours = np.zeros((last - first, BINS), dtype=np.int64), (row >= first) & (row < last)
            count[row[ours] - first, code[ours] % BINS] = number[ours]
            is_mixed = mixed(_places(square[first:last]), count)
            if is_mixed.any():
                codes, points = square[first:last][is_mixed], int(count[is_mixed].sum())
                found.append(Squares(head, face, codes, points, *_heights_m(codes, model, face, state)))
    return found


def without_squares(
    problem: CalibrationProblem, adjustment: MountAdjustment, streams: Mapping[str, Stream], squares: Iterable[Squares]
) -> dict[str, Stream]:
    """Return the streams without the soundings in these squares."""
    codes: dict[str, list[Integers]] = {}
    for one in squares:
        codes.setdefault(one.head, []).append(one.code)
    return dict(streams) | {
        head: streams[head].changed(OutsideSquares(problem.model, adjustment.state, head, np.concatenate(of_head)))
        for head, of_head in codes.items()
    }


def _counted(batch: Batch, model: ObservationModel, head: str, values: CurrentValues) -> tuple[Integers, Integers]:
    """Return the codes of squares and bins of residuals, ascending, and the number of soundings of each."""
    observed = summed(batch, model, head, values, residuals=True)
    v_m, _, _, weight, _, _ = observed.observed
    bin_ = np.floor(v_m * np.sqrt(weight) / OF_SIGMA) + BINS // 2
    code = codes_of(observed.points, model, head, values.state) * BINS + np.clip(bin_, 0, BINS - 1).astype(np.int64)
    return np.unique(code, return_counts=True)


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


def _places(codes: Integers) -> Integers:
    """Return column and row (c, 2) of squares on their face."""
    return np.asarray(np.stack([codes // (2 * REACH) % (2 * REACH), codes % (2 * REACH)], axis=1) - REACH)


def _heights_m(codes: Integers, model: ObservationModel, face: int, state: State) -> tuple[float, float]:
    """Return the heights above the water between which squares of a face lie."""
    surface = state.surfaces[int(model.faces.surface[face])]
    corners = [_places(codes) + corner for corner in product((0, 1), repeat=2)]
    z = SIDE_M * np.concatenate(corners) @ surface.tangents[:, 2]
    z += surface.centre_m[2] - model.wet_heights_m[1]
    return float(z.min()), float(z.max())
