"""The rigorous solution: both sensors observe the same planes, one weighted least squares for all unknowns.

Unknowns, in this order: the mount's rotation ε (body x, y, z; rad), its lever arm (body x, y, z; m), then for each
surface family (P1, P2, P3, H) two turns of the normal and a shift. Further columns (latency, sound speed, poses at
knots) can be added beside the six as further common columns of :func:`sounding_rows`.

Observation: a point lies on its surface,

    v = n · (X - c) - shift,       X = p + T (Exp(ε) R x + l),

with p, T the body's pose in the target frame, n the family's normal and c a fixed point near the surface. Horizontal
faces are one family H: X is reduced by the design height of its face along their normal (X - h n), so that all are one
plane: they are parallel and their distances known. (On a target out of plumb X_z - h would be wrong by h (1 - n_z).)
With u = R x (body), n_body = Tᵀ n:

    ∂v/∂ε = u × n_body   (n · T (ε × u) = ε · (u × n_body)),   ∂v/∂l = n_body,
    ∂v/∂turn_k = t_k · (X - c),   ∂v/∂shift = -1,

t_1, t_2 the tangents. Laser points X are given (their mount is calibrated): they observe
the last three columns alone, and their normal equations follow from second moments.

Weights: 1 / (σ² f), σ from range, angle and incidence, f the variance factor of the observation's group, times IGG III.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.planes import tangents_of
from pipeline.maths.robust import histogram, igg3_weights
from pipeline.maths.rotations import exp_so3

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
COMMON = 6
NAMES = ("rotation_x", "rotation_y", "rotation_z", "lever_arm_x", "lever_arm_y", "lever_arm_z")
GROUPS = ("laser", "mbes_vertical", "mbes_horizontal")


@dataclass(frozen=True)
class Surface:
    """normal (3,), tangents (2, 3), centre c (3,), shift: normal · (X - c) = shift on it."""

    family: str
    normal: Array
    centre_m: Array
    shift_m: float

    @property
    def tangents(self) -> Array:
        return tangents_of(self.normal)

    def moved(self, turn_1: float, turn_2: float, shift_m: float) -> "Surface":
        normal = self.normal + turn_1 * self.tangents[0] + turn_2 * self.tangents[1]
        return replace(self, normal=normal / np.linalg.norm(normal), shift_m=self.shift_m + shift_m)


@dataclass(frozen=True)
class State:
    """The unknowns' current values, the groups' variance factors and robust scales, and whether weights are robust."""

    R_body_from_mbes: Array
    lever_arm_m: Array
    surfaces: tuple[Surface, ...]
    factors: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    scales: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    robust: tuple[float, float] | None = None

    @property
    def size(self) -> int:
        return COMMON + 3 * len(self.surfaces)

    def columns(self, surface: int) -> list[int]:
        """Columns of a surface's three unknowns."""
        return list(range(COMMON + 3 * surface, COMMON + 3 * surface + 3))

    def moved(self, step: Array) -> "State":
        surfaces = tuple(s.moved(*step[self.columns(k)]) for k, s in enumerate(self.surfaces))
        return replace(
            self,
            R_body_from_mbes=exp_so3(step[:3]) @ self.R_body_from_mbes,
            lever_arm_m=self.lever_arm_m + step[3:6],
            surfaces=surfaces,
        )


@dataclass(frozen=True)
class Rows:
    """Observations of one sensor: surface (n,), residual v (n,) m, sigma (n,) m, and the design's columns.

    common (n, 6) or None (laser); local (n, 3); group name by observation is ``groups[group]``.
    """

    surface: Integers
    residual_m: Array
    sigma_m: Array
    common: Array | None
    local: Array
    group: Integers


def _local(state: State, surface: Integers, points_m: Array) -> tuple[Array, Array]:
    """Residuals v and columns (t1 · (X - c), t2 · (X - c), -1)."""
    residual, local = np.empty(len(points_m)), np.full((len(points_m), 3), -1.0)
    for k, one in enumerate(state.surfaces):
        rows = np.flatnonzero(surface == k)
        away = points_m[rows] - one.centre_m
        residual[rows] = away @ one.normal - one.shift_m
        local[rows, :2] = away @ one.tangents.T
    return residual, local


def laser_rows(
    state: State,
    surface: Integers,
    points_m: Array,
    ranges_m: Array,
    cos_incidence: Array,
    range_sigma_m: float,
    angle_sigma_rad: float,
) -> Rows:
    """Laser points in the target frame (reduced): σ² = cos² i σ_r² + sin² i (r σ_a)², i the angle of incidence."""
    residual, local = _local(state, surface, points_m)
    across = np.sqrt(np.maximum(0.0, 1.0 - cos_incidence**2)) * ranges_m * angle_sigma_rad
    sigma = np.hypot(cos_incidence * range_sigma_m, across)
    return Rows(surface, residual, sigma, None, local, np.zeros(len(surface), dtype=np.int64))


