"""From points to observations: distance from the surface, its sigma, and the features that its design needs.

All vectors are given by their components along the surface's own axes t1, t2, n. With ρ the range, d the ray's unit
vector and, of the sonar, a = ∂d/∂θ across the receive beam (:mod:`pipeline.maths.sonar.soundings`), a point's
covariance is

    laser:   σ_ρ² d dᵀ + ρ² σ_a² (1 - d dᵀ)
    sonar:   σ_ρ² d dᵀ + ρ² σ_θ² a aᵀ

(along track the sonar does not measure), and that of v is σ² = nᵀ Σ n. The footprint enters through the labels (no edge
within it) and through the variance factor: on one plane the phase detection takes the beam's axis.

The design is taken at the adjusted point, not at the measured one. Noise moves the point along the surface as well, so
v and α, β are correlated, and Σ w α v would be off by σ_ρ² (n · d)(t1 · d) a point (errors in variables): where the
points of a moment spread over decimetres, that turns the heading by hundredths of a degree. The *slopes* given back are
by how much each feature changes with e, the sensor's part in v (see :func:`sensor_part`); less slope times e it carries
no noise that v knows of.

* Laser: range and angles are measured, the least squares correction of a point is -Σ n e / (nᵀ Σ n) (Gauss-Helmert):
  α and β by t_k · Σ n / (nᵀ Σ n).
* Sonar: the recorded angle is not measured but intended: a beam is formed at it, and its true axis strays (the other
  model of errors in variables, Berkson's). What is expected of a beam is the point where its *recorded* ray meets the
  surface; so all of e is taken back along the ray, d e / (n · d). That is also what the labels choose points by; with
  the other correction points chosen so turn a grazed face by 0.2°. (And 20 000 soundings at one distance, with none,
  find the sound speed wrong by 0.1 %, at five sigmas.)

Two effects of the sonar's angle are of second order, and yet a fifth of the sigma of roll, for no number of soundings
averages them away. (1) A stray axis meets the surface further away on average: with t = (n · a) / (n · d) the range of
an axis off by δ is ρ (1 - t δ + (1/2 + t²) δ²), so that the *mean* is E v = (n · d) ρ σ_θ² (1/2 + t²). That is with
∂²d/∂θ² = -d; of a tilted fan, p = sin τ, it is -d + k, k = (0, p, p² (1 - p²) / c³), and E v less by ρ σ_θ² (n · k)
/ 2. (2) ρ in σ must not be the measured one: a range too long would get the smaller weight. It is that of the recorded
ray to the surface, ρ - v / (n · d).

Further features: range b added to every range: n · d. Sonar, sound speed higher by the share k: ranges grow by k, and
so do sin θ and sin τ, for the beams of flat arrays are steered with the recorded speed; with (x, y, z) = ρ (s, p, -c)
and c² = 1 - s² - p² the point moves by k (2 x, 2 y, z - (x² + y²) / z). Gradient g = dc/d(depth), c what the head
measures: with D = -d_z s the depth below the head, ds/dt = c + g D makes the path longer by -g d_z ρ² / 2c, and the ray
bends away from the faster water, d(d)/ds = (g / c)(e_z - d_z d), so that the point moves by (g ρ² / 2c)(e_z - 2 d_z d),
first order in g.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.interval_sums import Runs
from pipeline.maths.sonar.soundings import across_beam

Array = NDArray[np.float64]
SPEED_M_S = 1480.0  # of sound, where only the size of a small effect depends on it
FLATTEST = 0.05  # n · d: 3°, flatter than any ray that is used, once the mount is nearly right
STEEPEST = 0.02  # c: flatter beams are not steered by their sines
FLATTEST_FAN = 0.25  # c: 15° from the array's plane


@dataclass(frozen=True)
class Sigmas:
    """Of range (m) and angle (rad)."""

    range_m: float
    angle_rad: float


class Seen(NamedTuple):
    """Of n points: mean of v and its sigma (n,) m, features (F, n), slopes (F - 1, n) of all but the first."""

    mean_m: Array
    sigma_m: Array
    features: Array
    slopes: Array


def laser_observations(r: Array, lever_arm: Array, range_m: Array, sigmas: Sigmas) -> Seen:
    """F = 4; r (3, n) from the body to the point, lever_arm (3, n), in surface axes."""
    ray = (r - lever_arm) / range_m
    across = (range_m * sigmas.angle_rad) ** 2
    along = ray[2] * (sigmas.range_m**2 - across)
    variance = along * ray[2] + across
    slopes = np.stack([along * ray[0], along * ray[1], across / range_m * (1 - ray[2] * ray[2])])
    slopes /= variance
    features = np.stack([np.ones_like(range_m), r[0], r[1], ray[2]])
    return Seen(np.zeros_like(range_m), np.sqrt(variance), features, slopes)


def sonar_observations(points_m: Array, axes: Array, up: Array, r: Array, v_m: Array, sigmas: Sigmas) -> Seen:
    """F = 6. points (3, n), axes (3, 3, n) the surface's t1, t2, n, up (3, n): all in the sonar's frame; r (3, n) from
    the body, in surface axes; all (k, i, n): axis k, component i; v (n,) their distances from the surface."""
    x, y, z = points_m
    range_m = np.sqrt(np.einsum("in,in->n", points_m, points_m))
    ray = np.einsum("kin,in->kn", axes, points_m) / range_m
    slant = np.minimum(ray[2], -FLATTEST)
    reached_m = np.clip(range_m - v_m / slant, range_m / 2, 2 * range_m)
    side = np.einsum("in,in->n", axes[2], across_beam(x, y, z)) / range_m  # n · a
    variance = (sigmas.range_m * ray[2]) ** 2 + (reached_m * sigmas.angle_rad * side) ** 2
    mean = slant * reached_m * sigmas.angle_rad**2 * (0.5 + (side / slant) ** 2)
    mean -= _curvature(axes[2], y / range_m, -z / range_m) * reached_m * sigmas.angle_rad**2 / 2
    down = np.copysign(np.maximum(np.abs(z), STEEPEST * range_m), -z)
    speed = 2 * (axes[2, 0] * x + axes[2, 1] * y) + axes[2, 2] * (z + (x * x + y * y) / down)
    up_of_ray = np.einsum("in,in->n", up, points_m) / range_m
    up_of_normal = np.einsum("in,in->n", up, axes[2])
    gradient = (up_of_normal - 2 * up_of_ray * ray[2]) * range_m**2 / (2 * SPEED_M_S)
    features = np.stack([np.ones_like(range_m), r[0], r[1], ray[2], speed, gradient])
    by_range = np.stack([ray[0], ray[1], np.zeros_like(x), speed / range_m, 2 * gradient / range_m])
    return Seen(mean, np.sqrt(variance), features, by_range / slant)


def _curvature(normal: Array, p: Array, c: Array) -> Array:
    """n · k (n,) of a tilted fan, with normals (3, n); bounded where its cones touch."""
    steep = np.copysign(np.maximum(np.abs(c), FLATTEST_FAN), c)
    return np.asarray(normal[1] * p + normal[2] * p**2 * (1 - p**2) / steep**3)


def sensor_part(v_m: Array, weight: Array, epochs: Runs, common_m: Array) -> Array:
    """e (n,): what of v is the sensor's own noise, the rest being common to an epoch.

    With v = e + w, w ~ N(0, s²) common to the epoch (``common_m`` (n,): s, from the INS's white noise), the best linear
    estimate of w is λ v̄ with v̄ = Σ p v / Σ p and λ = s² / (s² + 1 / Σ p). Taking all of v for the sensor's would move
    α with w and turn the heading again, the other way: by 0.4 sigma at 2 mm.
    """
    p = epochs.total(weight)
    mean = np.divide(epochs.total(weight * v_m), p, out=np.zeros_like(p), where=p > 0)
    information = common_m**2 * epochs.spread(p)
    return np.asarray(v_m - information / (1 + information) * epochs.spread(mean))
