"""The rigorous solution: both sensors observe the same planes, one weighted least squares for all unknowns.

Unknowns, in this order: the mount's rotation ε (body x, y, z; rad), its lever arm (body x, y, z; m), then for each
surface family (P1, P2, P3, H) two turns of the normal and a shift. Further columns (latency, sound speed, poses at
knots) can be added beside the six as further common columns of :func:`sounding_rows`.

Observation: a point lies on its surface,

    v = n · (X - c) - shift,       X = p + T (Exp(ε) R x + l),

with p, T the body's pose in the target frame, n the family's normal and c a fixed point near the surface. Horizontal
faces are one family H: X is reduced by the design height of its face (X_z - h), so that all heights are one shift, the
target's own (tops and bottoms are level, their heights known). With u = R x (body), n_body = Tᵀ n:

    ∂v/∂ε = u × n_body   (n · T (ε × u) = ε · (u × n_body)),   ∂v/∂l = n_body,
    ∂v/∂turn_k = t_k · (X - c),   ∂v/∂shift = -1,

t_1, t_2 the tangents. Laser points X are given (their mount is calibrated): they observe
the last three columns alone, and their normal equations follow from second moments.

Weights: 1 / (σ² f), σ from range, angle and incidence, f the variance factor of the observation's group, times IGG III.
"""

from collections.abc import Mapping, Sequence
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
    normals = np.array([s.normal for s in state.surfaces])[surface]
    tangents = np.array([s.tangents for s in state.surfaces])[surface]
    away = points_m - np.array([s.centre_m for s in state.surfaces])[surface]
    shifts = np.array([s.shift_m for s in state.surfaces])[surface]
    residual = np.einsum("nj,nj->n", normals, away) - shifts
    local = np.empty((len(away), 3))
    local[:, :2] = np.einsum("nkj,nj->nk", tangents, away)
    local[:, 2] = -1.0
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
    """Laser points in the target frame (reduced): σ² = cos² i σ_r² + sin² i (r σ_a)², i the incidence on the surface."""
    residual, local = _local(state, surface, points_m)
    across = np.sqrt(np.maximum(0.0, 1.0 - cos_incidence**2)) * ranges_m * angle_sigma_rad
    sigma = np.hypot(cos_incidence * range_sigma_m, across)
    return Rows(surface, residual, sigma, None, local, np.zeros(len(surface), dtype=np.int64))


def sounding_rows(
    state: State,
    surface: Integers,
    points_mbes_m: Array,
    positions_m: Array,
    R_target_from_body: Array,  # noqa: N803
    range_sigma_m: float,
    angle_sigma_rad: float,
) -> Rows:
    """Soundings with their poses (positions reduced): σ² = (n · u)² σ_r² + (n · a)² (r σ_θ)², a the across-track unit vector at the beam.

    The footprint enters through the labels (no edge within it) and through the group's variance factor: on one plane the
    phase detection takes the beam's axis.
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
class Sums:
    """Normal equations and statistics; they add. ``normal`` (k, k) and ``right`` (k,) by group, for variance components."""

    normal: Mapping[str, Array]
    right: Mapping[str, Array]
    squares: Mapping[str, float]  # Σ weight v² / σ², without the variance factor
    weights: Mapping[str, float]
    counts: Mapping[str, int]
    cut: Mapping[str, int]
    reduced: Mapping[str, int]
    histograms: Mapping[str, Array]

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(*(_add(getattr(self, name), getattr(other, name)) for name in self.__dataclass_fields__))


def _add(first: Mapping[str, object], second: Mapping[str, object]) -> dict[str, object]:
    keys = [name for name in GROUPS if name in first or name in second]
    return {
        name: first[name] + second[name] if name in first and name in second else first.get(name, second.get(name))  # type: ignore[operator]
        for name in keys
    }


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
    normal: dict[str, Array] = {}
    right: dict[str, Array] = {}
    statistics: list[dict[str, object]] = [{} for _ in range(6)]
    for number in np.unique(rows.group).tolist():
        name, inside = GROUPS[number], rows.group == number
        normal[name], right[name] = np.zeros((state.size, state.size)), np.zeros(state.size)
        for surface in np.unique(rows.surface[inside]).tolist():
            use = np.flatnonzero(inside & (rows.surface == surface))
            design, columns = rows.local[use], state.columns(surface)
            if rows.common is not None:
                design, columns = np.hstack([rows.common[use], design]), [*range(COMMON), *columns]
            weighted = design * full[use, None]
            normal[name][np.ix_(columns, columns)] += weighted.T @ design
            right[name][columns] -= weighted.T @ rows.residual_m[use]
        w = robust[inside]
        values = (
            float(np.sum(w * normalised[inside] ** 2)),
            float(np.sum(w)),
            int(inside.sum()),
            int(np.sum(w == 0)),
            int(np.sum((w < 1) & (w > 0))),
            histogram(normalised[inside]),
        )
        for store, value in zip(statistics, values, strict=True):
            store[name] = value
    return Sums(normal, right, *statistics)  # type: ignore[arg-type]


@dataclass(frozen=True)
class LaserMoments:
    """Σ w / σ² · y yᵀ, y = (X - c, 1), per surface (s, 4, 4); and the same statistics as :class:`Sums`.

    The laser's share of the normal equations is a quadratic form of y, so after one pass over the points every iteration
    takes it from here.
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
        one = "laser"
        return Sums(
            {one: normal}, {one: right}, {one: squares}, {one: self.weights},
            {one: self.count}, {one: self.cut}, {one: self.reduced}, {one: self.histogram},
        )  # fmt: skip


def laser_moments(state: State, rows: Rows, points_m: Array) -> LaserMoments:
    """One chunk's moments of the (reduced) laser points (n, 3), with the weights of ``state``."""
    robust, _ = weights_of(state, rows)
    moments = np.zeros((len(state.surfaces), 4, 4))
    for k, surface in enumerate(state.surfaces):
        use = rows.surface == k
        y = np.column_stack([points_m[use] - surface.centre_m, np.ones(int(use.sum()))])
        moments[k] = (y * (robust[use] / rows.sigma_m[use] ** 2)[:, None]).T @ y
    return LaserMoments(
        moments,
        float(robust.sum()),
        len(robust),
        int(np.sum(robust == 0)),
        int(np.sum((robust < 1) & (robust > 0))),
        histogram(rows.residual_m / rows.sigma_m),
    )
