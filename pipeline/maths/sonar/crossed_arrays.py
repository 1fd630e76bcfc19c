"""Two arrays that are not exactly at right angles: the transmit tilt, expressed in the receiving array's frame.

Frame ``mbes`` is the receiving array's, in which a ray is u = (s, p, -c) (:mod:`pipeline.maths.sonar.soundings`). A
transmitter with installation angles of its own lies along the unit vector t, not along y. Its fan of tilt τ is the cone
u · t = sin τ. The ray is the line in which that cone meets the receive beam's cone, s = sin θ. With w = sin τ,
a = w - s t_x and n = t_y² + t_z²,

    p t_y - c t_z = a,   p² + c² = 1 - s²

are a line and a circle. With D = n (1 - s²) - a² they meet at the points

    p = (a t_y ± t_z √D) / n,   c = (± t_y √D - a t_z) / n

The ray is the one on the beam's side of the array: below the array, c > 0, the sign ± is the sign of t_y; above the
array it is the opposite. The tilt of a fan round y with the same ray is arcsin p. For t = (0, -1, 0), a transmitter
turned round by 180°, this tilt is -τ.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def tilt_in_mbes(angle_rad: Array, tilt_rad: Array, axis_mbes: Array) -> Array:
    """Return the tilts (n,) rad round y of the rays of two crossed arrays; NaN where the cones do not meet.

    Parameters
    ----------
    angle_rad
        Angles θ (n,) of the receive beams.
    tilt_rad
        Tilts τ (n,) of the transmit fans, about the transmitter's own axis.
    axis_mbes
        Forward axes t (n, 3) of the transmitter in frame mbes.

    >>> axes = np.array([[0.0, -1.0, 0.0], [0.0, np.cos(0.2), np.sin(0.2)]])  # turned round; forward end up
    >>> tilt_in_mbes(np.zeros(2), np.full(2, 0.01), axes).round(6)
    array([-0.01,  0.21])
    """
    s, w = np.sin(angle_rad), np.sin(tilt_rad)
    x, y, z = axis_mbes.T
    side = np.where(np.abs(angle_rad) > np.pi / 2, -1.0, 1.0) * np.sign(y)
    a, n = w - s * x, y**2 + z**2
    with np.errstate(invalid="ignore"):
        root = np.sqrt(n * (1 - s**2) - a**2)
        return np.asarray(np.arcsin((a * y + side * z * root) / n))
