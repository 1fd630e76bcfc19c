"""Pieces of the bottom as passes show them by one mount, and which soundings lie on which piece."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.finding.bottom import MOST, STRICT, BottomPiece, PieceLimits, bottom_pieces, serving
from pipeline.mount import Mounted
from pipeline.patch_test.passes import PatchPasses

Array = NDArray[np.float64]
STEEPEST = MOST // 2  # pieces that are chosen for their slope, which shows yaw and pitch
LOOSE = PieceLimits(apart_m=np.inf, uneven_m=np.inf, bow_m=np.inf)
LOOSE_GATE_M, GATE_M = 3.0, 0.15  # of a sounding from its piece


@dataclass(frozen=True)
class BottomSeen:
    """The pieces that serve, the refused ones, and soundings (n,): their rows among the passes', and their pieces.

    own_m, level_m (n, 3): the soundings in the head's frame and in the level frame.
    """

    pieces: Sequence[BottomPiece]
    refused: Sequence[BottomPiece]
    rows: NDArray[np.int64]
    piece: NDArray[np.int16]
    own_m: Array
    level_m: Array


def bottom_seen(passes: PatchPasses, mount: Mounted, limits: PieceLimits = STRICT) -> BottomSeen:
    """Return the bottom by a mount; by ``LOOSE`` limits pieces serve whatever their passes differ by.

    Raises
    ------
    RawDataError
        No piece serves.
    """
    own, level = passes.placed(mount)
    found = bottom_pieces(level, passes.number_of_pass, passes.level_m, limits)
    pieces, refused = serving(found, STEEPEST), [piece for piece in found if piece.refused]
    if not pieces:
        raise RawDataError(f"mbes: no piece of the bottom serves a patch test: {_why_none(refused)}")
    gate_m, on = LOOSE_GATE_M if limits is LOOSE else GATE_M, np.full(len(level), -1, dtype=np.int16)
    for number, piece in enumerate(pieces):
        low, high = piece.corners_m.min(axis=0), piece.corners_m.max(axis=0)
        inside = np.all((level[:, :2] >= low[:2]) & (level[:, :2] < high[:2]), axis=1)
        rows = np.flatnonzero(inside & np.isin(passes.number_of_pass, piece.passes))
        away = (level[rows] - piece.corners_m.mean(axis=0)) @ piece.normal
        on[rows[np.abs(away) < gate_m]] = number
    rows = np.flatnonzero(on >= 0)
    return BottomSeen(pieces, refused, rows, on[rows], own[rows], level[rows])


def _why_none(refused: Sequence[BottomPiece]) -> str:
    if not refused:
        return "no square of 2 m has soundings enough; look at the height of the water, and at the coarse mount"
    reasons = list(dict.fromkeys(piece.refused for piece in refused))[:3]
    return f"{len(refused)} squares of 2 m were heard, and are refused: {'; '.join(reasons)}"
