"""Points in the sonar's frame from travel time, receive angle and transmit tilt.

A Mills cross measures two angles of a ray u. The receiving array lies along x and its beam is a cone round x; the
transmitting array lies along y and its fan is a cone round y. The ray is the line in which the two cones meet,

    u = (s, p, -c),   s = sin θ,  p = sin τ,  c = √(1 - s² - p²)

with θ the angle of the receive beam (starboard +) and τ the tilt of the transmit fan (forward +), both from the arrays'
normal, -z; c < 0 where |θ| > 90°. With τ = 0 all beams lie in one plane. (Kongsberg's "beamAngleReRx" and
"tiltAngleReTx"; de Moustier 1993, "Signal processing for swath bathymetry and concurrent seafloor acoustic imaging".)
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.sonar.ray_tracing import Cast, trace

Array = NDArray[np.float64]
STEEPEST = 4.0  # upper bound of cos θ / c in :func:`across_beam`


def points_in_mbes(
    two_way_time_s: Array,
    angle_rad: Array,
    transmit_tilt_rad: Array,
    sound_speed_m_s: Array,
    *,
    true_sound_speed_m_s: float | None = None,
    projector_offset_m: Array | None = None,
) -> tuple[Array, NDArray[np.bool_]]:
    """Return points r u, (n, 3) m in frame mbes, and a mask (n,): true where the direction u exists.

    Sound speed does not only scale the ranges. Both arrays are flat: they set the slope of the wave front along
    themselves, sin θ / c and sin τ / c. With the speed c that the head used, the true speed c', and k = c' / c:
    r' = k r, sin θ' = k sin θ and sin τ' = k sin τ (R2Sonic manual on sound speed at the head; Snell's law at the
    array's face). Where these sines give s² + p² > 1, no direction exists.

    With the transmitter at o from the receiver, the path c t = |x - o| + |x| with x = r u gives
    r = (L² - |o|²) / (2 (L - o · u)), L = c t. Without an offset r = c t / 2.

    Parameters
    ----------
    two_way_time_s
        Two-way travel times (n,).
    angle_rad
        Angles θ (n,) of the receive beams, starboard positive.
    transmit_tilt_rad
        Tilts τ (n,) of the transmit fans, forward positive.
    sound_speed_m_s
        Sound speeds c (n,) that the head used.
    true_sound_speed_m_s
        Sound speed c'; None: c' = c.
    projector_offset_m
        Position o (3,) of the transmitter, frame mbes; None: no offset from the receiver.
    """
    speed = sound_speed_m_s if true_sound_speed_m_s is None else np.full_like(sound_speed_m_s, true_sound_speed_m_s)
    slopes = np.column_stack([np.sin(angle_rad), np.sin(transmit_tilt_rad)]) * (speed / sound_speed_m_s)[:, None]
    direction, valid = _intersection(slopes, np.where(np.abs(angle_rad) > np.pi / 2, 1.0, -1.0))
    path = speed * two_way_time_s
    if projector_offset_m is None:
        ranges = path / 2
    else:
        ranges = (path**2 - projector_offset_m @ projector_offset_m) / (2 * (path - direction @ projector_offset_m))
    return direction * ranges[:, None], valid


def _intersection(slopes: Array, side: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return unit vectors (n, 3) in which the cones of ``slopes`` (n, 2), s and p, meet, and a mask (n,).

    The sign of ``side`` (n,) is that of the vectors' z. The mask is true where the cones meet. Where they do not, the
    vector lies in the array's plane.
    """
    square = np.einsum("nk,nk->n", slopes, slopes)
    flat = slopes / np.sqrt(np.maximum(square, 1.0))[:, None]
    return np.column_stack([flat, np.copysign(np.sqrt(np.maximum(1.0 - square, 0.0)), side)]), square <= 1.0


