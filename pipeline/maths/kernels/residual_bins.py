"""Sums of residuals by bin and slot of time, as :func:`pipeline.maths.adjustment.residual_means.residual_sums` says."""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.kernels.compiled import LINE, MATRIX, NUMBERS, compiled

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@compiled((NUMBERS, LINE, LINE, LINE, MATRIX, LINE))
def add_residuals(
    code: Integers, weight: Array, v_m: Array, normalised: Array, sums: Array, largest: Array
) -> None:
    """Add residuals to the sums of their bins.

    Parameters
    ----------
    code : (n,) array
        The row of each residual in ``sums``.
    weight, v_m, normalised : (n,) arrays
        Weights p, residuals v, and their sizes |v| / σ.
    sums, largest : (m, 4) and (m,) arrays
        Added to: Σ p, Σ p v, number of points, Σ v²; the largest size.
    """
    for i in range(len(code)):
        row = sums[code[i]]
        row[0] += weight[i]
        row[1] += weight[i] * v_m[i]
        row[2] += 1.0
        row[3] += v_m[i] * v_m[i]
        largest[code[i]] = max(largest[code[i]], normalised[i])
