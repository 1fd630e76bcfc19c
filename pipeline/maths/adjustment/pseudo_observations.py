"""Prior information as pseudo-observations: the target as designed, parallel families, values known beforehand.

**The target as designed.** It is the reference for a laser that is itself calibrated. The design is a rigid body. It
stands where it was set up, except for a displacement g = (d, ω) (m and rad, target frame; X -> X + d + ω × X). The
survey gives each component of g with a sigma, or not at all. Each family of faces has errors of its own against that
body: its direction has σ_turn about either axis in its plane, its place has σ_shift. With n, c, s the current surface
(n · (X - c) = s), t1, t2 its tangents, n0 the design's normal and q a point of the design's plane amid its faces,

    turn k:   t_k · (n - n0) - ω · (n0 × t_k)                                   = 0 ± σ_turn
    place:    n · (q - c) - s + n · d + ω · (q × n)                             = 0 ± σ_shift
    set-up:   g - g0                                                            = 0 ± σ_g

(the design's plane goes through q + d + ω × q with normal n0 + ω × n0). The step of a surface's parameters (turns a_k,
shift b) changes the first by a_k, the second by a_k t_k · (q - c) - b. g is eliminated. A component of g with an
infinite σ_g comes from the faces alone; a component that no face determines has no effect.

**Parallel families** at unknown distances. For two of them with normals n, m (m reversed if it points the opposite way)
and tangents t_k of the first, t'_j of the second

    t_k · (n - m) = 0 ± σ,      k = 1, 2,

and a step of their turns, a_k and b_j, changes it by a_k - Σ_j t_k · t'_j b_j. So a wall above the water, which the
laser sees, determines the direction of the wall's foot, which the sonar alone sees.

**Values known beforehand.** Parameters with the deviation d from a value that is known with the covariance Q:

    d = 0 ± Q,        N = Q⁻¹,      b = Q⁻¹ d.

So a systematic error of which the data tell something is estimated, with its a-priori sigma as one observation. Where
the data tell nothing of it, the result is the same as with a consider parameter: the total covariance of the other
parameters is equal (Bierman 1977, "Factorization methods for discrete sequential estimation", on consider filters).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import N_SURFACE, State

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
N_DISPLACEMENT = 6  # d and ω
REACH_M = 2.0  # distance at which a turn of a surface counts as a shift
UNDETERMINED = 0.03  # a smaller singular value leaves a direction open: of walls that lean by 1° or 2°, the height
OPEN = 1e-12  # an eigenvalue of the scaled normal matrix of g below this leaves a direction open


@dataclass(frozen=True)
class PseudoObservations:
    """Contribution of prior information to the normal equations N x + b = 0 of all parameters.

    normal N (u, u); right b (u,); squares: contribution to the sum of squares at x = 0; count: number of
    pseudo-observations, less the number of further unknowns that are eliminated.
    """

    normal: Array
    right: Array
    squares: float
    count: int

    def __add__(self, other: "PseudoObservations") -> "PseudoObservations":
        return PseudoObservations(
            self.normal + other.normal, self.right + other.right, self.squares + other.squares, self.count + other.count
        )


class Prior(Protocol):
    """Prior information about surfaces or other parameters."""

    def pseudo_observations(self, state: State) -> PseudoObservations:
        """Return the pseudo-observations of this prior information, linearised at the current values."""
        ...


def all_pseudo_observations(priors: Sequence[Prior], state: State) -> PseudoObservations:
    """Return the sum of all prior information, linearised at the current values."""
    nothing = PseudoObservations(np.zeros((state.size, state.size)), np.zeros(state.size), 0.0, 0)
    return sum((prior.pseudo_observations(state) for prior in priors), start=nothing)


@dataclass(frozen=True)
class ParameterPrior:
    """Values of parameters that are known beforehand: those of a state.

    numbers (k,): the parameters, ascending; covariance (k, k); known: the state with their values.
    """

    numbers: Integers
    covariance: Array
    known: State

    def with_independent(self, other: "ParameterPrior") -> "ParameterPrior":
        """Return the prior information of these and of later parameters, whose errors are independent of these.

        ``known`` of these must have the values of the others too.
        """
        from scipy.linalg import block_diag

        numbers = np.concatenate([self.numbers, other.numbers])
        return ParameterPrior(numbers, block_diag(self.covariance, other.covariance), self.known)

    def pseudo_observations(self, state: State) -> PseudoObservations:
        """Return the pseudo-observations of these values, at the current ones."""
        N, b = np.zeros((state.size, state.size)), np.zeros(state.size)
        information = np.linalg.inv(self.covariance)
        deviation = state.deviation_from(self.known)[self.numbers]
        N[np.ix_(self.numbers, self.numbers)] = information
        b[self.numbers] = information @ deviation
        return PseudoObservations(N, b, float(deviation @ b[self.numbers]), len(self.numbers))


@dataclass(frozen=True)
class DesignPrior:
    """The target as designed, target frame.

    planes: for each family the normal n0 (3,) and a point q (3,) of its plane; turn_rad, shift_m: sigmas of a family
    against the body; set_up (6,): g0, the surveyed displacement of the body (m, rad); set_up_sigma (6,): its sigmas,
    infinite for components without a survey.
    """

    planes: Mapping[str, tuple[Array, Array]]
    turn_rad: float
    shift_m: float
    set_up: Array
    set_up_sigma: Array

    def pseudo_observations(self, state: State) -> PseudoObservations:
        """Return the design's pseudo-observations, linearised at the current surfaces."""
        size = state.size
        N, b = np.zeros((size, size)), np.zeros(size)
        information = np.where(np.isfinite(self.set_up_sigma), self.set_up_sigma, np.inf) ** -2.0
        # normal equations of g, and its coupling to the surfaces
        N_g, N_xg, b_g = np.diag(information), np.zeros((size, N_DISPLACEMENT)), -information * self.set_up
        squares = float(np.sum(information * self.set_up**2))
        weight = np.array([self.turn_rad, self.turn_rad, self.shift_m]) ** -2.0
        for number, surface in enumerate(state.surfaces):
            r, J, G = _misclosures(surface, *self.planes[surface.family])
            place = state.surface_columns(number)
            N[np.ix_(place, place)] += J.T @ (weight[:, None] * J)
            b[place] += J.T @ (weight * r)
            N_xg[place] += J.T @ (weight[:, None] * G)
            N_g += G.T @ (weight[:, None] * G)
            b_g += G.T @ (weight * r)
            squares += float(np.sum(weight * r**2))
        inverse = _inverse(N_g)
        return PseudoObservations(
            normal=N - N_xg @ inverse @ N_xg.T,
            right=b - N_xg @ inverse @ b_g,
            squares=squares - float(b_g @ inverse @ b_g),
            count=N_SURFACE * len(state.surfaces) + int(np.sum(information > 0)) - N_DISPLACEMENT,
        )


