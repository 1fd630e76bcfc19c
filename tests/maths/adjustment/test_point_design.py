"""What a point's noise and a wrong sound speed do to it, against models of their own."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment.design_matrix import (
    PointDesign,
    SensorSigmas,
    SoundingsOnSurface,
    laser_point_design,
    sensor_noise,
    sonar_point_design,
)
from pipeline.maths.adjustment.interval_sums import N_MOVED, Runs
from pipeline.maths.adjustment.parameters import MBES_FEATURES, PROJECTOR_PARAMETERS
from pipeline.maths.geometry.planes import tangents_of
from pipeline.maths.sonar.soundings import points_in_mbes

NORMAL = np.array([-np.sqrt(0.5), -np.sqrt(0.4), np.sqrt(0.1)])
AXES = np.vstack([tangents_of(NORMAL), NORMAL])
R_TARGET_FROM_MBES = Rotation.from_euler("ZXY", np.radians([12.0, 2.0, -48.0])).as_matrix()
LEVER = np.array([0.4, -0.3, -1.9])
SIGMAS = SensorSigmas(0.02, 0.002)
LOWEST_M, DEPTH_M = -12.0, 11.0


def beams(angles: np.ndarray, ranges: np.ndarray, tilts: np.ndarray | float = 0.0) -> np.ndarray:
    """Points (3, n) in the sonar's frame: of a receive beam turned about x until it looks forward by the tilt."""
    about_x = np.arcsin(np.sin(tilts) / np.cos(angles))
    return ranges * np.array([np.sin(angles), np.cos(angles) * np.sin(about_x), -np.cos(angles) * np.cos(about_x)])


def seen(points: np.ndarray, axes: np.ndarray = AXES) -> PointDesign:
    """Observations of points on the surface."""
    n = points.shape[1]
    in_mbes = np.repeat((axes @ R_TARGET_FROM_MBES)[:, :, None], n, axis=2)
    up = np.repeat(R_TARGET_FROM_MBES[2][:, None], n, axis=1)
    r = axes @ (R_TARGET_FROM_MBES @ points + LEVER[:, None])
    soundings = SoundingsOnSurface(points, in_mbes, up, r, np.zeros(n), heights_of(points), DEPTH_M)
    return sonar_point_design(soundings, SIGMAS)


def heights_of(points: np.ndarray) -> np.ndarray:
    """Heights (n,) above the lower end of the wet faces, as a share of the depth."""
    return np.asarray((R_TARGET_FROM_MBES[2] @ points + LEVER[2] - LOWEST_M) / DEPTH_M)


ANGLES, RANGES = np.radians([-60.0, -20.0, 0.0, 25.0, 55.0]), np.array([7.0, 5.0, 4.0, 6.0, 9.0])
TILTS = np.radians([10.0, -0.75, 6.0, -8.0, -10.0])
of_both_fans = pytest.mark.parametrize("tilts", [np.zeros(5), TILTS], ids=["plane", "tilted"])


@of_both_fans
def test_sonar_sigma_is_the_scatter_of_noisy_beams(tilts: np.ndarray) -> None:
    rng = np.random.default_rng(1)
    sigma = seen(beams(ANGLES, RANGES, tilts)).sigma_m
    noise = rng.normal(size=(20_000, 2, 5)) * np.array([0.002, 0.02])[:, None]
    many = [NORMAL @ R_TARGET_FROM_MBES @ beams(ANGLES + one[0], RANGES + one[1], tilts) for one in noise]
    np.testing.assert_allclose(sigma, np.std(many, axis=0), rtol=0.02)


