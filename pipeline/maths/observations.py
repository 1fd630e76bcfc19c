"""From points to observations: distance from the surface, its sigma, and the features that its design needs.

All vectors are given by their components along the surface's own axes t1, t2, n. With ρ the range, d the ray's unit
vector and, of the sonar, a = d(r d)/dθ / r the unit vector across the beam, a point's covariance is

    laser:   σ_ρ² d dᵀ + ρ² σ_a² (1 - d dᵀ)
    sonar:   σ_ρ² d dᵀ + ρ² σ_θ² a aᵀ

(along track the sonar does not measure), and that of v is σ² = nᵀ Σ n. The footprint enters through the labels (no edge
within it) and through the variance factor: on one plane the phase detection takes the beam's axis.

The design is taken at the adjusted point, not at the measured one. Noise along the ray moves the point along the
surface as well, so v and α, β are correlated, and Σ w α v would be off by σ_ρ² (n · d)(t1 · d) a point (errors in
variables): where the points of a moment spread over decimetres, that turns the heading by hundredths of a degree. The
least squares correction of a point is -Σ n v / (nᵀ Σ n) (Gauss-Helmert), after which α and β carry no noise that v
knows of.

Further features: range b added to every range: n · d. Sonar, sound speed higher by the share k: ranges grow by k, and
so does sin θ, for the receive beams of a flat array are steered with the recorded speed; with x = ρ (sin θ, 0, -cos θ)
the point moves by k (2 x, 0, z - x² / z). Gradient g = dc/d(depth), c what the head measures: with D = -d_z s the depth
below the head, ds/dt = c + g D makes the path longer by -g d_z ρ² / 2c, and the ray bends away from the faster water,
d(d)/ds = (g / c)(e_z - d_z d), so that the point moves by (g ρ² / 2c)(e_z - 2 d_z d), first order in g.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SPEED_M_S = 1480.0  # of sound, where only the size of a small effect depends on it
STEEPEST = 0.02  # cos θ: flatter beams are not steered by sin θ


@dataclass(frozen=True)
class Sigmas:
    """Of range (m) and angle (rad)."""

    range_m: float
    angle_rad: float


def laser_observations(r: Array, lever_arm: Array, range_m: Array, v_m: Array, sigmas: Sigmas) -> tuple[Array, Array]:
    """sigma (n,) m and features (4, n); r (3, n) from the body to the point, lever_arm (3, n), in surface axes."""
    ray = (r - lever_arm) / range_m
    across = (range_m * sigmas.angle_rad) ** 2
    along = ray[2] * (sigmas.range_m**2 - across)
    variance = along * ray[2] + across
    share = v_m * along / variance
    return np.sqrt(variance), np.stack([np.ones_like(v_m), r[0] - share * ray[0], r[1] - share * ray[1], ray[2]])


def sonar_observations(
    points_m: Array, axes: Array, up: Array, r: Array, v_m: Array, sigmas: Sigmas
) -> tuple[Array, Array]:
    """sigma (n,) m and features (6, n).

    points (3, n), axes (3, 3, n) the surface's t1, t2, n, up (3, n): all in the sonar's frame; r (3, n) from the body,
    in surface axes; all (k, i, n): axis k, component i.
    """
    x, _, z = points_m
    range_m = np.sqrt(np.einsum("in,in->n", points_m, points_m))
    ray = np.einsum("kin,in->kn", axes, points_m) / range_m
    side = axes[:, 2] * x - axes[:, 0] * z  # ρ a = (-z, 0, x)
    along, aside = sigmas.range_m**2 * ray[2], sigmas.angle_rad**2 * side[2]
    variance = along * ray[2] + aside * side[2]
    first, second = (r[k] - v_m * (along * ray[k] + aside * side[k]) / variance for k in (0, 1))
    down = np.maximum(-z, STEEPEST * range_m)
    speed = 2 * axes[2, 0] * x + axes[2, 2] * (z + x * x / down)
    up_of_ray = np.einsum("in,in->n", up, points_m) / range_m
    up_of_normal = np.einsum("in,in->n", up, axes[2])
    gradient = (up_of_normal - 2 * up_of_ray * ray[2]) * range_m**2 / (2 * SPEED_M_S)
    return np.sqrt(variance), np.stack([np.ones_like(v_m), first, second, ray[2], speed, gradient])
