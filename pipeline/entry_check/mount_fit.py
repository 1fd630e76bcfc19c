"""The mount that a survey software worked with, from pairs of its soundings and the run's.

The software places a sounding at X = p + R_pool_from_body (k R x + t) + s, with the run's x in frame mbes, the pose p,
R_pool_from_body of a time that is later than the sounding's by d, the entered mount R, t, a shift s of all positions
(another height reference or datum), and a factor k of the ranges (another sound speed); s = 0, k = 1, d = 0 if all is
right. In body axes, b(d) = R_pool_from_bodyᵀ (X - p), this is

    b(d) = k R x + t + R_pool_from_bodyᵀ s,

linear in t and s, and by R = Exp(ε) R_before linear in ε: ∂b/∂ε = -skew(k R x); ∂b/∂d is a difference of poses. The
start is the rotation that turns the points x best onto b (Kabsch 1976; Wahba's problem), and Gauss-Newton steps follow.
Where the boat keeps one heading, t and s can hardly be told apart: a weak prior of 0 on s leaves it in t.

The variances are the largest of three: those of residuals which have a common error within a second (Liang and Zeger
1986); those of the leave-one-out of whole passes (:mod:`pipeline.entry_check.leave_one_out`), which also sees rays and
positions that differ from pass to pass; and σ² N⁻¹, which alone grows where seconds and passes are too few.

Pairs that the robust weights leave out may have been placed with another mount than the rest, such as those of a pass
that was processed before the values were entered. Their scatter is told apart.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.entry_check.leave_one_out import leave_one_out, time_groups
from pipeline.entry_check.run_soundings import NS_PER_S, RunSoundings
from pipeline.maths.geometry.rotations import exp_so3

Array = NDArray[np.float64]
MAX_STEPS = 12
ENDED = 1e-9  # rad and m: a smaller step is the last
CUT = 4.0  # residuals beyond this number of robust sigmas get no weight (Tukey's function)
CLUSTER_S = 1.0  # residuals within it may have a common error
OF_SIGMA = 1.538  # median length of a vector whose three coordinates have the sigma 1
LEAST_LEFT_OUT, LEAST_PINGS = 0.02, 10  # share and pings of pairs without weight that are asked for another mount
WEAKEST = 1e-14  # eigenvalue of N by its largest: below lies rounding alone
NAMES = ("rx", "ry", "rz", "x", "y", "z", "shift_x", "shift_y", "shift_z", "k", "delay")
SIZE = len(NAMES)
LOOSE_M = 1e3  # of the weak prior, against a millimetre of each point
STEP_S = 0.005  # of the difference of poses
SCAN_S = tuple(0.0025 * np.arange(-12, 13))
SCANNED = 1000  # soundings


def freed(*names: str) -> tuple[bool, ...]:
    """Return which parameters are estimated: the mount's six, and those of these names."""
    return tuple(place < 6 or name in names for place, name in enumerate(NAMES))


FREE_MOUNT, FREE_ALL = freed(), freed("shift_x", "shift_y", "shift_z", "k")


@dataclass(frozen=True)
class FittedMount:
    """A mount fitted to pairs.

    Attributes
    ----------
    R_body_from_mbes, lever_arm_m, shift_m
        R (3, 3), t (3,), s (3,) (pool frame).
    range_factor, delay_s
        k, d.
    covariance
        (SIZE, SIZE) of ε (rad, body axes), t, s (m), log k and d (s); rows of fixed parameters are 0.
    scatter_m
        Root of the mean squared residual of one coordinate, robust weights.
    weight
        (n,) robust weights of the pairs.
    left_out_m
        The same scatter of pairs that the weights leave out, and that another mount explains; 0: there are none.
    """

    R_body_from_mbes: Array
    lever_arm_m: Array
    shift_m: Array
    range_factor: float
    covariance: Array
    scatter_m: float
    weight: Array
    delay_s: float = 0.0
    left_out_m: float = 0.0

    def predicted(self, soundings: RunSoundings) -> Array:
        """Return where the software places soundings, (n, 3) m, pool frame."""
        if self.delay_s:
            soundings = soundings.later(self.delay_s)
        return soundings.placed(self.range_factor * self.R_body_from_mbes, self.lever_arm_m) + self.shift_m


