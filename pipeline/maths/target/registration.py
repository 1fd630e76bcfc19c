"""Finding the target in a cloud: a search over coarse poses, then Gauss-Newton onto the nearest surface.

Both sensors use the same two steps; they differ in what moves: for the laser the target's pose (azimuth, x, y, z), for
the soundings the mount (rotation, lever arm). A ``Placement`` hides which.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import exp_so3, rotation_z

Array = NDArray[np.float64]
Closest = Callable[[Array], tuple[Array, NDArray[np.int64]]]  # points -> nearest points on the model, face numbers
ROUGH = 2000  # points with which starts are scored and settle at first
WIDE_M, FINE_M = (0.4, 0.3, 0.2, 0.15), (0.1, 0.07, 0.05)  # reaches while roughly settling, and then
SAME_M = 0.03  # poses that put no point farther apart are one: less than the finest reach


class Placement(Protocol):
    """Points in the target frame as a function of k parameters, and their derivatives."""

    @property
    def prior_sigmas(self) -> Array:
        """(k,): how far from zero the parameters may be expected."""
        ...

    def points(self, parameters: Array) -> Array:
        """(k,) -> (n, 3) m."""
        ...

    def rows(self, parameters: Array, directions: Array) -> Array:
        """Derivative of ``directions · point``, (n, 3) -> (n, k)."""
        ...


class Searched(Placement, Protocol):
    """A placement that a search can thin."""

    def thinned(self, most: int) -> Placement:
        """The same of at most so many of its points."""
        ...


@dataclass(frozen=True)
class TargetPose:
    """Laser points in the pool frame, (n, 3) m; parameters (azimuth correction β rad, origin o of the target in pool).

    x_target = Rz(β) (x_pool - o): with the target's y axis β further clockwise than configured, coordinates turn by +β.
    d(g · x_target)/dβ = g · (e_z × x_target), d/do = -gᵀ Rz(β).
    """

    points_pool_m: Array
    prior_sigmas: Array

    def thinned(self, most: int) -> "TargetPose":
        return replace(self, points_pool_m=self.points_pool_m[_some(len(self.points_pool_m), most)])

    def points(self, parameters: Array) -> Array:
        return (self.points_pool_m - parameters[1:]) @ rotation_z(parameters[0]).T

    def rows(self, parameters: Array, directions: Array) -> Array:
        placed = self.points(parameters)
        turn = directions[:, 1] * placed[:, 0] - directions[:, 0] * placed[:, 1]
        return np.column_stack([turn, -directions @ rotation_z(parameters[0])])


@dataclass(frozen=True)
class MountCorrection:
    """Soundings with poses (n, 3), (n, 3, 3) in the target frame, m = R_body_from_mbes(coarse) x_mbes (n, 3);
    parameters (rotation vector δ, lever arm correction): x = p + T (Exp(δ) m + l + Δl).

    Rows [u × g_body, g_body], u = Exp(δ) m, g_body = Tᵀ g: exact for the increment ε of Exp(ε) Exp(δ), and within
    |δ| / 2 relative for δ itself, enough for an iteration.
    """

    positions_m: Array
    R_target_from_body: Array
    points_body_m: Array
    lever_arm_m: Array
    prior_sigmas: Array

    def thinned(self, most: int) -> "MountCorrection":
        use = _some(len(self.positions_m), most)
        return replace(
            self,
            positions_m=self.positions_m[use],
            R_target_from_body=self.R_target_from_body[use],
            points_body_m=self.points_body_m[use],
        )

    def points(self, parameters: Array) -> Array:
        body = self.points_body_m @ exp_so3(parameters[:3]).T + self.lever_arm_m + parameters[3:]
        return np.asarray(self.positions_m + np.einsum("nij,nj->ni", self.R_target_from_body, body))

    def origins(self, parameters: Array) -> Array:
        """Where the sonar was, (n, 3) m."""
        return np.asarray(self.positions_m + self.R_target_from_body @ (self.lever_arm_m + parameters[3:]))

    def rows(self, parameters: Array, directions: Array) -> Array:
        turned = self.points_body_m @ exp_so3(parameters[:3]).T
        g = np.einsum("nij,ni->nj", self.R_target_from_body, directions)
        return np.hstack([np.cross(turned, g), g])


@dataclass(frozen=True)
class LaserMount:
    """Laser points with poses (n, 3), (n, 3, 3) in the pool frame, m = R_body_from_laser(coarse) x_laser (n, 3);
    parameters (azimuth correction β, origin o of the target in pool, rotation vector δ): where the target stands and
    how the laser is turned: x_target = Rz(β) (p + T (Exp(δ) m + l) - o).
    """

    positions_m: Array
    R_pool_from_body: Array
    points_body_m: Array
    lever_arm_m: Array
    prior_sigmas: Array

    def points(self, parameters: Array) -> Array:
        return (self._in_pool(parameters) - parameters[1:4]) @ rotation_z(parameters[0]).T

    def _in_pool(self, parameters: Array) -> Array:
        body = self.points_body_m @ exp_so3(parameters[4:]).T + self.lever_arm_m
        return np.asarray(self.positions_m + np.einsum("nij,nj->ni", self.R_pool_from_body, body))

    def rows(self, parameters: Array, directions: Array) -> Array:
        placed = self.points(parameters)
        turn = directions[:, 1] * placed[:, 0] - directions[:, 0] * placed[:, 1]
        in_pool = directions @ rotation_z(parameters[0])
        g = np.einsum("nij,ni->nj", self.R_pool_from_body, in_pool)
        turned = self.points_body_m @ exp_so3(parameters[4:]).T
        return np.column_stack([turn, -in_pool, np.cross(turned, g)])


def _some(count: int, most: int) -> NDArray[np.int64]:
    """Which points: by chance, since every so-and-so-many-th of a grid could be one row of it; in their order."""
    return np.sort(np.random.default_rng(0).permutation(count)[:most])


def score(placement: Placement, parameters: Array, closest: Closest, reach_m: float) -> float:
    """Share of points explained by the model: mean of max(0, 1 - (distance / reach)²), in [0, 1]."""
    points = placement.points(parameters)
    nearest, _ = closest(points)
    squared = np.sum((points - nearest) ** 2, axis=1) / reach_m**2
    return float(np.mean(np.maximum(0.0, 1.0 - squared)))


def settle(
    placement: Placement,
    start: Array,
    closest: Closest,
    normals: Array,
    reaches_m: Sequence[float],
    steps: int = 4,
) -> Array:
    """Gauss-Newton onto the nearest surface, within a reach that shrinks from step to step; (k,) parameters.

    Each point's residual is its distance from the nearest point of the nearest face, along the line between them (along
    the face's normal where they coincide), weighted (1 - (d / reach)²)² and nothing beyond the reach. The prior keeps
    directions that the points leave open where they were.
    """
    parameters = start.copy()
    prior = np.diag(0.05**2 / placement.prior_sigmas**2)  # as if one point with 5 cm said the same
    for reach in reaches_m:
        still = 1e-5 if reach == reaches_m[-1] else reach / 200
        for _ in range(steps):
            points = placement.points(parameters)
            nearest, face = closest(points)
            away = points - nearest
            distance = np.linalg.norm(away, axis=1)
            use = distance < reach
            if use.sum() < len(parameters):
                return parameters
            direction = np.where(distance[:, None] > 1e-4, away / np.maximum(distance, 1e-12)[:, None], normals[face])
            residual = np.sum(direction * away, axis=1)[use]
            weight = (1 - (residual / reach) ** 2) ** 2
            rows = placement.rows(parameters, direction)[use]
            normal = (rows * weight[:, None]).T @ rows + prior
            right = -(rows * weight[:, None]).T @ residual - prior @ parameters
            step = np.linalg.solve(normal, right)
            parameters = parameters + step
            if np.max(np.abs(step)) < still:
                break
    return parameters


@dataclass(frozen=True)
class Found:
    """A pose and what it explains, with the best rival that is another pose (not the same one found again).

    ``within``: it lies within the limits; otherwise no start led to a pose that does.
    """

    parameters: Array
    score: float
    rival_score: float
    within: bool


def search(
    placement: Searched,
    starts: Sequence[Sequence[Array]],
    closest: Closest,
    normals: Array,
    same: Callable[[Array, Array], bool],
    limits: Array,
    judge: Callable[[Array], float],
    each: int = 1,
) -> Found:
    """Best pose from many starts: all are scored with a wide reach, the best settle and are judged.

    Scored, and settled within the wide reaches, with ROUGH of the points: more do not tell starts apart any better. Of
    those that settle together one goes on.

    ``starts`` come in groups, of each of which the ``each`` best settle: where blocks repeat, the best of all may lie
    round one wrong height. ``limits`` (k,): a settled pose further than this from zero is no candidate. ``same`` tells
    whether two settled poses are the same solution, ``judge`` how good one is.
    """
    rough = placement.thinned(ROUGH)
    chosen = [
        start for group in starts for start in sorted(group, key=lambda p: -score(rough, p, closest, 0.25))[:each]
    ]
    settled: list[Array] = []
    placed: list[Array] = []
    for start in chosen:
        wide = settle(rough, start, closest, normals, WIDE_M)
        points = rough.points(wide)
        if all(np.max(np.abs(points - other)) > SAME_M for other in placed):
            placed.append(points)
            settled.append(settle(placement, wide, closest, normals, FINE_M))
    allowed = [p for p in settled if np.all(np.abs(p) <= limits)]
    scored = [(judge(p), p) for p in allowed or settled]
    best_score, best = max(scored, key=lambda one: one[0])
    rivals = [s for s, p in scored if not same(best, p)]
    return Found(best, best_score, max(rivals, default=0.0), bool(allowed))


@dataclass(frozen=True)
class TiltedTarget:
    """Points already in the target frame, (n, 3) m; parameters: a small rotation vector and a shift of the points.

    d(g · x)/dω = x × g (from g · (ω × x)), d/ds = g: used once, at zero.
    """

    points_target_m: Array
    prior_sigmas: Array

    def points(self, parameters: Array) -> Array:
        return self.points_target_m @ exp_so3(parameters[:3]).T + parameters[3:]

    def rows(self, parameters: Array, directions: Array) -> Array:
        return np.hstack([np.cross(self.points(parameters), directions), directions])


@dataclass(frozen=True)
class Refined:
    """Parameters (k,), covariance (k, k) from the residuals' robust scale, that scale, the RMS and how many points."""

    parameters: Array
    covariance: Array
    scale_m: float
    rms_m: float
    count: int


