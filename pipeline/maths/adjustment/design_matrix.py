"""The design matrix: from points to observations v, and the derivatives of v by each parameter.

A row of the design matrix, the derivatives of one v by all parameters, is the product q · C. The *features*
q = (1, α, β, …) (F,) belong to the point: a constant, its coordinates along the surface, and further numbers. The
*interval design* C (F, m) belongs to the interval between two INS records and is computed once for all its points, as
is K, the design of pose errors.

**A point.** All vectors have components along the surface's own axes t1, t2, n. With the range ρ, the ray's unit vector
d and, for the sonar, a = ∂d/∂θ across the receive beam (:mod:`pipeline.maths.sonar.soundings`), a point's covariance is

    laser:   σ_ρ² d dᵀ + ρ² σ_a² (1 - d dᵀ)
    sonar:   σ_ρ² d dᵀ + ρ² σ_θ² a aᵀ

(the sonar does not measure along track), and the variance of v is σ² = nᵀ Σ n. The footprint enters through the labels
(no edge within it) and through the variance factor: on one plane the phase detection measures the beam's axis.

The design is computed at the adjusted point, not at the measured one. Noise moves the point along the surface as well.
So v and α, β are correlated, and Σ w α v would be off by σ_ρ² (n · d)(t1 · d) per point (errors in variables). If the
points of an interval spread over decimetres only, that turns the heading by hundredths of a degree. The *slopes* are
the changes of each feature with e, the sensor's noise in v (see :func:`sensor_noise`); feature - slope · e is
uncorrelated with e.

* Laser: range and angles are measured, and the least squares correction of a point is -Σ n e / (nᵀ Σ n)
  (Gauss-Helmert). So the slopes of α and β are t_k · Σ n / (nᵀ Σ n).
* Sonar: the recorded angle is not measured. It is the angle at which the beam is formed, and the beam's true axis
  strays from it (Berkson's model of errors in variables). The expected point is the intersection of the *recorded* ray
  with the surface. So all of e is corrected along the ray, d e / (n · d). The labels choose points in the same way;
  with the laser's correction these points would turn a grazed face by 0.2°. (Without any correction 20 000 soundings at
  one distance give a sound speed that is wrong by 0.1 %, five sigmas.)

Two effects of the sonar's angle are of second order. They still reach a fifth of the sigma of roll, because more
soundings do not average them out. (1) A stray axis meets the surface further away on average. With
t = (n · a) / (n · d) the range of an axis off by δ is ρ (1 - t δ + (1/2 + t²) δ²), so that the *mean* is
E v = (n · d) ρ σ_θ² (1/2 + t²). This holds for ∂²d/∂θ² = -d. For a tilted fan, p = sin τ, that derivative is -d + k,
k = (0, p, p² (1 - p²) / c³), and E v is less by ρ σ_θ² (n · k) / 2. (2) ρ in σ must not be the measured range, because
a range too long would get a smaller weight. It is the range of the recorded ray to the surface, ρ - v / (n · d).

Further features. A range b added to every range has the feature n · d. The bias of ranges with incidence i,
cos i = |n · d|, is b (1 / cos i - 1) / (√2 - 1): none at right angles, b at 45°, 6.9 b at 75°. It changes v by n · d
times that, so that its feature is (s - n · d) / (√2 - 1) with s the sign of n · d. This is -1 on most faces, and +1 on
the bottoms of the horizontal family, whose normal is that of the tops. For the sonar, a sound speed higher by the share
k makes the ranges longer by k, and likewise sin θ and sin τ, because flat arrays steer their beams with the recorded
speed. With (x, y, z) = ρ (s, p, -c) and c² = 1 - s² - p² the point moves by k (2 x, 2 y, z - (x² + y²) / z). Of this
k (x, y, z) is due to the ranges, and the rest, k (x, y, -(x² + y²) / z), to the speed at the arrays, which steers. For
the gradient g = dc/d(depth), c is the speed measured at the head. With D = -d_z s the depth below the head,
ds/dt = c + g D makes the path longer by -g d_z ρ² / 2c. The ray bends away from the faster water, d(d)/ds =
(g / c)(e_z - d_z d), so that the point moves by (g ρ² / 2c)(e_z - 2 d_z d), first order in g. A transmitter that sits
at o + δ, not at o, from the receiver makes the range of the same path longer by δ · (x - o) / (L - o · d)
(:func:`~pipeline.maths.sonar.soundings.points_in_mbes`, differentiated by o). With L = 2 ρ this is δ · d / 2 but for
the share |o| / ρ, which is neglected. So the features of its components are n · d d_k / 2, d in frame mbes. A bow of
the wet faces by 1 m moves the surface by the feature 4 h (1 - h), h the point's height above the faces' lower end as a
share of the depth D there; with e it changes by 4 (1 - 2 h) (up · d) / (D n · d).

**An interval.** With q = (1, α, β, …), α = t1 · r, β = t2 · r, every derivative of v = n · (X - c) - shift is q times a
column of C or K. The column is the same for the whole interval (:mod:`pipeline.maths.adjustment.interval_sums`). With
the body at p, T = R_target_from_body, its velocity (ṗ, ω) in the target frame and the sensor's lever arm l:

    pose error, target frame:  δ: n · δ                        ω: ω · (r × n) = β (t1 · ω) - α (t2 · ω)
    lever arm λ, body axes:    Tᵀ n
    rotation ε, body axes:     n · T(ε × u), u = R x = Tᵀ r - l,  = ε · Tᵀ((r - T l) × n)
                               = -Tᵀ(T l × n) + β Tᵀ t1 - α Tᵀ t2
    latency τ:                 the pose is taken earlier by τ: as a pose error -τ (ṗ, ω)
    turns of the surface:      t_k · (X - c) = t_k · (p - c) + (α or β)
    its shift:                 -1
    further features:          each is a derivative itself
    level range:               n · d if the surface is horizontal, else 0

The turns need no reduction of X - c by a horizontal face's height: the reduction is along n, and t_k · n = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.body_motion import BodyPoses
from pipeline.maths.adjustment.interval_sums import N_MOVED, Runs
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import FEATURES, State, kind_of
from pipeline.maths.adjustment.pose_errors import N_POSE
from pipeline.maths.kernels.compiled import block
from pipeline.maths.kernels.interval_designs import Form, Plane, design_intervals
from pipeline.maths.sonar.soundings import across_beam

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SPEED_M_S = 1480.0  # sound speed for the gradient's feature: a nominal value, as the effect is small
FLATTEST = 0.05  # smallest |n · d|, 3°: flatter than any labelled ray, once the mount is nearly right
STEEPEST = 0.02  # smallest |c| for the feature of the sound speed, which divides by c
AT_45_DEG = float(np.sqrt(2) - 1)  # 1 / cos i - 1 at 45°
FLATTEST_FAN = 0.25  # smallest |c| for the curvature of a tilted fan: 15° from the array's plane


@dataclass(frozen=True)
class SensorSigmas:
    """Standard deviations of a sensor's range (m) and angle (rad)."""

    range_m: float
    angle_rad: float


