"""Rays through water whose sound speed changes with depth: layers of constant gradient, each an exact arc.

At depth D in a layer the speed is c(D) = c_0 + g (D - D_0). With θ the ray's angle from straight down, Snell's law is
sin θ / c = p. From dD / dt = c cos θ and cos θ dθ = p g dD follows dθ / dt = g sin θ, so that after a time t

    tan(θ_1 / 2) = tan(θ_0 / 2) exp(g t),     D_1 = D_0 + (c_1 - c_0) / g,  c_1 = c_0 sin θ_1 / sin θ_0,
    x_1 - x_0 = (cos θ_0 - cos θ_1) / (p g)

(Medwin & Clay 1998, 3.3). The half-angle form also holds for a ray that turns back, its θ passing 90°. Layers are
crossed one after the other. Above the first and below the last point of the cast the speed is constant.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEAST_RAD = 1e-7  # smallest angle from the vertical; rays nearer to it get this angle
LEAST_GRADIENT = 1e-6  # 1/s: a smaller one bends no ray (0.03 µm in 10 m), and the arc's formula would divide by it


@dataclass(frozen=True)
class Cast:
    """Sound speed (m,) m/s at depths (m,) m, ascending."""

    depth_m: Array
    speed_m_s: Array

    def speed_at(self, depth_m: Array) -> Array:
        """Return the sound speed (n,) m/s at depths (n,) m."""
        return np.interp(depth_m, self.depth_m, self.speed_m_s)


def trace(cast: Cast, depth_m: Array, angle_rad: Array, time_s: Array) -> tuple[Array, Array]:
    """Return the ends of rays after a travel time: horizontal distance from the start, and depth, (n,) m each.

    Parameters
    ----------
    cast
        Sound speed by depth.
    depth_m
        Depths (n,) at which the rays start.
    angle_rad
        Angles (n,) of the rays at the start, from straight down (π: straight up).
    time_s
        Travel times (n,).
    """
    theta = np.clip(np.array(angle_rad, dtype=np.float64), LEAST_RAD, np.pi - LEAST_RAD)
    depth, left = np.array(depth_m, dtype=np.float64), np.array(time_s, dtype=np.float64)
    across = np.zeros_like(depth)
    speed = cast.speed_at(depth)
    edges = cast.depth_m
    gradients = np.concatenate([[0.0], np.diff(cast.speed_m_s) / np.diff(edges), [0.0]])
    bounds = np.concatenate([[-np.inf], edges, [np.inf]])
    going = np.flatnonzero(left > 0)
    layer = np.searchsorted(edges, depth, side="right")  # an upper edge belongs to its layer
    layer -= (theta > np.pi / 2) & np.isin(depth, edges)  # a ray upward from an edge starts in the layer above
    while len(going):
        k, t0, c0, d0 = layer[going], theta[going], speed[going], depth[going]
        g = gradients[k]
        straight = np.abs(g) < LEAST_GRADIENT
        g = np.where(straight, LEAST_GRADIENT, g)
        out, down = _exit(t0, c0, d0, np.where(straight, 0.0, g), (bounds[k], bounds[k + 1]))
        t = np.minimum(out, left[going])
        tangent = np.tan(t0 / 2)
        # half the turn and the mean angle: so no nearly equal numbers are subtracted
        half = np.where(straight, 0.0, np.arctan(tangent * np.expm1(g * t) / (1 + tangent**2 * np.exp(g * t))))
        t1, mean = t0 + 2 * half, t0 + half
        bow = np.where(straight, c0 * t / 2, np.sin(half) / g * c0 / np.sin(t0))
        across[going] += 2 * bow * np.sin(mean)
        depth[going] = d0 + 2 * bow * np.cos(mean)
        theta[going], speed[going] = t1, c0 * np.sin(t1) / np.sin(t0)
        left[going] -= t
        leaves = out <= t
        layer[going] = np.where(leaves, k + np.where(down, 1, -1), k)
        edge = np.where(down, bounds[k + 1], bounds[k])
        depth[going] = np.where(leaves, edge, depth[going])
        going = going[left[going] > 1e-12]
    return across, depth


def _exit(
    theta: Array, speed: Array, depth: Array, gradient: Array, layer: tuple[Array, Array]
) -> tuple[Array, NDArray[np.bool_]]:
    """Return the times (n,) until rays leave their layers, infinite if never, and a mask (n,): true for downward."""
    exit_time, downward = np.full(len(theta), np.inf), np.zeros(len(theta), dtype=bool)
    upper, lower = layer
    for edge, down in ((lower, True), (upper, False)):
        with np.errstate(invalid="ignore"):
            there = speed + gradient * (edge - depth)
            sine = np.sin(theta) * there / speed
        reaches = np.isfinite(edge) & (sine <= 1) & (sine > 0)
        flat = np.arcsin(np.where(reaches, sine, 0.5))
        end = flat if down else np.pi - flat
        with np.errstate(divide="ignore", invalid="ignore"):
            bent = np.log(np.tan(end / 2) / np.tan(theta / 2)) / gradient
            time = np.where(gradient == 0.0, (edge - depth) / (speed * np.cos(theta)), bent)
        sooner = reaches & (time > 1e-15) & (time < exit_time)
        exit_time, downward = np.where(sooner, time, exit_time), np.where(sooner, down, downward)
    return exit_time, downward
