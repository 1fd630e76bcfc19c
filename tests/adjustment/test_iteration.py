"""The adjustment on points of an own forward model: signs, covariance, single-parameter tests, consider parameters."""

import numpy as np
import pytest
from scipy.stats import chi2

from pipeline.adjustment.consider import sonar_errors
from pipeline.adjustment.iteration import adjust_mount
from pipeline.adjustment.weighted_iteration import estimated_columns
from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.mount import MountSigma
from pipeline.config.pool import Adjust, AsBuilt
from pipeline.config.session import Drift, Ins, White
from pipeline.maths.adjustment.parameter_tests import single_parameter_tests
from pipeline.maths.adjustment.solution import ConsiderErrors, solve
from tests.support.effort import often
from tests.support.forward_points import (
    LASER,
    LASER_LEVER,
    LEVER_TRUE,
    MBES,
    NOISY,
    QUIET,
    error_of,
    made,
    problem,
    solved,
)


def test_without_noise_the_truth_comes_back() -> None:
    found = solved(1, sensors=1e-7)
    assert found.converged
    assert np.abs(error_of(found)[:3]).max() < 1e-7
    assert np.abs(error_of(found)[3:]).max() < 1e-7
    assert np.all(found.weighting.factors["laser"] < 0.01)  # the factors know


@pytest.mark.parametrize("ins", [QUIET, NOISY], ids=["sensors alone", "INS white noise and drift"])
def test_errors_are_as_large_as_the_covariance_says(ins: Ins) -> None:
    """Mean normalised squared error of the mount over repeats within its 99.9 % band, and each factor near one."""
    repeats = often(16, 40)
    squared, factors, left = [], [], []
    for seed in range(100, 100 + repeats):
        found = solved(seed, ins)
        assert found.converged
        e = error_of(found)
        squared.append(e @ np.linalg.solve(found.solution.covariance[:6, :6], e))
        factors.append(np.concatenate(list(found.weighting.factors.values())))
        left.append(found.equations.squares / found.redundancy)
    low, high = chi2.ppf([0.0005, 0.9995], 6 * repeats) / repeats
    assert low < np.mean(squared) < high
    np.testing.assert_allclose(np.mean(factors, axis=0), 1.0, atol=often(0.05, 0.03))
    # the whole model, poses and all, explains what is there
    assert np.mean(left) == pytest.approx(1.0, abs=often(0.016, 0.01))


def test_drift_taken_for_granted_would_be_seen() -> None:
    """The same data with an INS said to be perfect: errors that chance does not make, too large a sum of squares.

    The white noise that the INS is said not to have is found in the sonar's pings, and their sigmas allow for it.
    """
    streams, model = made(7, NOISY)
    trusting = adjust_mount(problem(model, QUIET), streams, Adjust(), 5.0)
    e = error_of(trusting)
    assert e @ np.linalg.solve(trusting.solution.covariance[:6, :6], e) > chi2.isf(1e-12, 6)
    assert np.all(trusting.pings["mbes"].effects.of_mean > 1.5)
    assert trusting.equations.squares / trusting.redundancy > 1.2


@pytest.mark.parametrize(
    ("name", "options", "value"),
    [("mbes_latency", {"latency_s": 0.02}, 0.02), ("sound_speed", {"faster": 0.003}, 0.003)],
)
def test_a_wrong_clock_or_speed_is_found_when_freed(name: str, options: dict[str, float], value: float) -> None:
    """While fixed, its test is far beyond its sigma; estimated by adjust.free, it leaves the mount right again."""
    held = solved(3, NOISY, **options)
    equations, names = held.equations, held.state.names
    nothing = ConsiderErrors(np.zeros(held.state.size))
    found_tests = single_parameter_tests(equations.normal, equations.right, held.solution, nothing)
    tests = {names[one.parameter]: one for one in found_tests}
    assert abs(tests[name].value) > 10 * tests[name].sigma
    found = solved(3, NOISY, Adjust(free=(name,)), **options)
    values = dict(zip(found.state.names, found.state.additional_values(), strict=True))
    place = found.solution.estimated.tolist().index(found.state.names.index(name))
    assert abs(values[name] - value) < 4 * np.sqrt(found.solution.covariance[place, place])
    e = error_of(found)
    assert e @ np.linalg.solve(found.solution.covariance[:6, :6], e) < chi2.ppf(0.999, 6)
    wrong = error_of(held)
    assert wrong @ np.linalg.solve(held.solution.covariance[:6, :6], wrong) > 100


@pytest.mark.parametrize(("true_m", "stated_m", "rtol"), [(0.0, 0.002, 0.02), (0.004, 0.001, 0.03)])
def test_a_wrong_figure_of_the_white_noise_changes_nothing(true_m: float, stated_m: float, rtol: float) -> None:
    """The laser's points show how large it is; weights, design and covariance follow them. (The drift is free.)

    Of the variance of 4 mm they tell 7 % too much here; one sigma is 15 %.
    """
    true, stated = (NOISY.model_copy(update={"white": White(position_m=m, attitude_deg=0)}) for m in (true_m, stated_m))
    streams, model = made(1, true)
    expected, found = (adjust_mount(problem(model, ins), streams, Adjust(), 5.0) for ins in (true, stated))
    sigma, sigma_found = (np.sqrt(np.diag(one.solution.covariance))[:6] for one in (expected, found))
    np.testing.assert_array_less(np.abs(error_of(found) - error_of(expected)), 0.1 * sigma)  # it is known to 0.2 mm
    np.testing.assert_allclose(sigma_found, sigma, rtol=rtol)


