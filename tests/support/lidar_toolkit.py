"""Rotations as CIDCO's LidarToolkit writes them: level north, west, up, body forward, port, up, pitch + is bow down."""

import numpy as np


def dcm_nwu(roll: float, pitch: float, heading: float) -> np.ndarray:
    """As written in LidarToolkit's getDCM (scripts/SphereCalibrationOctave), for angles and boresight alike."""
    cr, sr, cp, sp, ch, sh = (f(a) for a in (roll, pitch, heading) for f in (np.cos, np.sin))
    return np.array(
        [
            [cp * ch, cr * sh + sr * sp * ch, -sr * sh + cr * sp * ch],
            [-cp * sh, ch * cr - sr * sp * sh, -sr * ch - cr * sp * sh],
            [-sp, sr * cp, cr * cp],
        ]
    )