class PointDesign(NamedTuple):
    """Design of n points: mean and sigma (n,) m of v, features q (F, n), slopes (F - 1, n) of all except the first."""

    mean_m: Array
    sigma_m: Array
    features: Array
    slopes: Array


def laser_point_design(r: Array, lever_arm: Array, range_m: Array, sigmas: SensorSigmas) -> PointDesign:
    """Return the design of laser points, F = 5.

    A row of the design matrix is q · C: a point's features q times its interval's design C of
    :func:`parameter_design`. A feature is a number of the point that multiplies a row of C. For the laser the features
    are q = (1, α, β, n · d, …): constant, coordinates along the surface (m), derivatives of v by the range and by the
    bias with incidence.

    Parameters
    ----------
    r : (3, n) array
        Vectors from the body to the points, m, surface axes.
    lever_arm : (3, n) array
        The laser's lever arm, m, surface axes.
    range_m : (n,) array
        Measured ranges.
    sigmas : SensorSigmas
        Standard deviations of the laser.
    """
    ray = (r - lever_arm) / range_m
    across = (range_m * sigmas.angle_rad) ** 2
    along = ray[2] * (sigmas.range_m**2 - across)
    variance = along * ray[2] + across
    turning = across / range_m * (1 - ray[2] * ray[2])
    slopes = np.stack([along * ray[0], along * ray[1], turning, -turning / AT_45_DEG])
    slopes /= variance
    features = np.stack([np.ones_like(range_m), r[0], r[1], ray[2], _by_incidence(ray[2])])
    return PointDesign(np.zeros_like(range_m), np.sqrt(variance), features, slopes)


