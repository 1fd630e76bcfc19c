"""Registration of points to the target: a search over coarse poses, then Gauss-Newton onto the nearest surface."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.target.placements import Placement, SubsetPlacement

Array = NDArray[np.float64]
Labeller = Callable[[Array, Array], NDArray[np.int16]]  # parameters, points -> face numbers (-1: none)
Closest = Callable[[Array], tuple[Array, NDArray[np.int64]]]  # points -> nearest points on the model, face numbers
ROUGH = 2000  # number of points for the scores of the starts and for the coarse convergence
START_REACH_M = 0.25  # reach for the scores of the starts; a point farther than the reach does not count
COARSE_REACHES_M, FINE_REACHES_M = (0.4, 0.3, 0.2, 0.15), (0.1, 0.07, 0.05)  # for coarse and for final convergence
SAME_POSE_M = 0.03  # two poses are one if no coordinate of a point differs by more; less than the finest reach


@dataclass(frozen=True)
class FacePlanes:
    """Outward normals (f, 3) and distances (f,) m of the planes of a target's faces."""

    normals: Array
    distances_m: Array


@dataclass(frozen=True)
class TargetSurface:
    """The surface of a target: the function that finds its nearest points, and the planes of its faces."""

    closest: Closest
    planes: FacePlanes


def surface_score(placement: Placement, parameters: Array, closest: Closest, reach_m: float) -> float:
    """Return the share of points that the model explains: mean of max(0, 1 - (distance / reach)²), in [0, 1].

    Parameters
    ----------
    placement, parameters
        The points, and their parameters (k,).
    closest
        Function that returns the nearest points on the model.
    reach_m
        Distance from which on a point adds nothing.
    """
    points = placement.points(parameters)
    nearest, _ = closest(points)
    squared = np.sum((points - nearest) ** 2, axis=1) / reach_m**2
    return float(np.mean(np.maximum(0.0, 1.0 - squared)))


def converge(
    placement: Placement, start: Array, surface: TargetSurface, reaches_m: Sequence[float], steps: int = 4
) -> Array:
    """Return the parameters (k,) after Gauss-Newton steps onto the nearest surface, within a shrinking reach.

    The residual of a point is its distance from the nearest point of the nearest face, along the line between them
    (along the normal of the face if they coincide). Its weight is (1 - (d / reach)²)², and zero beyond the reach. The
    prior draws directions that the points do not determine to zero, the parameters' expectation.

    Parameters
    ----------
    placement, start
        The points, and the parameters (k,) to start from.
    surface
        The surface of the target.
    reaches_m
        Reaches, one after another.
    steps
        Largest number of steps with each reach.
    """
    parameters = start.copy()
    prior = np.diag(0.05**2 / placement.prior_sigmas**2)  # relative to points with a sigma of 5 cm
    for reach in reaches_m:
        tolerance = 1e-5 if reach == reaches_m[-1] else reach / 200
        for _ in range(steps):
            points = placement.points(parameters)
            nearest, face = surface.closest(points)
            away = points - nearest
            distance = np.linalg.norm(away, axis=1)
            use = distance < reach
            if use.sum() < len(parameters):
                return parameters
            line = away / np.maximum(distance, 1e-12)[:, None]
            direction = np.where(distance[:, None] > 1e-4, line, surface.planes.normals[face])
            residual = np.sum(direction * away, axis=1)[use]
            weight = (1 - (residual / reach) ** 2) ** 2
            rows = placement.rows(parameters, direction)[use]
            normal_matrix = (rows * weight[:, None]).T @ rows + prior
            right_side = -(rows * weight[:, None]).T @ residual - prior @ parameters
            step = np.linalg.solve(normal_matrix, right_side)
            parameters = parameters + step
            if np.max(np.abs(step)) < tolerance:
                break
    return parameters


@dataclass(frozen=True)
class SearchCriteria:
    """Criteria by which a search accepts converged poses and compares them.

    Parameters
    ----------
    same
        Function that returns whether two converged poses (k,) are the same solution.
    quality
        Function that returns the quality of a converged pose (k,); the highest wins.
    limits
        Largest absolute values (k,) of the parameters of a candidate.
    starts_per_group
        Number of starts of each group that converge. Where blocks repeat, the best of all may lie round one wrong
        height.
    """

    same: Callable[[Array, Array], bool]
    quality: Callable[[Array], float]
    limits: Array
    starts_per_group: int = 1


@dataclass(frozen=True)
class SearchResult:
    """The best pose, its score, and the score of the best rival, a pose that is another solution (0: no rival).

    ``within``: whether the pose lies within the limits; if not, no start led to a pose within them.
    """

    parameters: Array
    score: float
    rival_score: float
    within: bool

    def or_within(self, refined: Array, limits: Array, edges_known: bool) -> bool:
        """Return whether the pose lies within the limits (k,).

        The edges of a found target are where the laser's points end, inside its true edges. They draw a pose far along
        directions that the faces leave open. The refinement, which has no edges, takes it back to the prior there, and
        is judged in its place. The edges of a drawn target tell the truth: a height that is wrong, above all.
        """
        return self.within or (not edges_known and bool(np.all(np.abs(refined) <= limits)))