def sounding_rows(
    state: State,
    surface: Integers,
    points_mbes_m: Array,
    positions_m: Array,
    R_target_from_body: Array,
    range_sigma_m: float,
    angle_sigma_rad: float,
) -> Rows:
    """Soundings with their poses (positions reduced): σ² = (n · u)² σ_r² + (n · a)² (r σ_θ)², a the across-track unit
    vector at the beam.

    The footprint enters through the labels (no edge within it) and through the group's variance factor: on one plane
    the phase detection takes the beam's axis.
    """
    turned = points_mbes_m @ state.R_body_from_mbes.T
    points = positions_m + np.einsum("nij,nj->ni", R_target_from_body, turned + state.lever_arm_m)
    residual, local = _local(state, surface, points)
    normals = np.array([s.normal for s in state.surfaces])[surface]
    normals_body = np.einsum("nij,ni->nj", R_target_from_body, normals)
    common = np.hstack([np.cross(turned, normals_body), normals_body])
    in_mbes = normals_body @ state.R_body_from_mbes
    x, _, z = points_mbes_m.T
    along_ray = np.einsum("nj,nj->n", in_mbes, points_mbes_m) / np.linalg.norm(points_mbes_m, axis=1)
    across = (in_mbes[:, 2] * x - in_mbes[:, 0] * z) * angle_sigma_rad  # r a = (-z, 0, x)
    sigma = np.hypot(along_ray * range_sigma_m, across)
    horizontal = np.array([s.family == "H" for s in state.surfaces])[surface]
    return Rows(surface, residual, sigma, common, local, np.where(horizontal, 2, 1))


@dataclass(frozen=True)
class GroupSums:
    """Normal equations and statistics of one group of observations; they add.

    normal (k, k), right (k,); squares: Σ w v² / σ² (without the variance factor); weights: Σ w, w the robust weight.
    """

    normal: Array
    right: Array
    squares: float
    weights: float
    count: int
    cut: int
    reduced: int
    histogram: Array

    def __add__(self, other: "GroupSums") -> "GroupSums":
        return GroupSums(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class Sums:
    """The groups' sums, by name of the group; they add."""

    groups: Mapping[str, GroupSums]

    def __add__(self, other: "Sums") -> "Sums":
        both = dict(self.groups)
        for name, group in other.groups.items():
            both[name] = both[name] + group if name in both else group
        return Sums({name: both[name] for name in GROUPS if name in both})


def weights_of(state: State, rows: Rows) -> tuple[Array, Array]:
    """Robust weights w (n,) and full weights p = w / (σ² f) (n,)."""
    scales = np.array([state.scales[name] for name in GROUPS])[rows.group]
    factors = np.array([state.factors[name] for name in GROUPS])[rows.group]
    robust = (
        np.ones(len(rows.group))
        if state.robust is None
        else igg3_weights(rows.residual_m / (rows.sigma_m * scales), *state.robust)
    )
    return robust, robust / (rows.sigma_m**2 * factors)


def accumulate(state: State, rows: Rows) -> Sums:
    """One chunk's contribution to the normal equations, group by group and surface by surface."""
    robust, full = weights_of(state, rows)
    normalised = rows.residual_m / rows.sigma_m
    groups = {}
    for number in np.unique(rows.group).tolist():
        inside = rows.group == number
        normal, right = np.zeros((state.size, state.size)), np.zeros(state.size)
        for surface in np.unique(rows.surface[inside]).tolist():
            use = np.flatnonzero(inside & (rows.surface == surface))
            design, columns = rows.local[use], state.columns(surface)
            if rows.common is not None:
                design, columns = np.hstack([rows.common[use], design]), [*range(COMMON), *columns]
            weighted = design * full[use, None]
            normal[np.ix_(columns, columns)] += weighted.T @ design
            right[columns] -= weighted.T @ rows.residual_m[use]
        w, v = robust[inside], normalised[inside]
        groups[GROUPS[number]] = GroupSums(normal, right, float(w @ v**2), *_weight_counts(w), histogram(v))
    return Sums(groups)


def _weight_counts(weights: Array) -> tuple[float, int, int, int]:
    """Sum of the robust weights, how many there are, how many are zero, how many between zero and one."""
    cut = int(np.sum(weights == 0))
    return float(weights.sum()), len(weights), cut, int(np.sum(weights < 1)) - cut


@dataclass(frozen=True)
class LaserMoments:
    """Σ w / σ² · y yᵀ, y = (X - c, 1), per surface (s, 4, 4); and the same statistics as :class:`GroupSums`.

    The laser's share of the normal equations is a quadratic form of y, so after one pass over the points every
    iteration takes it from here.
    """

    moments: Array
    weights: float
    count: int
    cut: int
    reduced: int
    histogram: Array

    def __add__(self, other: "LaserMoments") -> "LaserMoments":
        return LaserMoments(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))

    def sums(self, state: State) -> Sums:
        """v = (n, -shift) · y; columns (t1, 0), (t2, 0), (0, -1) · y."""
        factor = state.factors["laser"]
        normal, right = np.zeros((state.size, state.size)), np.zeros(state.size)
        squares = 0.0
        for k, surface in enumerate(state.surfaces):
            design = np.zeros((3, 4))
            design[:2, :3], design[2, 3] = surface.tangents, -1.0
            v = np.append(surface.normal, -surface.shift_m)
            columns = state.columns(k)
            normal[np.ix_(columns, columns)] = design @ self.moments[k] @ design.T / factor
            right[columns] = -design @ self.moments[k] @ v / factor
            squares += float(v @ self.moments[k] @ v)
        statistics = (squares, self.weights, self.count, self.cut, self.reduced, self.histogram)
        return Sums({"laser": GroupSums(normal, right, *statistics)})


def laser_moments(state: State, rows: Rows, points_m: Array) -> LaserMoments:
    """One chunk's moments of the (reduced) laser points (n, 3), with the weights of ``state``."""
    robust, _ = weights_of(state, rows)
    moments = np.zeros((len(state.surfaces), 4, 4))
    for k, surface in enumerate(state.surfaces):
        use = rows.surface == k
        y = np.column_stack([points_m[use] - surface.centre_m, np.ones(int(use.sum()))])
        moments[k] = (y * (robust[use] / rows.sigma_m[use] ** 2)[:, None]).T @ y
    return LaserMoments(moments, *_weight_counts(robust), histogram(rows.residual_m / rows.sigma_m))