@dataclass(frozen=True)
class SoundingsOnSurface:
    """Soundings of one surface.

    points_m (3, n), in the sonar's frame; axes (3, 3, n): the surface's t1, t2, n (axis k, component i, point n) in the
    sonar's frame; up (3, n): the target frame's z axis, in the sonar's frame; r (3, n): vectors from the body to the
    points, m, surface axes; v_m (n,): distances from the surface; height (n,): heights above the lower end of the wet
    faces, as a share of its depth ``depth_m``.
    """

    points_m: Array
    axes: Array
    up: Array
    r: Array
    v_m: Array
    height: Array
    depth_m: float


def _by_incidence(slant: Array) -> Array:
    """Return the feature (n,) of the bias with incidence, by n · d."""
    return np.asarray((np.sign(slant) - slant) / AT_45_DEG)


def sonar_point_design(soundings: SoundingsOnSurface, sigmas: SensorSigmas) -> PointDesign:
    """Return the design of soundings, F = 12; see the module's docstring for each formula.

    The features q = (1, α, β, …) multiply the rows of :func:`parameter_design`. Those beyond β are the derivatives of v
    by ``MBES_FEATURES`` of :mod:`~pipeline.maths.adjustment.parameters`, and the form of a bow.
    """
    points_m, axes, r = soundings.points_m, soundings.axes, soundings.r
    x, y, z = points_m
    range_m = np.sqrt(np.einsum("in,in->n", points_m, points_m))
    ray = np.einsum("kin,in->kn", axes, points_m) / range_m
    slant = np.copysign(np.maximum(np.abs(ray[2]), FLATTEST), ray[2])
    reached_m = np.clip(range_m - soundings.v_m / slant, range_m / 2, 2 * range_m)
    side = np.einsum("in,in->n", axes[2], across_beam(x, y, z)) / range_m  # n · a
    variance = (sigmas.range_m * ray[2]) ** 2 + (reached_m * sigmas.angle_rad * side) ** 2
    mean = slant * reached_m * sigmas.angle_rad**2 * (0.5 + (side / slant) ** 2)
    mean -= _curvature(axes[2], y / range_m, -z / range_m) * reached_m * sigmas.angle_rad**2 / 2
    down = np.copysign(np.maximum(np.abs(z), STEEPEST * range_m), -z)
    steering = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * (x * x + y * y) / down
    speed = steering + ray[2] * range_m
    up_of_ray = np.einsum("in,in->n", soundings.up, points_m) / range_m
    up_of_normal = np.einsum("in,in->n", soundings.up, axes[2])
    gradient = (up_of_normal - 2 * up_of_ray * ray[2]) * range_m**2 / (2 * SPEED_M_S)
    projector, zero = points_m * (ray[2] / (2 * range_m)), np.zeros_like(x)
    bow, bent = 4 * soundings.height * (1 - soundings.height), 4 * (1 - 2 * soundings.height) / soundings.depth_m
    incidence = _by_incidence(ray[2])
    features = np.stack([np.ones_like(x), r[0], r[1], ray[2], speed, gradient, steering, *projector, incidence, bow])
    by_range = [ray[0], ray[1], zero, speed / range_m, 2 * gradient / range_m, steering / range_m, *[zero] * 4]
    return PointDesign(mean, np.sqrt(variance), features, np.stack([*by_range, bent * up_of_ray]) / slant)


def _curvature(normal: Array, p: Array, c: Array) -> Array:
    """Return n · k (n,) of a tilted fan, with normals (3, n); bounded where its cones touch."""
    steep = np.copysign(np.maximum(np.abs(c), FLATTEST_FAN), c)
    return np.asarray(normal[1] * p + normal[2] * p**2 * (1 - p**2) / steep**3)