def test_wrong_figures_of_the_white_noise_give_the_same() -> None:
    """A quarter of the true 4 mm, and three times as much: the points alone tell it."""
    wrong = [NOISY.model_copy(update={"white": White(position_m=m, attitude_deg=0)}) for m in (0.001, 0.012)]
    streams, model = made(1, NOISY.model_copy(update={"white": White(position_m=0.004, attitude_deg=0)}))
    first, second = (adjust_mount(problem(model, ins), streams, Adjust(), 5.0) for ins in wrong)
    sigma, again = (np.sqrt(np.diag(one.solution.covariance))[:6] for one in (first, second))
    np.testing.assert_allclose(again, sigma, rtol=0.002)
    np.testing.assert_array_less(np.abs(error_of(second) - error_of(first)), 0.02 * sigma)


def test_what_is_considered_adds_what_it_would_move() -> None:
    """The sensitivity is the change of the result when a fixed value is moved; the total adds its square."""
    found = solved(5, NOISY)
    normal, right, names = found.equations.normal, found.equations.right, found.state.names
    free = estimated_columns(found.state)
    for name in ("laser_rotation_y", "sound_speed_gradient", "wet_P2_shift"):
        number = names.index(name)
        place = found.solution.fixed.tolist().index(number)
        moved = solve(normal, right + 1e-3 * normal[:, number], free)
        change = (moved.step - solve(normal, right, free).step)[free] / 1e-3
        np.testing.assert_allclose(found.solution.sensitivity[:, place], change, rtol=1e-6, atol=1e-9)
        sigmas = np.zeros(found.state.size)
        sigmas[number] = 0.002
        extra = found.solution.total_covariance(ConsiderErrors(sigmas)) - found.solution.covariance
        np.testing.assert_allclose(extra, 0.002**2 * np.outer(change, change), rtol=1e-6, atol=1e-14)
    together = np.array([[1e-6, 4e-7], [4e-7, 1e-6]])
    pair = np.array([names.index("laser_range"), names.index("mbes_range")])
    S = found.solution.sensitivity[:, [found.solution.fixed.tolist().index(k) for k in pair]]
    total = found.solution.total_covariance(ConsiderErrors(np.zeros(found.state.size), [(pair, together)]))
    np.testing.assert_allclose(total - found.solution.covariance, S @ together @ S.T, rtol=1e-6, atol=1e-14)


def test_a_lasers_mount_covariance_goes_in_whole_and_before_its_sigmas() -> None:
    """C + S Q Sᵀ, Q the (6, 6) of session.yaml, in its order: rotation x, y, z, lever arm x, y, z."""
    found = solved(5, NOISY)
    names, held = found.state.names, found.solution.fixed.tolist()
    root = np.tril(np.random.default_rng(1).normal(size=(6, 6))) * np.repeat([1e-4, 2e-3], 3)[:, None]
    Q = root @ root.T
    block = tuple(map(tuple, Q.tolist()))
    laser = LASER.model_copy(update={"mount_covariance": block, "mount_sigma": MountSigma(angle_deg=40.0)})
    errors = sonar_errors(names, laser, {"mbes": MBES}, AsBuilt(), {})
    sigmas = errors.sigmas
    six = [names.index(f"laser_{kind}_{axis}") for kind in ("rotation", "lever_arm") for axis in "xyz"]
    np.testing.assert_allclose(sigmas[six], np.sqrt(np.diag(Q)), rtol=1e-12)
    others = sigmas.copy()
    others[six] = 0.0
    S = found.solution.sensitivity[:, [held.index(k) for k in six]]
    without = found.solution.total_covariance(ConsiderErrors(others))
    extra = found.solution.total_covariance(errors) - without
    np.testing.assert_allclose(extra, S @ Q @ S.T, rtol=1e-6, atol=1e-14)
    assert not sonar_errors(names, LASER, {"mbes": MBES}, AsBuilt(), {}).blocks


def test_a_laser_turned_about_the_ins_turns_the_sonar_with_it() -> None:
    """Where the INS's own attitude tells nothing, both sensors turn as one body: rotation and lever arm."""
    loose = Ins(
        files=["x"],
        format="table",
        drift=Drift(horizontal_m=0.5, vertical_m=0.5, roll_pitch_deg=3.0, heading_deg=3.0),
    )
    found = solved(6, loose)
    names, held = found.state.names, found.solution.fixed.tolist()
    for axis in range(3):
        turn = np.eye(3)[axis]
        mine = [f"laser_rotation_{'xyz'[axis]}", *(f"laser_lever_arm_{one}" for one in "xyz")]
        S = found.solution.sensitivity[:6, [held.index(names.index(name)) for name in mine]]
        effect = S @ np.concatenate([[1.0], np.cross(turn, LASER_LEVER)])
        np.testing.assert_allclose(effect[:3], turn, atol=2e-3)
        np.testing.assert_allclose(effect[3:], np.cross(turn, LEVER_TRUE), atol=0.1)  # y is weak: the INS pulls


def test_the_wall_alone_leaves_directions_open() -> None:
    streams, model = made(8)
    (laser,), (mbes,) = (stream.parts for stream in streams.values())
    walls = [
        Stream((MemoryPart(part.name, {k: v[part.columns["face"] == 1] for k, v in part.columns.items()}),))
        for part in (laser, mbes)
    ]
    found = adjust_mount(problem(model, QUIET), dict(zip(streams, walls, strict=True)), Adjust(), 5.0)
    assert found.solution.deficiency > 0
    assert not found.converged
    assert np.all(np.isfinite(found.solution.step))
