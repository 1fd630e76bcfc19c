"""Steps of the block Cholesky factorisation that eliminates pose errors, (6, 6) a block: parts of the chains' loops."""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import compiled

Array = NDArray[np.float64]
N_POSE = 6  # numbers of a pose error


@compiled()
def factorised(block: Array) -> float:
    """Put the Cholesky factor L of A = L Lᵀ (6, 6) into the lower triangle; return log det A."""
    logarithm = 0.0
    for p in range(N_POSE):
        for q in range(p + 1):
            total = block[p, q]
            for k in range(q):
                total -= block[p, k] * block[q, k]
            if p == q:
                block[p, p] = np.sqrt(total)
                logarithm += 2 * np.log(block[p, p])
            else:
                block[p, q] = total / block[q, q]
    return logarithm


@compiled()
def substituted(factor: Array, lines: Array) -> None:
    """Put L⁻¹ B in the place of B (6, n)."""
    for p in range(N_POSE):
        for k in range(p):
            for column in range(lines.shape[1]):
                lines[p, column] -= factor[p, k] * lines[k, column]
        for column in range(lines.shape[1]):
            lines[p, column] /= factor[p, p]


@compiled()
def substituted_back(factor: Array, lines: Array) -> None:
    """Put L⁻ᵀ B in the place of B (6, n)."""
    for p in range(N_POSE - 1, -1, -1):
        for k in range(p + 1, N_POSE):
            for column in range(lines.shape[1]):
                lines[p, column] -= factor[k, p] * lines[k, column]
        for column in range(lines.shape[1]):
            lines[p, column] /= factor[p, p]


@compiled()
def less_product(left: Array, right: Array, lines: Array) -> None:
    """Take leftᵀ right away from ``lines`` (6, n)."""
    for k in range(N_POSE):
        for p in range(N_POSE):
            for column in range(lines.shape[1]):
                lines[p, column] -= left[k, p] * right[k, column]


@compiled()
def less_square(lines: Array, sums: Array) -> None:
    """Take linesᵀ lines of ``lines`` (6, y) away from ``sums`` (y, y)."""
    for p in range(len(sums)):
        of_row = sums[p]
        a, b, c, d, e, f = lines[0, p], lines[1, p], lines[2, p], lines[3, p], lines[4, p], lines[5, p]
        for q in range(len(sums)):
            swept = a * lines[0, q] + b * lines[1, q] + c * lines[2, q] + d * lines[3, q]
            of_row[q] -= swept + e * lines[4, q] + f * lines[5, q]


@compiled()
def is_zero(block: Array) -> bool:
    """Return whether all elements of a matrix are zero."""
    for row in range(block.shape[0]):
        for column in range(block.shape[1]):
            if block[row, column] != 0.0:
                return False
    return True
