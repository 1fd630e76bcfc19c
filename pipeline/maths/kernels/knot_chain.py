"""Loops of :mod:`pipeline.maths.adjustment.eliminate_drift`: the blocks of the knots, and the knots eliminated.

The unknowns are the drift at the knots divided by its standard deviations. The columns that remain are (x, v).
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.block_cholesky import (
    N_POSE,
    factorised,
    less_product,
    less_square,
    substituted,
    substituted_back,
)
from pipeline.maths.kernels.compiled import CUBE, LINE, MATRIX, compiled

Array = NDArray[np.float64]


@compiled((CUBE, LINE, CUBE, CUBE, CUBE))
def add_spans(spans: Array, scale: Array, own: Array, ahead: Array, border: Array) -> None:
    """Add what the observations of each span say of its two knots to the knots' blocks.

    Parameters
    ----------
    spans : (k - 1, 12, u + 13) array
        Rows of each span's two knots by (x, knot before, knot after, v).
    scale : (6,) array
        Standard deviations of the drift, m and rad.
    own, ahead, border : (k, 6, 6), (k - 1, 6, 6) and (k, 6, u + 1) arrays
        Blocks of each knot with itself, with the next one, and with (x, v); added to.
    """
    u = border.shape[2] - 1
    for j in range(len(spans)):
        for p in range(N_POSE):
            before, after = spans[j, p], spans[j, N_POSE + p]
            for q in range(N_POSE):
                factor = scale[p] * scale[q]
                own[j, p, q] += factor * before[u + q]
                ahead[j, p, q] += factor * before[u + N_POSE + q]
                own[j + 1, p, q] += factor * after[u + N_POSE + q]
            for column in range(u):
                border[j, p, column] += scale[p] * before[column]
                border[j + 1, p, column] += scale[p] * after[column]
            border[j, p, u] += scale[p] * before[u + 2 * N_POSE]
            border[j + 1, p, u] += scale[p] * after[u + 2 * N_POSE]


@compiled((CUBE, CUBE, CUBE, MATRIX, LINE))
def eliminate_knots(own: Array, ahead: Array, border: Array, sums: Array, log_determinant: Array) -> None:
    """Eliminate the knots, one after the other (block Cholesky); write the log det of their matrix A.

    With A = L Lᵀ and the border B, the knots leave N - (L⁻¹ B)ᵀ L⁻¹ B of the normal equations N of (x, v).

    Parameters
    ----------
    own, ahead : (k, 6, 6) and (k - 1, 6, 6) arrays
        The blocks of A; overwritten by those of L on the diagonal, and of Lᵀ beside it.
    border : (k, 6, u + 1) array
        B; overwritten by A⁻¹ B, which is minus the knots by (x, v).
    sums : (u + 1, u + 1) array
        N, reduced in place.
    log_determinant : (1,) array
        Written.
    """
    last = len(own) - 1
    log_determinant[0] = 0.0
    for k in range(last + 1):
        if k > 0:  # what the knot before leaves
            less_product(ahead[k - 1], ahead[k - 1], own[k])
            less_product(ahead[k - 1], border[k - 1], border[k])
        log_determinant[0] += factorised(own[k])
        substituted(own[k], border[k])
        less_square(border[k], sums)
        if k < last:
            substituted(own[k], ahead[k])
    for k in range(last, -1, -1):
        if k < last:
            for p in range(N_POSE):
                for q in range(N_POSE):
                    for column in range(border.shape[2]):
                        border[k, p, column] -= ahead[k, p, q] * border[k + 1, q, column]
        substituted_back(own[k], border[k])