def displacement(surfaces: Sequence[ObservedSurface], planes: Mapping[str, tuple[Array, Array]]) -> Array:
    """Return the displacement g (6,), m and rad, that brings the designed body onto surfaces, by least squares.

    A turn of a surface counts as its shift at the distance REACH_M. A component that no surface determines is zero, as
    is one that hardly any does: walls as adjusted lean by some 0.01°, and then a millimetre would be metres of height.

    Parameters
    ----------
    surfaces : sequence of ObservedSurface
        The surfaces to fit.
    planes : mapping
        For each family the normal n0 (3,) and a point q (3,) of its plane, as designed.
    """
    weight, rows, right = np.array([REACH_M, REACH_M, 1.0]), [], []
    for surface in surfaces:
        r, _, G = _misclosures(surface, *planes[surface.family])
        rows.append(weight[:, None] * G)
        right.append(weight * r)
    left, sizes, directions = np.linalg.svd(np.concatenate(rows), full_matrices=False)
    seen = sizes > UNDETERMINED
    return np.asarray(-directions[seen].T @ (left[:, seen].T @ np.concatenate(right) / sizes[seen]))


@dataclass(frozen=True)
class ParallelPrior:
    """Pairs of families that are parallel, within ``sigma_rad``."""

    pairs: Sequence[tuple[str, str]]
    sigma_rad: float

    def pseudo_observations(self, state: State) -> PseudoObservations:
        """Return the pairs' pseudo-observations, linearised at the current surfaces."""
        number = {surface.family: k for k, surface in enumerate(state.surfaces)}
        N, b, squares = np.zeros((state.size, state.size)), np.zeros(state.size), 0.0
        for pair in self.pairs:
            first, second = (state.surfaces[number[family]] for family in pair)
            sense = 1.0 if first.normal @ second.normal > 0 else -1.0
            r = first.tangents @ (first.normal - sense * second.normal)
            J = np.hstack([np.eye(2), -sense * first.tangents @ second.tangents.T])
            place = np.concatenate([state.surface_columns(number[family])[:2] for family in pair])
            N[np.ix_(place, place)] += J.T @ J / self.sigma_rad**2
            b[place] += J.T @ r / self.sigma_rad**2
            squares += float(r @ r) / self.sigma_rad**2
        return PseudoObservations(N, b, squares, 2 * len(self.pairs))


def _misclosures(surface: ObservedSurface, n0: Array, q: Array) -> tuple[Array, Array, Array]:
    """Return the misclosures (3,), their derivatives by the surface's parameters (3, 3), and by g (3, 6)."""
    n, from_centre = surface.normal, q - surface.centre_m
    r = np.r_[surface.tangents @ (n - n0), n @ from_centre - surface.shift_m]
    J = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [*(surface.tangents @ from_centre), -1.0]])
    G = np.zeros((3, N_DISPLACEMENT))
    G[:2, 3:] = -np.cross(n0, surface.tangents)
    G[2, :3], G[2, 3:] = n, np.cross(q, n)
    return r, J, G


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a positive semidefinite matrix; directions that it leaves open (OPEN) get zero."""
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    kept = values > OPEN * max(float(values[-1]), 1e-300)
    half = vectors[:, kept] / np.sqrt(values[kept]) * scale[:, None]
    return np.asarray(half @ half.T)