def best_rotation(x: Array, b: Array, weight: Array) -> tuple[Array, Array]:
    """Return R (3, 3) and t (3,) that minimise Σ w |b - R x - t|² (Kabsch 1976), points (n, 3)."""
    share = weight / weight.sum()
    middle_x, middle_b = share @ x, share @ b
    U, _, Vt = np.linalg.svd(((b - middle_b) * share[:, None]).T @ (x - middle_x))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return R, middle_b - R @ middle_x


def fit_mount(
    soundings: RunSoundings, points_pool_m: Array, free: tuple[bool, ...] = FREE_MOUNT, delay_s: float = 0.0
) -> FittedMount:
    """Return the mount, and whatever else is free, that places the soundings at their pairs.

    Parameters
    ----------
    soundings
        n soundings of the run.
    points_pool_m
        (n, 3): where the software placed the same soundings.
    free
        Which of ε, t, s, k, d are estimated, SIZE in all; others keep their values: s 0, k 1, d ``delay_s``.
    delay_s
        Value of d from which the search begins.
    """
    used, d, recorded = np.array(free), delay_s, soundings
    soundings = recorded.later(d) if d else recorded
    x, b = soundings.points_mbes_m, soundings.in_body(points_pool_m)
    R, t = best_rotation(x, b, np.ones(len(x)))
    s, k, weight, moved = np.zeros(3), 1.0, np.ones(len(x)), np.inf
    normal, design, residual, variance = np.eye(SIZE), np.empty((len(x), 3, SIZE)), b, 1.0
    for step in range(MAX_STEPS + 1):
        turned, back = k * x @ R.T, np.swapaxes(soundings.R_pool_from_body, -1, -2)
        residual = b - turned - t - back @ s
        weight = _tukey(np.linalg.norm(residual, axis=1))
        variance = float(weight @ np.einsum("ni,ni->n", residual, residual)) / (3 * weight.sum())
        by_delay = _by_delay(recorded, points_pool_m, d) if used[-1] else np.zeros_like(b)
        design = _design(turned, back, by_delay)[:, :, used]
        normal = np.einsum("nik,n,nil->kl", design, weight, design, optimize=True)
        loose = max(variance, 1e-6) / LOOSE_M**2 * np.repeat([0.0, 1.0, 0.0], [6, 3, 2])
        normal += np.diag(loose[used])
        if moved < ENDED or step == MAX_STEPS:
            break
        right = np.einsum("nik,n,ni->k", design, weight, residual, optimize=True)
        right -= (loose * np.r_[np.zeros(6), s, np.zeros(2)])[used]
        delta = np.zeros(SIZE)
        delta[used] = np.linalg.lstsq(normal, right, rcond=1e-14)[0]
        R, t, s, k = exp_so3(delta[:3]) @ R, t + delta[3:6], s + delta[6:9], k * np.exp(delta[9])
        moved = float(np.abs(delta).max())
        if used[-1]:
            d += float(delta[10])
            soundings = recorded.later(d)
            b = soundings.in_body(points_pool_m)
    covariance = np.zeros((SIZE, SIZE))
    covariance[np.ix_(used, used)] = _covariance(design, weight, residual, normal, recorded.t_ns, variance)
    left_out_m = _left_out_m(x, b, residual, weight, recorded.t_ns)
    return FittedMount(R, t, s, k, covariance, float(np.sqrt(variance)), weight, d, left_out_m)