def sensor_noise(v_m: Array, weight: Array, intervals: Runs, common_m: Array) -> Array:
    """Return e (n,), the sensor's own noise in v; the rest of v is common to the points of an interval.

    With v = e + w, w ~ N(0, s²) common to the interval, the best linear estimate of w is λ v̄ with v̄ = Σ p v / Σ p and
    λ = s² / (s² + 1 / Σ p). If e were all of v, the correction would move α with w and turn the heading again, in the
    opposite sense: by 0.4 sigma at 2 mm.

    s must be true, not only stated. Let the true sigma be s₀, with λ₀, and let the normal equations weight v by
    V⁻¹ = P - λ' P 1 1ᵀ P / Σ p, with their own λ'. With ê = v - λ v̄ for e, the noise of α = slope · e, and
    E Σ p v̄² = 1 + s₀² Σ p = 1 / (1 - λ₀), an interval of n points adds

        E (slope · (e - ê)ᵀ V⁻¹ v) = slope · ((n - λ') - (n - 1) - (1 - λ) (1 - λ') / (1 - λ₀))
                                   = slope · (1 - λ') (λ - λ₀) / (1 - λ₀)

    to the right side of the normal equations. With an INS without white noise (λ₀ = 0), 2 mm in the design (λ = 0.9 for
    25 laser points) and the right value in the weights (λ' = 0), 0.9 of one point's product stays in each interval, 3 %
    of all. It turns the slanted faces. As long as the poses count as true, the wall holds these faces. If the drift may
    move the body from face to face, the lever arm along the track is wrong by 0.4 mm, 0.6 sigma. So s has the variance
    factor that the laser's points show (:func:`pipeline.maths.adjustment.weighting.noise_seen_by_laser`).

    Parameters
    ----------
    v_m : (n,) array
        Distances from the surface.
    weight : (n,) array
        Weights p.
    intervals : Runs
        The points of each interval.
    common_m : (n,) array
        Standard deviations s (:func:`pipeline.maths.adjustment.weighting.common_variance`).
    """
    p = intervals.total(weight)
    mean = np.divide(intervals.total(weight * v_m), p, out=np.zeros_like(p), where=p > 0)
    information = common_m**2 * intervals.spread(p)
    return np.asarray(v_m - information / (1 + information) * intervals.spread(mean))


@dataclass(frozen=True)
class SensorOnSurface:
    """One sensor's observations of one surface.

    lever_arm_m (3,), body axes; surface: number of the surface; features: number F of features.
    """

    sensor: str
    lever_arm_m: Array
    surface: int
    features: int


def pose_design(surfaces: Sequence[ObservedSurface], surface: Integers) -> Array:
    """Return the design K (g, 3, 6) of pose errors (δ, ω), a row for each of 1, α, β, by surface number (g,)."""
    blocks = np.zeros((len(surfaces), N_MOVED, N_POSE))
    for of_surface, plane in zip(blocks, surfaces, strict=True):
        first, second = plane.tangents
        of_surface[0, :3], of_surface[1, 3:], of_surface[2, 3:] = plane.normal, -second, first
    return blocks[surface]


def parameter_design(state: State, observed: SensorOnSurface, poses: BodyPoses) -> Array:
    """Return the interval design C (g, F, m) of the parameters :meth:`State.columns`.

    A row of the design matrix is q · C, the point's features q times this design. A feature is a number of the point
    (1, α, β, n · d, …) that multiplies a row of C.

    Parameters
    ----------
    state : State
        Current values of all parameters.
    observed : SensorOnSurface
        The sensor and the surface.
    poses : BodyPoses
        The body at each of g intervals.
    """
    plane = state.surfaces[observed.surface]
    design = np.zeros((len(poses.rates), observed.features, len(state.columns(observed.sensor, observed.surface))))
    kind = kind_of(observed.sensor)
    wet, further = kind == "mbes", len(FEATURES[kind])
    form = Form(further, level_range=wet and plane.level, wet=wet, bow=wet and not plane.level)
    seen = Plane(*map(block, (plane.normal, plane.tangents, plane.centre_m, observed.lever_arm_m)))
    positions_m, T, rates = map(block, (poses.positions_m, poses.R_target_from_body, poses.rates))
    design_intervals(positions_m, T, rates, seen, form, design)
    return design
