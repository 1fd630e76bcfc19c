"""Two arrays that are not exactly at right angles: the transmit tilt as the receiving array's frame has it.

Frame ``mbes`` is the receiving array's, in which a ray is u = (s, p, -c) (:mod:`pipeline.maths.sonar.soundings`). A
transmitter with installation angles of its own lies along the unit vector t, not along y: its fan of tilt τ is the cone
u · t = sin τ. The ray is where that cone meets the receive beam's, s = sin θ. With w = sin τ, a = w - s t_x and
n = t_y² + t_z²,

    p t_y - c t_z = a,   p² + c² = 1 - s²

is a line across a circle: with D = n (1 - s²) - a² the points where they meet are

    p = (a t_y ± t_z √D) / n,   c = (± t_y √D - a t_z) / n

and the one on the beam's side of the array, c > 0 below it, has the sign of t_y. Its arcsin p is the tilt of a fan
round y with the same ray. For t = (0, -1, 0), a transmitter mounted the other way round, it is -τ.
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