def search(
    placement: SubsetPlacement, starts: Sequence[Sequence[Array]], surface: TargetSurface, criteria: SearchCriteria
) -> SearchResult:
    """Return the best pose from many starts: all are scored with a wide reach, the best converge and are compared.

    Starts are scored, and converge within the coarse reaches, with ROUGH of the points: more points do not separate
    starts better. If several starts converge to the same pose, only the first goes on.

    Parameters
    ----------
    placement
        The points.
    starts
        Groups of parameters (k,); the best of each group converge.
    surface
        The surface of the target.
    criteria
        Criteria for candidates and for their quality.
    """
    rough = placement.subset(ROUGH)

    def start_score(parameters: Array) -> float:
        return surface_score(rough, parameters, surface.closest, START_REACH_M)

    chosen = [
        start
        for group in starts
        for start in sorted(group, key=lambda p: -start_score(p))[: criteria.starts_per_group]
    ]
    converged: list[Array] = []
    clouds: list[Array] = []
    for start in chosen:
        coarse = converge(rough, start, surface, COARSE_REACHES_M)
        points = rough.points(coarse)
        if all(np.max(np.abs(points - earlier)) > SAME_POSE_M for earlier in clouds):
            clouds.append(points)
            converged.append(converge(placement, coarse, surface, FINE_REACHES_M))
    allowed = [p for p in converged if np.all(np.abs(p) <= criteria.limits)]
    candidates = [(criteria.quality(p), p) for p in allowed or converged]
    best_score, best = max(candidates, key=lambda candidate: candidate[0])
    rivals = [rival_score for rival_score, p in candidates if not criteria.same(best, p)]
    return SearchResult(best, best_score, max(rivals, default=0.0), bool(allowed))


@dataclass(frozen=True)
class Refinement:
    """Parameters (k,), covariance (k, k) from the residuals' robust scale; scale, RMS and number of the residuals."""

    parameters: Array
    covariance: Array
    scale_m: float
    rms_m: float
    count: int


def refine(
    placement: Placement, start: Array, label: Labeller, planes: FacePlanes, rounds: int = 6, least_m: float = 0.0
) -> Refinement:
    """Return the point-to-plane least-squares fit of labelled points, which edges do not bias.

    Points are labelled again in each round. The residual is r = n · x - d, the Huber weights are min(1, k s / |r|) with
    k = 2 and s = 1.4826 · median |r|, the covariance is s² (Aᵀ W A + prior)⁻¹. With fewer than three labelled points
    per parameter the rounds end with the parameters so far, at first the start.

    Points share errors of centimetres (drift, the faces as built) that the residuals' scale does not show. A hundred
    thousand points on a wall that leans by 0.01° would move it by ten metres in height to mend two millimetres. So a
    direction of the parameters (in units of their prior sigmas, an eigenvector of Aᵀ W A) in which one prior sigma
    moves the points along their normals by less than ``least_m`` (RMS) is left to the prior.

    Parameters
    ----------
    placement, start
        The points, and the parameters (k,) to start from.
    label
        ``label(parameters, points)`` gives face numbers (n,), -1 for none.
    planes
        The planes of the faces.
    rounds
        Number of steps.
    least_m
        Least movement of the points by a direction that they determine; 0: they determine all.
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
        residual = np.sum(points[use] * planes.normals[face[use]], axis=1) - planes.distances_m[face[use]]
        scale = max(1.4826 * float(np.median(np.abs(residual))), 1e-9)
        rms = float(np.sqrt(np.mean(residual**2)))
        weight = np.minimum(1.0, 2 * scale / np.maximum(np.abs(residual), 1e-12))
        directions = np.zeros_like(points)
        directions[use] = planes.normals[face[use]]
        rows = placement.rows(parameters, directions)[use]
        prior = np.diag((scale / placement.prior_sigmas) ** 2)
        weighted = rows * weight[:, None]
        least = least_m**2 * float(weight.sum())
        normal, right = _determined(weighted.T @ rows, weighted.T @ residual, placement.prior_sigmas, least)
        inverse = np.asarray(np.linalg.inv(normal + prior), dtype=np.float64)
        step = -inverse @ (right + prior @ parameters)
        parameters = parameters + step
        covariance = scale**2 * inverse
    return Refinement(parameters, covariance, scale, rms, count)


def _determined(normal: Array, right: Array, prior_sigmas: Array, least: float) -> tuple[Array, Array]:
    """Return normal matrix (k, k) and right side (k,) without the directions whose eigenvalue is below ``least``."""
    values, vectors = np.linalg.eigh(normal * np.outer(prior_sigmas, prior_sigmas))
    if values[0] >= least:
        return normal, right
    kept = vectors[:, values >= least]
    into, back = prior_sigmas[:, None] * kept, kept / prior_sigmas[:, None]
    projector = into @ back.T  # of a step; its transpose of the normal equations
    return np.asarray(projector.T @ normal @ projector), np.asarray(projector.T @ right)