def fit_delay(soundings: RunSoundings, points_pool_m: Array, names: tuple[str, ...], delay_s: float) -> FittedMount:
    """Return the mount with the delay of the software's poses; ``names``: what else is free, ``delay_s``: a start.

    Poses have noise from record to record. So the scatter falls sharply within one record of the true delay alone, and
    around it hardly: steps end anywhere there, and a scan finds it.
    """
    late = fit_mount(soundings, points_pool_m, freed(*names, "delay"), delay_s)
    some = np.arange(0, len(points_pool_m), max(1, len(points_pool_m) // SCANNED))
    thin, there = soundings.rows(some), points_pool_m[some]
    near = [fit_mount(thin, there, freed(*names), late.delay_s + step) for step in SCAN_S]
    best = min(near, key=lambda one: one.scatter_m)
    again = fit_mount(soundings, points_pool_m, freed(*names, "delay"), best.delay_s)
    return min((again, late), key=lambda one: one.scatter_m)


def _by_delay(soundings: RunSoundings, points_pool_m: Array, delay_s: float) -> Array:
    """Return -∂b/∂d (n, 3): by so much does a later pose lessen what remains of b."""
    before, after = (soundings.later(delay_s + step).in_body(points_pool_m) for step in (-STEP_S, STEP_S))
    return np.asarray((before - after) / (2 * STEP_S))


def _design(turned: Array, back: Array, by_delay: Array) -> Array:
    """Return ∂b/∂(ε, t, s, log k), -∂b/∂d, (n, 3, SIZE): -skew(k R x), the identity, R_pool_from_bodyᵀ, k R x."""
    n, (x, y, z) = len(turned), turned.T
    zero = np.zeros(n)
    by_turn = np.stack([np.stack([zero, z, -y], -1), np.stack([-z, zero, x], -1), np.stack([y, -x, zero], -1)], -2)
    columns = by_turn, np.broadcast_to(np.eye(3), (n, 3, 3)), back, turned[:, :, None], by_delay[:, :, None]
    return np.concatenate(columns, axis=2)


def _tukey(lengths: Array) -> Array:
    """Return weights (n,), 0 beyond CUT robust sigmas."""
    limit = CUT * max(float(np.median(lengths)) / OF_SIGMA, 1e-6) * np.sqrt(3)
    return np.asarray(np.maximum(1 - (lengths / limit) ** 2, 0.0) ** 2)


def _left_out_m(x: Array, b: Array, residual: Array, weight: Array, t_ns: NDArray[np.int64]) -> float:
    """Return the scatter of a coordinate of the pairs without weight, if another mount explains them; else 0.

    Wrong pairs and outliers are not explained by any. Their scatter has to fall to less than half.

    Parameters
    ----------
    x, b, residual, weight, t_ns
        Of n pairs, as in :func:`fit_mount`.
    """
    rows = weight == 0
    if rows.mean() < LEAST_LEFT_OUT or len(np.unique(t_ns[rows])) < LEAST_PINGS:
        return 0.0
    lengths, some = np.zeros(rows.sum()), np.ones(rows.sum())
    for _ in range(MAX_STEPS):
        R, t = best_rotation(x[rows], b[rows], some)
        lengths = np.linalg.norm(b[rows] - x[rows] @ R.T - t, axis=1)
        some = _tukey(lengths)
    left_m = float(np.median(np.linalg.norm(residual[rows], axis=1)))
    return left_m / OF_SIGMA if np.median(lengths) < left_m / 2 else 0.0


def _covariance(
    design: Array,
    weight: Array,
    residual: Array,
    normal: Array,
    t_ns: NDArray[np.int64],
    variance: float,
) -> Array:
    """Return N⁻¹ (Σ g gᵀ) N⁻¹, with g the sums of Aᵀ w r over each CLUSTER_S, and not less than the two others."""
    scores = np.einsum("nik,n,ni->nk", design, weight, residual, optimize=True)
    seconds = np.unique(t_ns // round(CLUSTER_S * NS_PER_S), return_inverse=True)[1]
    sums = np.stack([np.bincount(seconds, column) for column in scores.T], axis=1)
    values, vectors = np.linalg.eigh(normal)
    inverse = vectors / np.maximum(values, WEAKEST * values[-1]) @ vectors.T
    covariance = inverse @ (sums.T @ sums) @ inverse * len(sums) / max(len(sums) - 1, 1)
    formal = max(variance, 1e-12) * np.diag(inverse)
    covariance += np.diag(np.maximum(formal - np.diag(covariance), 0.0))
    between = leave_one_out(design, weight, scores, normal, time_groups(t_ns))
    wider = np.sqrt(np.maximum(between / np.diag(covariance), 1.0))
    return np.asarray(covariance * wider[:, None] * wider)