def refine(
    placement: Placement,
    start: Array,
    label: Callable[[Array, Array], NDArray[np.int16]],
    normals: Array,
    distances_m: Array,
    rounds: int = 6,
) -> Refined:
    """Point-to-plane least squares on labelled points only, relabelled each round: no bias from edges.

    ``label(parameters, points)`` gives face numbers (-1: none). Residual r = n · x - d, Huber weights min(1, k s /
    |r|) with k = 2 and s = 1.4826 · median |r|; covariance s² (Aᵀ W A + prior)⁻¹. With too few points the start comes
    back.
    """
    parameters = start.copy()
    scale, rms, count = np.inf, np.nan, 0
    covariance = np.diag(placement.prior_sigmas**2)
    for _ in range(rounds):
        points = placement.points(parameters)
        face = label(parameters, points)
        use = face >= 0
        count = int(use.sum())
        if count < 3 * len(parameters):
            break
        residual = np.sum(points[use] * normals[face[use]], axis=1) - distances_m[face[use]]
        scale = max(1.4826 * float(np.median(np.abs(residual))), 1e-9)
        rms = float(np.sqrt(np.mean(residual**2)))
        weight = np.minimum(1.0, 2 * scale / np.maximum(np.abs(residual), 1e-12))
        directions = np.zeros_like(points)
        directions[use] = normals[face[use]]
        rows = placement.rows(parameters, directions)[use]
        prior = np.diag((scale / placement.prior_sigmas) ** 2)
        inverse = np.linalg.inv((rows * weight[:, None]).T @ rows + prior)
        step = -inverse @ ((rows * weight[:, None]).T @ residual + prior @ parameters)
        parameters = parameters + step
        covariance = scale**2 * inverse
    return Refined(parameters, covariance, scale, rms, count)