def receive_angle(points_mbes_m: Array) -> Array:
    """Return the angle θ (n,) rad of the receive beams of points (n, 3) in frame mbes.

    >>> receive_angle(np.array([[1.0, 0.0, -1.0], [0.5, np.sqrt(0.5), -0.5]])).round(6)
    array([0.785398, 0.523599])
    """
    x, y, z = points_mbes_m.T
    return np.asarray(np.arctan2(x, np.copysign(np.hypot(y, z), -z)))


def refracted_points(
    points_mbes_m: Array, speed_m_s: Array, R_up_from_mbes: Array, depth_m: Array, cast: Cast
) -> Array:
    """Return the ends (n, 3) m of the rays, traced through a cast, in frame mbes.

    The flat arrays set sin θ / c and sin τ / c along themselves. So at the head's depth, where the cast has the speed
    c_cast, both sines are larger by k = c_cast / c. This holds if c is wrong, and also if c is right for a thin layer
    of other water at the arrays' faces. (A level layer would refract differently. But the fan of a tilted head looks
    along it, and any difference of the two speeds would turn rays by degrees.) From the head the ray is traced for the
    recorded time.

    Parameters
    ----------
    points_mbes_m
        Points (n, 3) of :func:`points_in_mbes`.
    speed_m_s
        Sound speeds (n,) with which these points were computed.
    R_up_from_mbes
        Rotations (n, 3, 3) into a frame with z up.
    depth_m
        Depths (n,) of the head.
    cast
        Sound speed by depth.
    """
    ranges = np.linalg.norm(points_mbes_m, axis=1)
    unit = points_mbes_m / ranges[:, None]
    directions, _ = _intersection(unit[:, :2] * (cast.speed_at(depth_m) / speed_m_s)[:, None], unit[:, 2])
    directions = np.einsum("nij,nj->ni", R_up_from_mbes, directions)
    across = np.hypot(directions[:, 0], directions[:, 1])
    reached, depth = trace(cast, depth_m, np.arctan2(across, -directions[:, 2]), ranges / speed_m_s)
    heading = directions[:, :2] / np.maximum(across, 1e-12)[:, None]
    ended = np.column_stack([heading * reached[:, None], depth_m - depth])
    return np.asarray(np.einsum("nji,nj->ni", R_up_from_mbes, ended))


def across_beam(x: Array, y: Array, z: Array) -> Array:
    """Return r ∂u/∂θ (3, n): the change of points with the angle of their receive beam, the tilt being fixed.

    From c² = 1 - s² - p² follows ∂u/∂θ = (q, 0, s q / c) with q = cos θ = ±√(p² + c²). Without tilt this is the unit
    vector (c, 0, s) across the fan. At the ends of a tilted fan, where the cones touch, c is 0; q / c is limited to
    STEEPEST.

    Parameters
    ----------
    x, y, z
        Coordinates (n,) of the points in frame mbes.
    """
    q = np.hypot(y, z)
    slope = np.minimum(q / np.maximum(np.abs(z), np.finfo(np.float64).tiny), STEEPEST)
    return np.stack([np.copysign(q, -z), np.zeros_like(x), x * slope])


def beam_half_widths(points_mbes_m: Array, across_rad: float, along_rad: float) -> tuple[Array, Array]:
    """Return the half axes of the beams at the points, (n, 3) m each in frame mbes: across track, and along track.

    The axis across is r ∂u/∂θ (:func:`across_beam`). The axis along is r ∂u/∂τ = r cos τ (0, 1, p / c), θ being fixed.
    Both are multiplied by the tangent of half the width.

    Parameters
    ----------
    points_mbes_m
        Points (n, 3) in frame mbes.
    across_rad, along_rad
        Full widths of the beams.
    """
    x, y, z = points_mbes_m.T
    across = across_beam(x, y, z).T * np.tan(across_rad / 2)
    along = across_beam(y, x, z)[[1, 0, 2]].T * np.tan(along_rad / 2)
    return across, along