def test_laser_sigma_is_the_scatter_of_noisy_rays() -> None:
    rng = np.random.default_rng(2)
    ray, range_m = np.array([0.8, 0.5, -0.33]), 6.0
    ray /= np.linalg.norm(ray)
    sides = tangents_of(ray)
    noise = 0.02 * rng.normal(size=(40_000, 1)) * ray + 6.0 * 0.002 * rng.normal(size=(40_000, 2)) @ sides
    lever = AXES @ LEVER
    point = (AXES @ (ray * range_m) + lever)[:, None]
    _, sigma, q, _ = laser_point_design(point, lever[:, None], np.array([range_m]), SIGMAS)
    assert sigma[0] == pytest.approx(np.std(noise @ NORMAL), rel=0.02)
    assert q[3, 0] == pytest.approx(NORMAL @ ray)  # a longer range


@of_both_fans
def test_soundings_on_the_other_side_of_a_surface_are_mirrored(tilts: np.ndarray) -> None:
    """With the opposite normal v changes its sign, and with it all that is measured along the normal."""
    front, back = seen(beams(ANGLES, RANGES, tilts)), seen(beams(ANGLES, RANGES, tilts), AXES * [[1.0], [1.0], [-1.0]])
    along = np.array([1.0, 1.0, 1.0, *[-1.0] * len(MBES_FEATURES), 1.0])[:, None]  # 1, α, β; derivatives of v; bow
    np.testing.assert_allclose(back.mean_m, -front.mean_m, rtol=1e-12)
    np.testing.assert_allclose(back.sigma_m, front.sigma_m, rtol=1e-12)
    np.testing.assert_allclose(back.features, along * front.features, rtol=1e-12)
    np.testing.assert_allclose(back.slopes, -along[1:] * front.slopes, rtol=1e-12)


def recomputed(tilts: np.ndarray, true_speed_m_s: float) -> np.ndarray:
    """Points (3, n) of recordings made with 1480 m/s."""
    recorded = np.full(5, 1480.0)
    return points_in_mbes(2 * RANGES / recorded, ANGLES, tilts, recorded, true_sound_speed_m_s=true_speed_m_s)[0].T


def test_beams_that_look_up_have_the_features_of_those_that_look_down() -> None:
    """The world turned upside down about y: what a wrong speed does to a point is turned with it."""
    angles, flip = np.radians([100.0, 120.0, -170.0, -100.0, 95.0]), np.diag([-1.0, 1.0, -1.0])
    points = beams(angles, RANGES, np.radians([5.0, -10.0, 2.0, 0.0, 1.0]))
    assert (points[2] > 0).all()
    axes = np.repeat((AXES @ R_TARGET_FROM_MBES)[:, :, None], 5, axis=2)
    turned = np.einsum("kin,ij->kjn", axes, flip)
    up, r = np.repeat([[0.0], [0.0], [1.0]], 5, axis=1), np.zeros((3, 5))
    found = sonar_point_design(SoundingsOnSurface(points, axes, up, r, np.zeros(5), r[0], DEPTH_M), SIGMAS)
    flipped = SoundingsOnSurface(flip @ points, turned, flip @ up, r, np.zeros(5), r[0], DEPTH_M)
    expected = sonar_point_design(flipped, SIGMAS)
    place = [N_MOVED + MBES_FEATURES.index(name) for name in PROJECTOR_PARAMETERS]
    expected.features[place] = flip @ expected.features[place]  # along the axes of the sonar
    np.testing.assert_allclose(found.features, expected.features, atol=1e-12)
    np.testing.assert_allclose(found.mean_m, expected.mean_m, rtol=1e-9)
    np.testing.assert_allclose(found.sigma_m, expected.sigma_m, rtol=1e-12)


@of_both_fans
def test_the_features_are_what_errors_do_to_the_point(tilts: np.ndarray) -> None:
    """Range and sound speed by moving the measurements: travel time and steering are what was recorded."""
    _, _, q, _ = seen(beams(ANGLES, RANGES, tilts))
    step = 1e-6
    longer = [beams(ANGLES, RANGES + h, tilts) for h in (step, -step)]
    k = [1 + step, 1 - step]
    faster = [beams(np.arcsin(h * np.sin(ANGLES)), RANGES * h, np.arcsin(h * np.sin(tilts))) for h in k]
    for by_hand, one in zip(faster, k, strict=True):
        np.testing.assert_allclose(by_hand, recomputed(tilts, 1480.0 * one), rtol=0, atol=1e-12)
    for number, (ahead, behind) in ((3, longer), (4, faster)):
        slope = NORMAL @ R_TARGET_FROM_MBES @ (ahead - behind) / (2 * step)
        np.testing.assert_allclose(q[number], slope, atol=1e-8)


