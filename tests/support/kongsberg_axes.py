"""Kongsberg's axes and angles: forward, starboard, down."""

import numpy as np

KONGSBERG_FROM_MBES = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def turned(roll_deg: float, pitch_deg: float, heading_deg: float) -> np.ndarray:
    """Rz(heading) Ry(pitch) Rx(roll)."""
    (cr, cp, ch), (sr, sp, sh) = (f(np.radians([roll_deg, pitch_deg, heading_deg])) for f in (np.cos, np.sin))
    return np.array(
        [
            [ch * cp, ch * sp * sr - sh * cr, ch * sp * cr + sh * sr],
            [sh * cp, sh * sp * sr + ch * cr, sh * sp * cr - ch * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
