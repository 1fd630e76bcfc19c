"""Flat pieces of the bottom that the sonar heard in several passes.

No laser sees them, and nobody knows where they lie. But the bottom stands still: a roll of the sonar that is wrong by ε
tilts it by ε to starboard, and, heard on the way back, to port; a pitch shifts what lies on a slope along the track. So
passes over one piece, both ways or at different distances, are a patch test, as one group of observations beside the
walls. Each piece has a plane of its own, so that the bottom as a whole need not be flat.

The bottom is divided into squares. A square serves if its soundings, from two passes or more, fill it and lie on a
plane; if it is far enough from walls, whose echoes are louder; and if its passes agree to within what the mount that
placed them may be wrong by.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.surfaces.flatness import cells_of, flatness

Array = NDArray[np.float64]
SIDE_M, MARGIN, CELL = 2.0, 0.05, 0.125  # of a square; its face is smaller on each side; of a cell (shares of the side)
SHALLOWEST_M = 0.5  # a piece lies so far below the water, or deeper
FEWEST, FEWEST_OF_PASS = 1000, 300  # soundings of a square; of a pass that counts
FEWEST_OF_CELL = 4
FITS, WIDE, LEAST_OFF_M = 4, 3.0, 0.03  # fits to what lies within so many RMS of the last one, or so near
UNEVEN_M, BOW_M, COVERED, SPAN = 0.010, 0.015, 0.7, 0.6  # RMS and bow of cells; share of them heard, by each pass
STEEPEST_DEG = 60.0
APART_M = 0.06  # passes that differ by more are not on one piece by the labels' gate: first calibrate better
MOST = 24  # pieces
DIFFER = "passes differ"  # begins the reason of a piece that is refused for that


@dataclass(frozen=True)
class Squares:
    """The squares by which the bottom is divided: their side, and what a piece may be uneven by, m.

    apart_m: how far its passes may differ; uneven_m, bow_m: how uneven and how bent it may be; passes: that a piece
    needs.
    """

    side_m: float = SIDE_M
    apart_m: float = APART_M
    uneven_m: float = UNEVEN_M
    bow_m: float = BOW_M
    passes: int = 2

    @classmethod
    def of(cls, side_m: float) -> "Squares":
        """Return squares of a side; what a piece may be uneven by grows with it."""
        grown = side_m / SIDE_M
        return cls(side_m, grown * APART_M, grown * UNEVEN_M, grown * BOW_M)

    @property
    def cell_m(self) -> float:
        """Side of the cells by which a square is judged."""
        return self.side_m * CELL

    @property
    def ends_m(self) -> Array:
        """Where a square's face begins and ends (2,), from the square's corner."""
        return self.side_m * np.array([MARGIN, 1 - MARGIN])


USUAL = Squares()


@dataclass(frozen=True)
class BottomPiece:
    """A square of the bottom: its corners (4, 3), counter-clockwise from above, and what it is made of.

    passes: those that heard it; apart_m: largest difference of their means; refused: why it cannot serve, "" if it can.
    """

    corners_m: Array
    soundings: int
    passes: tuple[int, ...]
    depth_m: float
    slope_deg: float
    uneven_m: float
    apart_m: float
    refused: str = ""

    @property
    def normal(self) -> Array:
        """The unit normal (3,), upward."""
        normal = np.cross(self.corners_m[1] - self.corners_m[0], self.corners_m[3] - self.corners_m[0])
        return np.asarray(normal / np.linalg.norm(normal))


def bottom_pieces(
    points_m: Array, number_of_pass: NDArray[np.int16], level_m: float, squares: Squares = USUAL
) -> list[BottomPiece]:
    """Return the pieces of the bottom, those that serve first: by number of passes, then of soundings.

    Parameters
    ----------
    points_m
        Soundings (n, 3) away from walls, in a frame with z up.
    number_of_pass
        Their passes (n,).
    level_m
        Height of the water.
    squares
        How the bottom is divided, and what a piece is refused for.
    """
    deep = np.flatnonzero(points_m[:, 2] < level_m - SHALLOWEST_M)
    keys, square, count = cells_of(points_m[deep, :2], squares.side_m)
    order = np.argsort(square, kind="stable")
    ends = np.cumsum(count)
    pieces = []
    fewest = FEWEST if squares.passes > 1 else FEWEST_OF_PASS
    for k in np.flatnonzero(count >= fewest).tolist():
        rows = deep[order[ends[k] - count[k] : ends[k]]]
        pieces.append(_piece(points_m[rows], number_of_pass[rows], keys[k] * squares.side_m, level_m, squares))
    return sorted(pieces, key=lambda piece: (bool(piece.refused), -len(piece.passes), -piece.soundings))


def serving(pieces: Sequence[BottomPiece], steepest: int = 0) -> list[BottomPiece]:
    """Return the pieces that serve, at most ``MOST``, in the order in which they are numbered: along y, then x.

    Parameters
    ----------
    pieces
        The pieces, the best first.
    steepest
        Number of places that are for the steepest ones: of a wide level bottom slopes tell what the rest does not.
    """
    serve = [piece for piece in pieces if not piece.refused]
    steep = sorted(serve, key=lambda piece: -piece.slope_deg)[:steepest]
    taken = {id(piece) for piece in steep}
    best = [*steep, *(piece for piece in serve if id(piece) not in taken)][:MOST]
    return sorted(best, key=lambda piece: (round(float(piece.corners_m[:, 1].mean()), 3), piece.corners_m[0, 0]))


def _piece(
    points_m: Array, number_of_pass: NDArray[np.int16], low_m: Array, level_m: float, squares: Squares
) -> BottomPiece:
    plane = _plane(points_m - [*low_m, 0.0], squares.side_m)
    away = points_m[:, 2] - _heights(plane, points_m[:, :2] - low_m)
    slope_deg = float(np.degrees(np.arctan(np.hypot(*plane[:2]))))
    away = away * np.cos(np.radians(slope_deg))
    on = np.flatnonzero(np.abs(away) <= max(WIDE * float(np.std(away)), LEAST_OFF_M))
    places = points_m[on, :2]
    flat = flatness(places, away[on], squares.cell_m)
    heard = _passes(places - low_m, away[on], number_of_pass[on], squares.cell_m)
    means = list(heard.values())
    ends = low_m + squares.ends_m[:, None]
    square = np.array([[ends[i, 0], ends[j, 1]] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
    heights = _heights(plane, square - low_m)
    made = BottomPiece(
        corners_m=np.column_stack([square, heights]),
        soundings=len(on),
        passes=tuple(heard),
        depth_m=level_m - float(heights.mean()),
        slope_deg=slope_deg,
        uneven_m=_unevenness(places, away[on], squares.cell_m),
        apart_m=float(np.ptp(means)) if means else 0.0,
    )
    return replace(made, refused=_refusal(made, flat.bow_m, flat.covered, squares))


def _plane(points_m: Array, reach_m: float) -> Array:
    """Return the plane (3,) z = a x + b y + c, fitted to what lies near it."""
    use = np.abs(points_m[:, 2] - np.median(points_m[:, 2])) < reach_m
    plane = np.array([0.0, 0.0, float(np.median(points_m[:, 2]))])
    for _ in range(FITS):
        design = np.column_stack([points_m[use, :2], np.ones(int(use.sum()))])
        plane = np.linalg.lstsq(design, points_m[use, 2], rcond=None)[0]
        off = np.abs(points_m[:, 2] - _heights(plane, points_m[:, :2]))
        use = off <= max(WIDE * float(np.sqrt(np.mean(off[use] ** 2))), LEAST_OFF_M)
    return np.asarray(plane)


def _heights(plane: Array, places_m: Array) -> Array:
    return np.asarray(places_m @ plane[:2] + plane[2])


def _unevenness(places_m: Array, away_m: Array, cell_m: float) -> float:
    """Return the RMS of the cells' means, without what the soundings' noise alone makes of it: s² / n of each cell."""
    _, cell, count = cells_of(places_m, cell_m)
    mean = np.bincount(cell, weights=away_m) / count
    scatter = np.bincount(cell, weights=(away_m - mean[cell]) ** 2)
    use = count >= FEWEST_OF_CELL
    if not use.any():
        return 0.0
    noise = scatter[use] / (count[use] - 1) / count[use]
    return float(np.sqrt(max(0.0, float(np.mean(mean[use] ** 2 - noise)))))


def _passes(places_m: Array, away_m: Array, number_of_pass: NDArray[np.int16], cell_m: float) -> dict[int, float]:
    """Return by pass its mean distance from the plane, of those that fill most of the square; places in the square."""
    found = {}
    for number in np.unique(number_of_pass).tolist():
        rows = np.flatnonzero(number_of_pass == number)
        cells = len(cells_of(places_m[rows], cell_m)[0])
        if len(rows) >= FEWEST_OF_PASS and cells >= SPAN / CELL**2:
            found[int(number)] = float(away_m[rows].mean())
    return found


def _refusal(piece: BottomPiece, bow_m: float, covered: float, squares: Squares) -> str:
    """Return why a piece cannot serve; "" if it can."""
    if len(piece.passes) < squares.passes:
        return "heard in one pass" if piece.passes else "heard in part"
    if piece.slope_deg > STEEPEST_DEG:
        return f"steep, {piece.slope_deg:.0f}°"
    if piece.apart_m > squares.apart_m:
        return f"{DIFFER} by {1000 * piece.apart_m:.0f} mm"
    if piece.uneven_m > squares.uneven_m:
        return f"uneven, {1000 * piece.uneven_m:.0f} mm"
    if bow_m > squares.bow_m:
        return f"bent by {1000 * bow_m:.0f} mm"
    return f"only {100 * covered:.0f} % of it heard" if covered < COVERED else ""