def feature(name: str, tilts: np.ndarray) -> np.ndarray:
    """The feature (n,) of one of the sonar's parameters."""
    return np.asarray(seen(beams(ANGLES, RANGES, tilts)).features[N_MOVED + MBES_FEATURES.index(name)])


@of_both_fans
def test_the_speed_at_the_arrays_turns_the_beams_and_leaves_the_ranges(tilts: np.ndarray) -> None:
    """sin θ / c and sin τ / c are what the arrays set; the travel time is turned into a range with the other speed."""
    step = 1e-6
    ends = [beams(np.arcsin(k * np.sin(ANGLES)), RANGES, np.arcsin(k * np.sin(tilts))) for k in (1 + step, 1 - step)]
    slope = NORMAL @ R_TARGET_FROM_MBES @ (ends[0] - ends[1]) / (2 * step)
    np.testing.assert_allclose(feature("steering_speed", tilts), slope, atol=1e-8)
    assert np.ptp(slope) > 5  # the same for all would be a shift


def test_a_bow_is_a_parabola_between_the_water_and_the_lower_end() -> None:
    """The height of each point is known: 0, a quarter, half and all of the depth."""
    heights = np.array([0.0, 0.25, 0.5, 1.0, 0.75])
    drop = LOWEST_M + heights * DEPTH_M - LEVER[2]
    rays = beams(ANGLES, np.ones(5))
    points = rays * drop / (R_TARGET_FROM_MBES[2] @ rays)
    np.testing.assert_allclose(seen(points).features[-1], [0.0, 0.75, 1.0, 0.0, 0.75], atol=1e-12)


