"""The target's design as observations of its surfaces: what calibrates a laser that nothing else has calibrated.

The design is a rigid body that stands where it was set up, but for a displacement g = (d, ω) (m and rad, target frame;
X -> X + d + ω × X) of which the survey knows each component with some sigma, or not at all. Each family of faces stands
off that body by errors of its own: its direction by σ_turn about either axis in it, its place by σ_shift. With n, c, s
the surface as it is now (n · (X - c) = s), t1, t2 its tangents, n0 the design's normal and q a point of the design's
plane amid its faces,

    turn k:   t_k · (n - n0) - ω · (n0 × t_k)                                   = 0 ± σ_turn
    place:    n · (q - c) - s + n · d + ω · (q × n)                             = 0 ± σ_shift
    set-up:   g - g0                                                            = 0 ± σ_g

(the design's plane goes through q + d + ω × q with normal n0 + ω × n0). The step of a surface's unknowns (turns a_k,
shift b) changes the first by a_k, the second by a_k t_k · (q - c) - b. g is eliminated: where σ_g is infinite its
component comes from the faces alone, and what no face tells of it drops out.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.parameters import OF_SURFACE, SIX, State, Surface

Array = NDArray[np.float64]
OPEN = 1e-12  # an eigenvalue of the scaled normal matrix of g below this leaves a direction open


@dataclass(frozen=True)
class Design:
    """By family: normal n0 (3,) and a point q (3,) of its plane, target frame; ``turn_rad`` and ``shift_m``: sigmas;
    where the body was set up, g0 (6,), and how sure that is (6,), infinite for what nobody surveyed."""

    planes: Mapping[str, tuple[Array, Array]]
    turn_rad: float
    shift_m: float
    set_up: Array
    set_up_sigma: Array


@dataclass(frozen=True)
class Known:
    """What it adds to the normal equations N x + b = 0 of all unknowns, and to the sum of squares."""

    normal: Array
    right: Array
    squares: float


def of_design(design: Design, state: State) -> Known:
    """Of the design, at the surfaces as they are."""
    size = state.size
    N, b, squares = np.zeros((size, size)), np.zeros(size), 0.0
    information = np.where(np.isfinite(design.set_up_sigma), design.set_up_sigma, np.inf) ** -2.0
    of_g, tied, pull = np.diag(information), np.zeros((size, SIX)), -information * design.set_up
    squares += float(np.sum(information * design.set_up**2))
    weight = np.array([design.turn_rad, design.turn_rad, design.shift_m]) ** -2.0
    for number, surface in enumerate(state.surfaces):
        r, J, G = _rows(surface, *design.planes[surface.family])
        place = state.shared.start + len(OF_SURFACE) * number + np.arange(len(OF_SURFACE))
        N[np.ix_(place, place)] += J.T @ (weight[:, None] * J)
        b[place] += J.T @ (weight * r)
        tied[place] += J.T @ (weight[:, None] * G)
        of_g += G.T @ (weight[:, None] * G)
        pull += G.T @ (weight * r)
        squares += float(np.sum(weight * r**2))
    inverse = _inverse(of_g)
    return Known(N - tied @ inverse @ tied.T, b - tied @ inverse @ pull, squares - float(pull @ inverse @ pull))


def _rows(surface: Surface, n0: Array, q: Array) -> tuple[Array, Array, Array]:
    """Misclosures (3,), their design by the surface's unknowns (3, 3), and by g (3, 6)."""
    n, away = surface.normal, q - surface.centre_m
    r = np.r_[surface.tangents @ (n - n0), n @ away - surface.shift_m]
    J = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [*(surface.tangents @ away), -1.0]])
    G = np.zeros((3, SIX))
    G[:2, 3:] = -np.cross(n0, surface.tangents)
    G[2, :3], G[2, 3:] = n, np.cross(q, n)
    return r, J, G


def _inverse(matrix: Array) -> Array:
    """Of a positive semidefinite one, within what it determines."""
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    kept = values > OPEN * max(float(values[-1]), 1e-300)
    half = vectors[:, kept] / np.sqrt(values[kept]) * scale[:, None]
    return np.asarray(half @ half.T)
