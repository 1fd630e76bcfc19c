"""A cast of sound speed, as rows and as CARIS writes it."""

from collections.abc import Sequence

import numpy as np

PROFILE = [(0.5, 1480.0), (1.0, 1480.3), (1.5, 1481.2), (2.0, 1481.0), (3.0, 1483.5)]  # nothing that thins
ROWS = "\n".join(f"{depth:.3f} {speed:.3f}" for depth, speed in PROFILE) + "\n"
CARIS = f"[SVP_VERSION_2]\na.svp\nSection 2026-132 09:30:05 -36:30:00.00 120:15:00.00\n{ROWS}"


def is_profile(svp: Sequence[Sequence[float]], expected: Sequence[Sequence[float]] = PROFILE) -> None:
    np.testing.assert_allclose(svp, expected, atol=1e-4)