def along_paths(rays: np.ndarray, paths: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Points (3, n) on unit rays from the receiver whose way to the transmitter and to the receiver is the path."""

    def missing(range_m: float, ray: np.ndarray, path: float) -> float:
        return float(range_m + np.linalg.norm(range_m * ray - offset) - path)

    return rays * [brentq(missing, 0.1, 20.0, one, xtol=1e-14) for one in zip(rays.T, paths, strict=True)]


@of_both_fans
@pytest.mark.parametrize("name", PROJECTOR_PARAMETERS)
def test_a_transmitter_elsewhere_lengthens_the_range_of_the_same_path(name: str, tilts: np.ndarray) -> None:
    rays, moved = beams(ANGLES, np.ones(5), tilts), 1e-4 * np.eye(3)[PROJECTOR_PARAMETERS.index(name)]
    ends = [along_paths(rays, 2 * RANGES, offset) for offset in (moved, -moved)]
    slope = NORMAL @ R_TARGET_FROM_MBES @ (ends[0] - ends[1]) / 2e-4
    np.testing.assert_allclose(feature(name, tilts), slope, atol=1e-8)
    assert np.any(np.abs(slope) > 0.02) or (name == "projector_y" and not np.any(tilts))


@pytest.mark.parametrize("name", PROJECTOR_PARAMETERS)
def test_about_a_known_place_the_transmitters_feature_is_right_but_for_the_share_of_its_distance(name: str) -> None:
    rays, known = beams(ANGLES, np.ones(5), TILTS), np.array([0.02, -0.1, 0.119])
    paths = RANGES + np.linalg.norm(rays * RANGES - known[:, None], axis=0)
    moved = 1e-4 * np.eye(3)[PROJECTOR_PARAMETERS.index(name)]
    ends = [along_paths(rays, paths, known + side * moved) for side in (1, -1)]
    slope = NORMAL @ R_TARGET_FROM_MBES @ (ends[0] - ends[1]) / 2e-4
    assert np.all(np.abs(feature(name, TILTS) - slope) < np.linalg.norm(known) / RANGES)


@of_both_fans
def test_the_gradient_bends_the_ray_as_the_ray_equation_says(tilts: np.ndarray) -> None:
    """Integrated: dX/dt = c d, dd/dt = -(grad c - d (d · grad c)), c = c0 - g z, for the travel time at c0."""
    c0, g = 1480.0, 0.3
    points = beams(ANGLES, RANGES, tilts)
    _, _, q, _ = seen(points)
    for k in range(5):
        start = R_TARGET_FROM_MBES @ points[:, k]
        ray = start / np.linalg.norm(start)

        def rate(_: float, y: np.ndarray) -> np.ndarray:
            grad, d = np.array([0, 0, -g]), y[3:]
            return np.concatenate([(c0 - g * y[2]) * d, -(grad - d * (d @ grad))])

        end = solve_ivp(rate, (0, RANGES[k] / c0), np.concatenate([np.zeros(3), ray]), rtol=1e-11, atol=1e-13).y[:3, -1]
        moved = NORMAL @ (end - start)
        assert q[5, k] * g == pytest.approx(moved, abs=2e-6 + 0.003 * abs(moved))
    assert np.ptp(np.sign(q[5])) == 2  # both signs were tried


@of_both_fans
def test_the_sonars_slopes_are_what_a_shift_along_the_recorded_ray_does(tilts: np.ndarray) -> None:
    """To the surface: by e / (n · d); features taken again."""
    points = beams(ANGLES, RANGES, tilts)
    _, _, q, slopes = seen(points)
    e = 1e-5
    assert np.all(q[3] < -0.1)  # all see the front
    features = [seen(beams(ANGLES, RANGES + h * e / q[3], tilts)).features for h in (1, -1)]
    np.testing.assert_allclose(slopes, (features[0] - features[1])[1:] / (2 * e), rtol=1e-5, atol=1e-7)


def test_beams_that_stray_from_their_recorded_angle_do_not_turn_a_grazed_face() -> None:
    """A floor grazed at 15 to 22 degrees; of beams at fixed angles those are taken whose recorded ray meets it within
    bounds, whatever their noise: v has no slope along the adjusted points, and has one along the measured ones."""
    rng = np.random.default_rng(9)
    n, depth = 400_000, 2.0
    angles = np.radians(rng.uniform(66.0, 77.0, n))
    chosen = np.abs(depth * np.tan(angles) - 6.2) < 1.0
    angles = angles[chosen]
    ranges = depth / np.cos(angles + 0.002 * rng.normal(size=len(angles))) + 0.01 * rng.normal(size=len(angles))
    points = beams(angles, ranges)
    axes = np.repeat(np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])[:, :, None], points.shape[1], axis=2)
    v = points[2] + depth
    soundings = SoundingsOnSurface(points, axes, axes[2], points, v, 0 * v, DEPTH_M)
    _, sigma, q, slopes = sonar_point_design(soundings, SensorSigmas(0.01, 0.002))
    assert sigma == pytest.approx(np.full(len(v), np.std(v)), rel=0.25)

    def slope(along: np.ndarray) -> float:
        w = sigma**-2
        centred = along - w @ along / w.sum()
        return float((w * centred) @ v / ((w * centred) @ centred) * np.sqrt((w * centred) @ centred))

    assert abs(slope(q[1] - slopes[0] * v)) < 4
    assert abs(slope(q[1])) > 20
    side = np.array([np.cos(angles), np.sin(angles)])  # the beam turned: x and z, along t1 and n
    share = (ranges * 0.002 * side[1]) ** 2 / sigma**2  # of the angle in v
    least_squares = share * side[0] / side[1] + (1 - share) * slopes[0]
    assert abs(slope(q[1] - least_squares * v)) > 20  # were the angles measured


@of_both_fans
def test_a_stray_axis_meets_the_surface_further_away_on_average(tilts: np.ndarray) -> None:
    """Axes off by one sigma to either side: the mean of v, and the same sigma whatever the range that was measured."""
    mean, sigma, _, _ = seen(beams(ANGLES, RANGES, tilts))
    found = []
    for angle in (ANGLES + SIGMAS.angle_rad, ANGLES - SIGMAS.angle_rad):
        along, strayed = (NORMAL @ R_TARGET_FROM_MBES @ beams(one, np.ones(5), tilts) for one in (ANGLES, angle))
        found.append(along * RANGES * (along / strayed - 1))
    np.testing.assert_allclose(mean, np.mean(found, axis=0), rtol=1e-3)
    assert np.all(mean < 0)
    points = beams(ANGLES, RANGES + 0.05, tilts)
    n = points.shape[1]
    in_mbes = np.repeat((AXES @ R_TARGET_FROM_MBES)[:, :, None], n, axis=2)
    up = np.repeat(R_TARGET_FROM_MBES[2][:, None], n, axis=1)
    v = 0.05 * NORMAL @ R_TARGET_FROM_MBES @ beams(ANGLES, np.ones(5), tilts)
    soundings = SoundingsOnSurface(points, in_mbes, up, AXES @ (R_TARGET_FROM_MBES @ points), v, 0 * v, DEPTH_M)
    again = sonar_point_design(soundings, SIGMAS)
    np.testing.assert_allclose(again.sigma_m, sigma, rtol=1e-12)


@pytest.mark.parametrize("common_m", [0.0, 0.03])
def test_at_the_adjusted_point_noise_does_not_turn_the_surface(common_m: float) -> None:
    """Rays from one place onto a slanted wall, noise along the ray, and noise common to an epoch: v, weighted as the
    common noise demands, has no slope along the wall."""
    rng = np.random.default_rng(8)
    n, each = 400_000, 20
    rays = Rotation.from_euler("z", rng.uniform(-0.02, 0.02, (n, 1))).apply(np.array([1.0, 0.2, 0.05]))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    true = rays * (-3.0 / (rays @ NORMAL))[:, None]
    epoch = np.repeat(np.arange(n // each), each)
    r = true + rays * 0.05 * rng.normal(size=n)[:, None]
    v = r @ NORMAL + 3.0 + common_m * rng.normal(size=n // each)[epoch]
    ranges = np.linalg.norm(r, axis=1)
    _, sigma, q, slopes = laser_point_design(AXES @ r.T, np.zeros((3, n)), ranges, SensorSigmas(0.05, 0.0))
    own = sensor_noise(v, sigma**-2, Runs.of(epoch), np.full(n, common_m))
    shrink = (common_m**2 / (common_m**2 + sigma**2 / each)).reshape(-1, each)

    def white(values: np.ndarray) -> np.ndarray:
        """Times the inverse covariance of an epoch, sigma² I + common² 1 1ᵀ (sigma nearly the same in one)."""
        by_epoch = values.reshape(-1, each)
        return np.asarray((by_epoch - shrink * by_epoch.mean(axis=1, keepdims=True)).ravel() / sigma**2)

    def slope(along: np.ndarray) -> float:
        centred = along - np.sum(white(along)) / np.sum(white(np.ones(n)))
        return float(white(centred) @ v / (white(centred) @ centred))

    exact = AXES[0] @ true.T
    spread = 1 / np.sqrt(white(exact - exact.mean()) @ (exact - exact.mean()))
    assert abs(slope(q[1])) > 8 * spread  # what a design at the measured points would do
    assert abs(slope(q[1] - slopes[0] * own)) < 4 * spread
    if common_m:
        assert abs(slope(q[1] - slopes[0] * v)) > 4 * spread  # and what taking all of v for the sensor's would do
