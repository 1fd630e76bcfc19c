"""Rotations: elementary, exponential map, mounts and attitudes.

Convention everywhere: ``R_a_from_b`` turns coordinates in frame b into coordinates in frame a, ``v_a = R_a_from_b @
v_b``. Angles are radians; elementary rotations are right-handed. Stacks of rotations have shape (n, 3, 3).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BLOCK = 16_384  # number of rotations that are computed at a time: some MB


def rotation_x(angle_rad: float) -> Array:
    """Return the right-handed rotation (3, 3) about x.

    >>> (rotation_x(np.pi / 2) @ [0, 1, 0]).round(12)  # y turns towards z
    array([0., 0., 1.])
    """
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle_rad: float) -> Array:
    """Return the right-handed rotation (3, 3) about y: z turns towards x."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle_rad: float) -> Array:
    """Return the right-handed rotation (3, 3) about z: x turns towards y."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def skew(vector: Array) -> Array:
    """Return the cross-product matrix, ``skew(a) @ b = a x b``; (..., 3) -> (..., 3, 3)."""
    x, y, z = np.moveaxis(np.asarray(vector, dtype=np.float64), -1, 0)
    zero = np.zeros_like(x)
    return np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)


def exp_coefficients(squared_angle: Array) -> tuple[Array, Array]:
    """Return sin(t)/t and (1 - cos t)/t² for squared angles t²; below t = 1e-3 from series, exact to 1e-17."""
    small = squared_angle < 1e-6
    first = 1 - squared_angle / 6 + squared_angle**2 / 120
    second = 0.5 - squared_angle / 24 + squared_angle**2 / 720
    if np.all(small):
        return first, second
    t = np.sqrt(np.where(small, 1.0, squared_angle))
    return np.where(small, first, np.sin(t) / t), np.where(small, second, 2 * (np.sin(t / 2) / t) ** 2)


def exp_so3(rotation_vector: Array) -> Array:
    """Return the rotation of a rotation vector (Rodrigues).

    R = I + sin t / t · K + (1 - cos t) / t² · K², K = skew(vector), t its length; K² = v vᵀ - t² I.

    The patent (CN 105425246 B) writes I + K [0032]. That is not a rotation; at 1° it is wrong by 1.5e-4 of the range.
    (..., 3) -> (..., 3, 3).
    """
    vector = np.asarray(rotation_vector, dtype=np.float64)
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    first, second = exp_coefficients(x * x + y * y + z * z)
    R = np.empty((*vector.shape, 3))  # element by element: a third of the time of products of matrices
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        R[..., k, k] = 1 - second * (vector[..., i] ** 2 + vector[..., j] ** 2)
        symmetric, turn = second * vector[..., i] * vector[..., j], first * vector[..., k]
        R[..., i, j], R[..., j, i] = symmetric - turn, symmetric + turn
    return R


def log_so3(R: Array) -> Array:
    """Return the rotation vector (length in [0, pi]) of a rotation: inverse of :func:`exp_so3`.

    (..., 3, 3) -> (..., 3).

    The vector follows from the quaternion, which is computed from its largest component: exact near 0 and near pi.

    >>> log_so3(exp_so3(np.array([0.1, -0.2, 0.3]))).round(12)
    array([ 0.1, -0.2,  0.3])
    """
    quaternion = quaternion_from_rotation(R)
    vector, scalar = quaternion[..., 1:], quaternion[..., 0]
    length = np.linalg.norm(vector, axis=-1)
    angle = 2 * np.arctan2(length, scalar)
    small = length < 1e-9
    factor = np.where(small, 2.0, angle / np.where(small, 1.0, length))
    return np.asarray(vector * factor[..., None])


def quaternion_from_rotation(R: Array) -> Array:
    """Return the unit quaternion (w, x, y, z), w >= 0, of a rotation (..., 3, 3).

    Shepperd's method: the largest component comes from a square root, the others from products with it.
    """
    m = np.asarray(R, dtype=np.float64)
    if m.ndim == 3 and len(m) > BLOCK:
        return np.concatenate([quaternion_from_rotation(m[k : k + BLOCK]) for k in range(0, len(m), BLOCK)])
    trace = np.trace(m, axis1=-2, axis2=-1)
    diagonal = np.diagonal(m, axis1=-2, axis2=-1)
    squares = np.concatenate([(1 + trace)[..., None], 1 - trace[..., None] + 2 * diagonal], axis=-1)
    w = np.stack(
        [squares[..., 0], m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]], -1
    )
    sums = m + np.swapaxes(m, -1, -2)
    rows = [w]
    for i in range(3):
        row = [w[..., i + 1]] + [squares[..., i + 1] if i == j else sums[..., i, j] for j in range(3)]
        rows.append(np.stack(row, -1))
    candidates = np.stack(rows, -2)
    best = np.argmax(squares, axis=-1)
    chosen = np.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :]
    chosen = chosen / np.linalg.norm(chosen, axis=-1, keepdims=True)
    return np.asarray(chosen * np.where(chosen[..., :1] < 0, -1.0, 1.0))


def rotation_from_quaternion(quaternion: Array) -> Array:
    """Return the rotations (..., 3, 3) of unit quaternions (w, x, y, z)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def rotation_from_mount(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Array:
    """Return ``R_body_from_sensor`` (3, 3) = Rz(yaw) · Rx(pitch) · Ry(roll).

    Parameters
    ----------
    roll_rad, pitch_rad
        Roll (starboard down positive) and pitch (bow up positive).
    yaw_rad
        Yaw, counter-clockwise seen from above.
    """
    return rotation_z(yaw_rad) @ rotation_x(pitch_rad) @ rotation_y(roll_rad)


def mount_from_rotation(R_body_from_sensor: Array) -> tuple[float, float, float]:
    """Return (roll, pitch, yaw) in radians: inverse of :func:`rotation_from_mount`, pitch in [-pi/2, pi/2].

    The product Rz(y)·Rx(p)·Ry(r) has the third row (-cos p sin r, sin p, cos p cos r) and the second column
    (-sin y cos p, cos y cos p, sin p).
    """
    m = R_body_from_sensor
    pitch = np.arctan2(m[2, 1], np.hypot(m[2, 0], m[2, 2]))
    return float(np.arctan2(-m[2, 0], m[2, 2])), float(pitch), float(np.arctan2(-m[0, 1], m[1, 1]))


def mount_partials(R_body_from_sensor: Array) -> Array:
    """Return ∂(pitch, roll, yaw)/∂ε (3, 3) of R = Exp(ε) · Rz(yaw)·Rx(pitch)·Ry(roll), ε about body x, y, z.

    Each angle turns about its own axis in the body: pitch about Rz(yaw) e_x, roll about Rz(yaw) Rx(pitch) e_y, yaw
    about e_z. With these axes as the columns of A, ε = A (dpitch, droll, dyaw), and the partials are A⁻¹. At pitch =
    ±90° A has no inverse, because roll and yaw turn about one axis. For a mount near zero A⁻¹ is the identity; with yaw
    90° pitch and roll change places.
    """
    _, pitch, yaw = mount_from_rotation(R_body_from_sensor)
    turned = rotation_z(yaw)
    axes = np.column_stack([turned[:, 0], (turned @ rotation_x(pitch))[:, 1], [0.0, 0.0, 1.0]])
    return np.asarray(np.linalg.inv(axes))


def rotation_from_attitude(roll_rad: Array, pitch_rad: Array, azimuth_rad: Array) -> Array:
    """Return ``R_level_from_body`` = Rz(-azimuth) · Rx(pitch) · Ry(roll), (n,) each -> (n, 3, 3).

    Level is east, north, up; body starboard, forward, up (NovAtel SPAN, APN-037).

    Parameters
    ----------
    roll_rad, pitch_rad
        Roll (starboard down positive) and pitch (bow up positive), (n,) each.
    azimuth_rad
        Azimuth (n,), clockwise from true north.

    >>> rotation_from_attitude(np.zeros(1), np.zeros(1), np.array([np.pi / 2]))[0].round(12) @ [0, 1, 0]  # heading east
    array([1., 0., 0.])
    """
    cr, sr = np.cos(roll_rad), np.sin(roll_rad)
    cp, sp = np.cos(pitch_rad), np.sin(pitch_rad)
    ca, sa = np.cos(azimuth_rad), np.sin(azimuth_rad)
    return np.stack(
        [
            np.stack([ca * cr + sa * sp * sr, sa * cp, ca * sr - sa * sp * cr], -1),
            np.stack([-sa * cr + ca * sp * sr, ca * cp, -sa * sr - ca * sp * cr], -1),
            np.stack([-cp * sr, sp, cp * cr], -1),
        ],
        -2,
    )


def rotation_error(R_true: Array, R_found: Array) -> Array:
    """Return the error ε (3,) rad of an estimated rotation (3, 3), true minus estimated: R_true = Exp(ε) R_found."""
    return log_so3(R_true @ R_found.T)
