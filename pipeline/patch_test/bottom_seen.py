"""Pieces of the bottom as passes show them by one mount, and which soundings lie on which piece."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.finding.bottom import DIFFER, MOST, SIDE_M, BottomPiece, Squares, bottom_pieces, serving
from pipeline.mount import Mounted
from pipeline.patch_test.passes import PatchPasses

Array = NDArray[np.float64]
STEEPEST = MOST // 2  # pieces that are chosen for their slope, which shows yaw and pitch
SIDE = 0.4  # side of a square as a share of the depth: as many soundings at any depth
GATE = 0.08  # of a sounding from its piece, in sides of that


@dataclass(frozen=True)
class BottomSeen:
    """The pieces that are used, all others, and soundings (n,): their rows among the passes', and their pieces.

    own_m, level_m (n, 3): the soundings in the head's frame and in the level frame.
    """

    pieces: Sequence[BottomPiece]
    others: Sequence[BottomPiece]
    rows: NDArray[np.int64]
    piece: NDArray[np.int16]
    own_m: Array
    level_m: Array

    @property
    def differing(self) -> float:
        """Share of those flat squares, heard in two passes or more, on which the passes differ by too much."""
        differ = sum(piece.refused.startswith(DIFFER) for piece in self.others)
        return differ / (differ + len(self.pieces) + sum(not piece.refused for piece in self.others))


def bottom_seen(
    passes: PatchPasses, mount: Mounted, squares: Squares, among: Sequence[BottomPiece] | None = None
) -> BottomSeen:
    """Return the bottom by a mount, divided into squares; ``among``: only squares of these pieces are used.

    Raises
    ------
    RawDataError
        No piece serves.
    """
    own, level = passes.placed(mount)
    found = bottom_pieces(level, passes.number_of_pass, passes.level_m, squares)
    squares_used = None if among is None else {square_of(piece) for piece in among}
    pieces = serving([one for one in found if squares_used is None or square_of(one) in squares_used], STEEPEST)
    if not pieces:
        raise RawDataError(f"mbes: no piece of the bottom serves a patch test: {_why_none(found, squares.side_m)}")
    on = np.full(len(level), -1, dtype=np.int16)
    for number, piece in enumerate(pieces):
        on[rows_on(piece, level, np.flatnonzero(np.isin(passes.number_of_pass, piece.passes)))] = number
    rows = np.flatnonzero(on >= 0)
    used = {id(piece) for piece in pieces}
    others = [piece for piece in found if id(piece) not in used]
    return BottomSeen(pieces, others, rows, on[rows], own[rows], level[rows])


def square_of(piece: BottomPiece) -> tuple[float, ...]:
    """Return the place of a piece's square, the same whichever passes showed it."""
    return tuple(np.round(piece.corners_m[0, :2], 3).tolist())


def squares_of(passes: PatchPasses, level_m: Array) -> Squares:
    """Return the squares for the depth of soundings (n, 3), by steps of √2 of their side."""
    depth_m = passes.level_m - float(np.nanmedian(level_m[:, 2]))
    steps = round(2 * float(np.log2(max(SIDE * depth_m / SIDE_M, 1.0))))
    return Squares.of(float(SIDE_M * 2.0 ** (steps / 2)))


def rows_on(piece: BottomPiece, level_m: Array, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return those of the rows (k,) whose soundings, of (n, 3), lie on a piece."""
    low, high = piece.corners_m[:, :2].min(axis=0), piece.corners_m[:, :2].max(axis=0)
    places = level_m[rows, :2]
    inside = rows[np.all((places >= low) & (places < high), axis=1)]
    away = (level_m[inside] - piece.corners_m.mean(axis=0)) @ piece.normal
    return np.asarray(inside[np.abs(away) < GATE * (high[0] - low[0])])


def _why_none(refused: Sequence[BottomPiece], side_m: float) -> str:
    if not refused:
        return (
            f"no square of {side_m:.0f} m has soundings enough; sail more slowly, and look at the coarse mount and at "
            "the height of the water"
        )
    reasons = list(dict.fromkeys(piece.refused for piece in refused if piece.refused))[:3]
    words = f"{len(refused)} squares of {side_m:.0f} m were heard, and are refused: {'; '.join(reasons)}"
    if any(reason.startswith(DIFFER) for reason in reasons):
        return f"{words}; heights differ between passes (tide, no RTK), or the coarse mount is wrong by far"
    return f"{words}; sail both ways over the same flat bottom"
