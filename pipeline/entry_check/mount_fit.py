"""The mount that a survey software worked with, from pairs of its soundings and the run's.

The software places a sounding at X = p + R_pool_from_body (R x + t) + s, with the run's x in frame mbes, the pose of
its time, the entered mount R, t, and a shift s of all positions (another height reference or datum; 0 if all is right).
In body axes, b = R_pool_from_bodyᵀ (X - p), this is

    b = k R x + t + R_pool_from_bodyᵀ s,

linear in t and s, and by R = Exp(ε) R_before linear in ε: ∂b/∂ε = -skew(k R x). The factor k of the ranges is 1 unless
the software works with another sound speed. The start is the rotation that turns the
points x best onto b (Kabsch 1976; Wahba's problem), and Gauss-Newton steps follow. Where the boat keeps one heading, t
and s can hardly be told apart: a weak prior of 0 on s leaves it in t.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.run_soundings import NS_PER_S, RunSoundings
from pipeline.maths.geometry.rotations import exp_so3

Array = NDArray[np.float64]
MAX_STEPS = 12
ENDED = 1e-9  # rad and m: a smaller step is the last
CUT = 4.0  # residuals beyond this number of robust sigmas get no weight (Tukey's function)
CLUSTER_S = 1.0  # residuals within it may have a common error
SIZE = 10  # ε, t, s, k
FREE_MOUNT, FREE_ALL = (True,) * 6 + (False,) * 4, (True,) * SIZE
LOOSE_M = 1e3  # of the weak prior, against a millimetre of each point


@dataclass(frozen=True)
class FittedMount:
    """A mount fitted to pairs.

    Attributes
    ----------
    R_body_from_mbes, lever_arm_m, shift_m
        R (3, 3), t (3,), s (3,) (pool frame).
    range_factor
        k.
    covariance
        (10, 10) of ε (rad, body axes), t, s (m) and k; rows of fixed parameters are 0.
    scatter_m
        Root of the mean squared residual of one coordinate, robust weights.
    weight
        (n,) robust weights of the pairs.
    """

    R_body_from_mbes: Array
    lever_arm_m: Array
    shift_m: Array
    range_factor: float
    covariance: Array
    scatter_m: float
    weight: Array

    def predicted(self, soundings: RunSoundings) -> Array:
        """Return where the software places soundings, (n, 3) m, pool frame."""
        return soundings.placed(self.range_factor * self.R_body_from_mbes, self.lever_arm_m) + self.shift_m


def best_rotation(x: Array, b: Array, weight: Array) -> tuple[Array, Array]:
    """Return R (3, 3) and t (3,) that minimise Σ w |b - R x - t|² (Kabsch 1976), points (n, 3)."""
    share = weight / weight.sum()
    middle_x, middle_b = share @ x, share @ b
    U, _, Vt = np.linalg.svd(((b - middle_b) * share[:, None]).T @ (x - middle_x))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return R, middle_b - R @ middle_x


def fit_mount(
    soundings: RunSoundings,
    points_pool_m: Array,
    free: tuple[bool, ...] = FREE_MOUNT,
    lever_arm_m: Array | None = None,
) -> FittedMount:
    """Return the mount, and the shift where it is free, that places the soundings at their pairs.

    Parameters
    ----------
    soundings
        n soundings of the run.
    points_pool_m
        (n, 3): where the software placed the same soundings.
    free
        Which of ε, t, s, k are estimated, SIZE in all; others keep their values: t those of ``lever_arm_m``, s 0, k 1.
    lever_arm_m
        Lever arm (3,) of the components that are not free.
    """
    x, b = soundings.points_mbes_m, soundings.in_body(points_pool_m)
    back = np.swapaxes(soundings.R_pool_from_body, -1, -2)
    used = np.array(free)
    R, t = best_rotation(x, b, np.ones(len(x)))
    if lever_arm_m is not None:
        t = np.where(used[3:6], t, lever_arm_m)
    s, k, weight, moved = np.zeros(3), 1.0, np.ones(len(x)), np.inf
    normal, design = np.eye(SIZE), np.empty((len(x), 3, SIZE))
    residual, variance = b, 1.0
    for step in range(MAX_STEPS + 1):
        turned = k * x @ R.T
        residual = b - turned - t - back @ s
        weight = _tukey(np.linalg.norm(residual, axis=1))
        variance = float(weight @ np.einsum("ni,ni->n", residual, residual)) / (3 * weight.sum())
        design = _design(turned, back)[:, :, used]
        normal = np.einsum("nik,n,nil->kl", design, weight, design, optimize=True)
        normal += np.diag(np.r_[np.zeros(6), np.full(3, max(variance, 1e-6) / LOOSE_M**2), 0.0][used])
        if moved < ENDED or step == MAX_STEPS:
            break
        right = np.einsum("nik,n,ni->k", design, weight, residual, optimize=True)
        right -= np.r_[np.zeros(6), max(variance, 1e-6) / LOOSE_M**2 * s, 0.0][used]
        delta = np.zeros(SIZE)
        delta[used] = np.linalg.lstsq(normal, right, rcond=1e-14)[0]
        R, t, s, k = exp_so3(delta[:3]) @ R, t + delta[3:6], s + delta[6:9], k * (1 + delta[9])
        moved = float(np.abs(delta).max())
    covariance = np.zeros((SIZE, SIZE))
    covariance[np.ix_(used, used)] = _covariance(design, weight, residual, normal, soundings.t_ns)
    return FittedMount(R, t, s, k, covariance, float(np.sqrt(variance)), weight)


def _design(turned: Array, back: Array) -> Array:
    """Return ∂b/∂(ε, t, s, log k), (n, 3, SIZE): -skew(k R x), the identity, R_pool_from_bodyᵀ, k R x."""
    n, (x, y, z) = len(turned), turned.T
    zero = np.zeros(n)
    by_turn = np.stack([np.stack([zero, z, -y], -1), np.stack([-z, zero, x], -1), np.stack([y, -x, zero], -1)], -2)
    return np.concatenate([by_turn, np.broadcast_to(np.eye(3), (n, 3, 3)), back, turned[:, :, None]], axis=2)


def _tukey(lengths: Array) -> Array:
    """Return weights (n,), 0 beyond CUT robust sigmas: the median length of a vector is 1.54 sigmas of a coordinate."""
    limit = CUT * max(float(np.median(lengths)) / 1.538, 1e-6) * np.sqrt(3)
    return np.asarray(np.maximum(1 - (lengths / limit) ** 2, 0.0) ** 2)


def _covariance(design: Array, weight: Array, residual: Array, normal: Array, t_ns: NDArray[np.int64]) -> Array:
    """Return N⁻¹ (Σ g gᵀ) N⁻¹, with g the sums of Aᵀ w r over each CLUSTER_S (Liang and Zeger 1986).

    It holds also where residuals within a cluster have a common error.
    """
    cluster = np.unique(t_ns // round(CLUSTER_S * NS_PER_S), return_inverse=True)[1]
    scores = np.einsum("nik,n,ni->nk", design, weight, residual, optimize=True)
    sums = np.stack([np.bincount(cluster, column) for column in scores.T], axis=1)
    clusters = len(sums)
    inverse = np.linalg.pinv(normal, rcond=1e-14, hermitian=True)
    return np.asarray(inverse @ (sums.T @ sums) @ inverse * clusters / max(clusters - 1, 1))
