"""Loops of :mod:`pipeline.maths.adjustment.eliminate_white_noise`: its intervals added up, its records eliminated.

The unknowns are the records' noise divided by its standard deviations. So their prior is the unit matrix, and a
standard deviation of zero is no special case. y = (x, knot before, knot after, v) are the columns that remain.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.block_cholesky import (
    N_POSE,
    factorised,
    is_zero,
    less_product,
    less_square,
    substituted,
)
from pipeline.maths.kernels.compiled import CUBE, CUBES, LINE, MATRIX, NUMBERS, compiled, named

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
N_MOVED = 3  # features on which a pose error acts
LINEAR = (NUMBERS, CUBE, MATRIX, MATRIX, CUBE, MATRIX)  # sides, design, pose, by_knot, normal, right


class ChainScratch(NamedTuple):
    """Scratch memory: of_features (F, m + 1); of_moved (2, 3, m + 1); of_pose (2, 6, m + 1); squares (3, 6, 6)."""

    of_features: Array
    of_moved: Array
    of_pose: Array
    squares: Array


SCRATCH = named(ChainScratch, MATRIX, CUBE, CUBE, CUBE)


def chain_scratch(features: int, parameters: int) -> ChainScratch:
    """Return the scratch memory for designs of so many rows and columns."""
    width = parameters + 1
    return ChainScratch(
        of_features=np.empty((features, width)),
        of_moved=np.empty((2, N_MOVED, width)),
        of_pose=np.empty((2, N_POSE, width)),
        squares=np.empty((3, N_POSE, N_POSE)),
    )


@compiled()
def _of_pose(K: Array, factor: Array, product: Array) -> None:
    """Write Kᵀ M K (6, 6) of the first three rows and columns M of ``factor``."""
    for p in range(N_POSE):
        for q in range(N_POSE):
            total = 0.0
            for b in range(N_MOVED):
                for c in range(N_MOVED):
                    total += K[b, p] * factor[b, c] * K[c, q]
            product[p, q] = total


@compiled()
def _by_pose(K: Array, factor: Array, product: Array) -> None:
    """Write Kᵀ B (6, m) of the first three rows B of ``factor``."""
    for p in range(N_POSE):
        for column in range(factor.shape[1]):
            total = 0.0
            for b in range(N_MOVED):
                total += K[b, p] * factor[b, column]
            product[p, column] = total


@compiled()
def _by_parameters(normal: Array, design: Array, right: Array, product: Array) -> None:
    """Write normal @ design and, as last column, the right side: rows (f, F) of the features by (x, v)."""
    m = design.shape[1]
    for f in range(len(product)):
        product[f] = 0.0
        product[f, m] = right[f]
        for h in range(len(design)):
            for column in range(m):
                product[f, column] += normal[f, h] * design[h, column]


@compiled((CUBE, NUMBERS, *LINEAR, LINE, SCRATCH))
def add_intervals(
    sums: Array, span: Integers, sides: Integers, design: Array, pose: Array, by_knot: Array,
    normal: Array, right: Array, squares: Array, scratch: ChainScratch,
) -> None:  # fmt: skip
    """Add intervals of one sensor on one surface to the normal equations of their spans.

    The design of an interval is C in the columns of x, and b K and a K in those of the knots before and after it, in
    the rows of the features on which a pose error acts.

    Parameters
    ----------
    sums : (j, y, y) array
        The spans' normal equations, added to; in the rows of x and v the columns of the knots stay zero.
    span : (g,) array
        Place of each interval's span in ``sums``.
    sides : (m + 1,) array
        Columns of the design's parameters and of v in y.
    design, pose : (g, F, m) and (3, 6) arrays
        C of each interval, K of the surface.
    by_knot : (g, 2) array
        The shares b and a of the knots.
    normal, right, squares : (g, F, F), (g, F) and (g,) arrays
        Sums over the points of each interval.
    """
    features, m = design.shape[1:]
    v = sums.shape[1] - 1
    knots = v - 2 * N_POSE
    seen, moved, square = scratch.of_features, scratch.of_pose[0], scratch.squares[0]
    for i in range(len(span)):
        to = sums[span[i]]
        _by_parameters(normal[i], design[i], right[i], seen)
        for f in range(features):
            for row in range(m):
                factor = design[i, f, row]
                if factor != 0.0:
                    for column in range(m + 1):
                        to[sides[row], sides[column]] += factor * seen[f, column]
        for row in range(m):
            to[v, sides[row]] = to[sides[row], v]
        to[v, v] += squares[i]
        _by_pose(pose, seen, moved)
        _of_pose(pose, normal[i], square)
        for knot in range(2):
            first = knots + knot * N_POSE
            for row in range(N_POSE):
                for column in range(m + 1):
                    to[first + row, sides[column]] += by_knot[i, knot] * moved[row, column]
                for other in range(2):
                    share = by_knot[i, knot] * by_knot[i, other]
                    for column in range(N_POSE):
                        to[first + row, knots + other * N_POSE + column] += share * square[row, column]


@compiled((CUBES, CUBES, CUBES, NUMBERS, NUMBERS, *LINEAR, CUBE, MATRIX, CUBE, SCRATCH))
def add_records(
    own: Array, ahead: Array, border: Array, span: Integers, record: Integers, sides: Integers, design: Array,
    pose: Array, by_knot: Array, normal: Array, right: Array, swept: Array, right_swept: Array, swept_twice: Array,
    scratch: ChainScratch,
) -> None:  # fmt: skip
    """Add intervals of one sensor on one surface to the blocks of the records before and after each.

    Parameters
    ----------
    own, ahead : (j, l, 6, 6) arrays
        Blocks of each record with itself and with the next one, added to.
    border : (j, l, 6, y) array
        Blocks of each record with y, added to.
    span, record : (g,) arrays
        Place of each interval's span, and of the record before it in the span.
    sides, design, pose, by_knot, normal, right
        As for :func:`add_intervals`.
    swept, right_swept, swept_twice : (g, 3, F), (g, 3) and (g, 3, 3) arrays
        Sums with s and s², the share of the step from record to record (``interval_sums``).
    """
    m = design.shape[2]
    v = border.shape[3] - 1
    knots = v - 2 * N_POSE
    features, later = scratch.of_moved[0], scratch.of_moved[1]
    whole_x, later_x = scratch.of_pose[0], scratch.of_pose[1]
    whole, once, twice = scratch.squares[0], scratch.squares[1], scratch.squares[2]
    for i in range(len(span)):
        j, k = span[i], record[i]
        _by_parameters(normal[i], design[i], right[i], features)
        _by_parameters(swept[i], design[i], right_swept[i], later)
        _by_pose(pose, features, whole_x)
        _by_pose(pose, later, later_x)
        _of_pose(pose, normal[i], whole)
        _of_pose(pose, swept[i], once)
        _of_pose(pose, swept_twice[i], twice)
        for p in range(N_POSE):
            for q in range(N_POSE):  # sums with (1 - s)², s² and (1 - s) s
                own[j, k, p, q] += whole[p, q] - 2 * once[p, q] + twice[p, q]
                own[j, k + 1, p, q] += twice[p, q]
                ahead[j, k, p, q] += once[p, q] - twice[p, q]
                for knot in range(2):  # sums with 1 - s and s
                    column = knots + knot * N_POSE + q
                    border[j, k, p, column] += by_knot[i, knot] * (whole[p, q] - once[p, q])
                    border[j, k + 1, p, column] += by_knot[i, knot] * once[p, q]
            for column in range(m + 1):
                border[j, k, p, sides[column]] += whole_x[p, column] - later_x[p, column]
                border[j, k + 1, p, sides[column]] += later_x[p, column]


@compiled((CUBES, CUBES, CUBES, LINE, CUBE, LINE))
def eliminate_records(
    own: Array, ahead: Array, border: Array, white: Array, sums: Array, log_determinant: Array
) -> None:  # fmt: skip
    """Eliminate the records of each span, one after the other (block Cholesky); write the spans' log det (j,).

    With the factors L of the blocks A that remain, A = L Lᵀ, and L⁻¹ B in the place of the border's B, the records
    leave N - Σ (L⁻¹ B)ᵀ L⁻¹ B of the normal equations N of y. Blocks are overwritten. A record that no interval touches
    has A = I and B = 0.

    Parameters
    ----------
    own, ahead, border : (j, l, 6, 6), (j, l, 6, 6) and (j, l, 6, y) arrays
        Blocks by unscaled noise.
    white : (6,) array
        Standard deviations of a record's noise, m and rad.
    sums : (j, y, y) array
        The spans' normal equations N, reduced in place.
    """
    spans, length = own.shape[:2]
    for j in range(spans):
        log_determinant[j] = 0.0
        linked = False
        for k in range(length):
            block, lines, following = own[j, k], border[j, k], ahead[j, k]
            if not linked and is_zero(block):
                continue
            for p in range(N_POSE):
                for q in range(N_POSE):
                    block[p, q] *= white[p] * white[q]
                    following[p, q] *= white[p] * white[q]
                block[p, p] += 1.0
                for column in range(lines.shape[1]):
                    lines[p, column] *= white[p]
            if linked:  # what the record before leaves
                less_product(ahead[j, k - 1], ahead[j, k - 1], block)
                less_product(ahead[j, k - 1], border[j, k - 1], lines)
            log_determinant[j] += factorised(block)
            substituted(block, lines)
            less_square(lines, sums[j])
            linked = not is_zero(following)
            if linked:
                substituted(block, following)
