"""From travel time and angle to a point in the sonar's frame."""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.ray_tracing import Cast, trace

Array = NDArray[np.float64]


def points_in_mbes(
    two_way_time_s: Array,
    angle_rad: Array,
    sound_speed_m_s: Array,
    true_sound_speed_m_s: float | None = None,
    projector_offset_m: Array | None = None,
) -> tuple[Array, NDArray[np.bool_]]:
    """Points r (sin θ, 0, -cos θ), (n, 3) m in frame mbes, and which of them are possible; inputs (n,).

    Sound speed is not only a scale of ranges. The receiving array is flat: it measures the slope of the wave front
    along itself, sin θ / c. With the speed c the head worked with and the true speed c', k = c' / c:
    r' = k r and sin θ' = k sin θ (R2Sonic manual on sound speed at the head; Snell's law at the array's face).
    Where k sin θ exceeds 1 no such direction exists.

    ``projector_offset_m`` o (3,): the transmitter in the mbes frame, when ranges are to be counted from it: the path
    c t = |x - o| + |x| with x = r u gives r = (L² - |o|²) / (2 (L - o · u)), L = c t. None: range = c t / 2.
    """
    speed = sound_speed_m_s if true_sound_speed_m_s is None else np.full_like(sound_speed_m_s, true_sound_speed_m_s)
    sine = np.sin(angle_rad)
    if true_sound_speed_m_s is not None:
        sine = sine * (true_sound_speed_m_s / sound_speed_m_s)
    valid = np.abs(sine) <= 1.0
    sine = np.clip(sine, -1.0, 1.0)
    cosine = np.where(np.abs(angle_rad) > np.pi / 2, -1.0, 1.0) * np.sqrt(1.0 - sine**2)
    if true_sound_speed_m_s is None:
        cosine = np.cos(angle_rad)
    direction = np.column_stack([sine, np.zeros_like(sine), -cosine])
    path = speed * two_way_time_s
    if projector_offset_m is None:
        ranges = path / 2
    else:
        ranges = (path**2 - projector_offset_m @ projector_offset_m) / (2 * (path - direction @ projector_offset_m))
    return direction * ranges[:, None], valid


def traced(
    points_mbes_m: Array, speed_m_s: Array, R_up_from_mbes: Array, depth_m: Array, cast: Cast
) -> Array:
    """Points (n, 3) m in the mbes frame, as :func:`points_in_mbes` gives them, where the rays really end.

    ``speed_m_s`` (n,): that with which they were made; R_up_from_mbes (n, 3, 3) into a frame with z up; the head's
    depth (n,) m. The flat array measures sin θ / c along itself, so that in the water that the cast says to be at the
    head's depth sin θ' = k sin θ, k = c_cast / c: whether c is wrong, or right for a thin layer of other water at the
    array's face. (A layer that lies level would refract otherwise; but the fan of a tilted head looks along it, where
    any difference of the two speeds would turn rays by degrees.) From there the ray is traced for the recorded time.
    """
    ranges = np.linalg.norm(points_mbes_m, axis=1)
    sine, level, cosine = (points_mbes_m / ranges[:, None]).T
    sine = np.clip(sine * cast.speed_at(depth_m) / speed_m_s, -1.0, 1.0)
    cosine = np.copysign(np.sqrt(np.maximum(1 - sine**2 - level**2, 0.0)), cosine)
    directions = np.einsum("nij,nj->ni", R_up_from_mbes, np.column_stack([sine, level, cosine]))
    across = np.hypot(directions[:, 0], directions[:, 1])
    reached, depth = trace(cast, depth_m, np.arctan2(across, -directions[:, 2]), ranges / speed_m_s)
    heading = directions[:, :2] / np.maximum(across, 1e-12)[:, None]
    ended = np.column_stack([heading * reached[:, None], depth_m - depth])
    return np.asarray(np.einsum("nji,nj->ni", R_up_from_mbes, ended))


def beam_half_widths(points_mbes_m: Array, across_rad: float, along_rad: float) -> tuple[Array, Array]:
    """Half axes of the beams at the points, (n, 3) m each in frame mbes: across track, and along track (y).

    For u = (sin θ, 0, -cos θ) the across-track unit vector is du/dθ = (cos θ, 0, sin θ); length = range · tan(half
    width). Arguments are full widths.
    """
    x, _, z = points_mbes_m.T
    zero = np.zeros_like(x)
    across = np.column_stack([-z, zero, x]) * np.tan(across_rad / 2)
    ranges = np.linalg.norm(points_mbes_m, axis=1)
    along = np.column_stack([zero, ranges, zero]) * np.tan(along_rad / 2)
    return across, along
