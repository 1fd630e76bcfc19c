"""Points in the target frame as a function of the parameters that a registration estimates.

The laser's points and the soundings are registered by the same steps. Only the parameters differ: for the laser the
pose of the target (azimuth, x, y, z), for the soundings the mount (rotation, lever arm). A ``Placement`` hides this.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import exp_so3, rotation_z

Array = NDArray[np.float64]


class Placement(Protocol):
    """Points in the target frame as a function of k parameters, and their derivatives."""

    @property
    def prior_sigmas(self) -> Array:
        """Return the a-priori sigmas (k,) of the parameters, whose expectation is zero."""
        ...

    def points(self, parameters: Array) -> Array:
        """Return the points (n, 3) m in the target frame for ``parameters`` (k,)."""
        ...

    def rows(self, parameters: Array, directions: Array) -> Array:
        """Return the derivatives (n, k) of ``directions · point``, ``directions`` being (n, 3) in the target frame."""
        ...


class SubsetPlacement(Placement, Protocol):
    """A placement of which a search can take a random subset of the points."""

    def subset(self, size: int) -> Placement:
        """Return the same placement of at most ``size`` of its points."""
        ...


@dataclass(frozen=True)
class TargetPose:
    """Laser points in the pool frame, (n, 3) m; parameters (azimuth correction β rad, origin o of the target in pool).

    x_target = Rz(β) (x_pool - o): with the target's y axis β further clockwise than configured, coordinates turn by +β.
    d(g · x_target)/dβ = g · (e_z × x_target), d/do = -gᵀ Rz(β).
    """

    points_pool_m: Array
    prior_sigmas: Array

    def subset(self, size: int) -> "TargetPose":
        """Return the same placement of at most ``size`` of its points."""
        return replace(self, points_pool_m=self.points_pool_m[_random_rows(len(self.points_pool_m), size)])

    def points(self, parameters: Array) -> Array:
        """Return the points (n, 3) m in the target frame for ``parameters`` (4,)."""
        return (self.points_pool_m - parameters[1:]) @ rotation_z(parameters[0]).T

    def rows(self, parameters: Array, directions: Array) -> Array:
        """Return the derivatives (n, 4) of ``directions · point``."""
        placed = self.points(parameters)
        turn = directions[:, 1] * placed[:, 0] - directions[:, 0] * placed[:, 1]
        return np.column_stack([turn, -directions @ rotation_z(parameters[0])])


@dataclass(frozen=True)
class TiltedTarget:
    """Points already in the target frame, (n, 3) m; parameters: a small rotation vector and a shift of the points.

    The derivatives are d(g · x)/dω = x × g (from g · (ω × x)) and d(g · x)/ds = g. They are used once, at zero.
    """

    points_target_m: Array
    prior_sigmas: Array

    def points(self, parameters: Array) -> Array:
        """Return the points (n, 3) m in the target frame for ``parameters`` (6,)."""
        return self.points_target_m @ exp_so3(parameters[:3]).T + parameters[3:]

    def rows(self, parameters: Array, directions: Array) -> Array:
        """Return the derivatives (n, 6) of ``directions · point``."""
        return np.hstack([np.cross(self.points(parameters), directions), directions])


@dataclass(frozen=True)
class MountCorrection:
    """Soundings with their poses; parameters (rotation vector δ, lever arm correction Δl).

    x = p + T (Exp(δ) m + l + Δl), where p (n, 3) m and T (n, 3, 3) are poses of the body in the target frame,
    m = R_body_from_mbes(coarse) x_mbes (n, 3) m and l (3,) m is the coarse lever arm.

    The rows are [u × g_body, g_body], u = Exp(δ) m, g_body = Tᵀ g. They are exact for the increment ε of
    Exp(ε) Exp(δ), and right to a share |δ| / 2 for δ itself, which is enough for an iteration.
    """

    positions_m: Array
    R_target_from_body: Array
    points_body_m: Array
    lever_arm_m: Array
    prior_sigmas: Array

    def subset(self, size: int) -> "MountCorrection":
        """Return the same placement of at most ``size`` of its points."""
        rows = _random_rows(len(self.positions_m), size)
        return replace(
            self,
            positions_m=self.positions_m[rows],
            R_target_from_body=self.R_target_from_body[rows],
            points_body_m=self.points_body_m[rows],
        )

    def points(self, parameters: Array) -> Array:
        """Return the soundings (n, 3) m in the target frame for ``parameters`` (6,)."""
        body = self.points_body_m @ exp_so3(parameters[:3]).T + self.lever_arm_m + parameters[3:]
        return np.asarray(self.positions_m + np.einsum("nij,nj->ni", self.R_target_from_body, body))

    def origins(self, parameters: Array) -> Array:
        """Return the positions (n, 3) m of the sonar in the target frame for ``parameters`` (6,)."""
        return np.asarray(self.positions_m + self.R_target_from_body @ (self.lever_arm_m + parameters[3:]))

    def rows(self, parameters: Array, directions: Array) -> Array:
        """Return the derivatives (n, 6) of ``directions · point``."""
        turned = self.points_body_m @ exp_so3(parameters[:3]).T
        g = np.einsum("nij,ni->nj", self.R_target_from_body, directions)
        return np.hstack([np.cross(turned, g), g])


@dataclass(frozen=True)
class LaserMount:
    """Laser points with their poses; parameters: the pose of the target and the rotation of the laser.

    The parameters are (azimuth correction β, origin o of the target in pool, rotation vector δ), and
    x_target = Rz(β) (p + T (Exp(δ) m + l) - o) with p (n, 3) m and T (n, 3, 3) the poses of the body in the pool frame,
    m = R_body_from_laser(coarse) x_laser (n, 3) m and l (3,) m the lever arm.
    """

    positions_m: Array
    R_pool_from_body: Array
    points_body_m: Array
    lever_arm_m: Array
    prior_sigmas: Array

    def points(self, parameters: Array) -> Array:
        """Return the laser points (n, 3) m in the target frame for ``parameters`` (7,)."""
        return (self._in_pool(parameters) - parameters[1:4]) @ rotation_z(parameters[0]).T

    def _in_pool(self, parameters: Array) -> Array:
        body = self.points_body_m @ exp_so3(parameters[4:]).T + self.lever_arm_m
        return np.asarray(self.positions_m + np.einsum("nij,nj->ni", self.R_pool_from_body, body))

    def rows(self, parameters: Array, directions: Array) -> Array:
        """Return the derivatives (n, 7) of ``directions · point``."""
        placed = self.points(parameters)
        turn = directions[:, 1] * placed[:, 0] - directions[:, 0] * placed[:, 1]
        in_pool = directions @ rotation_z(parameters[0])
        g = np.einsum("nij,ni->nj", self.R_pool_from_body, in_pool)
        turned = self.points_body_m @ exp_so3(parameters[4:]).T
        return np.column_stack([turn, -in_pool, np.cross(turned, g)])


def _random_rows(count: int, size: int) -> NDArray[np.int64]:
    """Return ``size`` random rows, ascending: every n-th point of a grid might lie on one line."""
    return np.sort(np.random.default_rng(0).permutation(count)[:size])
