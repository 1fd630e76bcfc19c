"""Rays in layers against the ray equation integrated, and against another program's case."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pipeline.maths.sonar.ray_tracing import Cast, trace

CAST = Cast(np.array([0.0, 1.0, 2.5, 4.0]), np.array([1500.0, 1497.0, 1503.0, 1499.0]))


def integrated(cast: Cast, depth: float, angle: float, time: float) -> tuple[float, float]:
    """dD/dt = c cos t, dx/dt = c sin t, dt/dt = g sin t; the gradient is that of the layer one is in."""

    def rate(_: float, y: np.ndarray) -> list[float]:
        d, _, theta = y
        c = float(cast.speed_at(np.array([d]))[0])
        k = np.searchsorted(cast.depth_m, d, side="right") - 1
        inside = 0 <= k < len(cast.depth_m) - 1
        g = (cast.speed_m_s[k + 1] - cast.speed_m_s[k]) / (cast.depth_m[k + 1] - cast.depth_m[k]) if inside else 0.0
        return [c * np.cos(theta), c * np.sin(theta), g * np.sin(theta)]

    end = solve_ivp(rate, (0, time), [depth, 0.0, angle], rtol=1e-10, atol=1e-12, max_step=time / 500).y[:, -1]
    return float(end[1]), float(end[0])


@pytest.mark.parametrize("depth", [0.0, 0.7, 1.0, 3.9, 5.0])
@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 80.0, 89.5, 90.5, 110.0, 179.0])
def test_arcs_are_the_ray_equations(depth: float, angle_deg: float) -> None:
    angle, time = np.radians(angle_deg), 0.006
    x, d = trace(CAST, np.array([depth]), np.array([angle]), np.array([time]))
    expected = integrated(CAST, depth, angle, time)
    np.testing.assert_allclose([x[0], d[0]], expected, atol=2e-5)


def test_a_ray_turns_back_where_the_water_is_too_fast() -> None:
    """c = 1500 + 2 D: from 80° the ray reaches sin t = 1 at c = 1500 / sin 80°, and comes up again, mirrored."""
    cast = Cast(np.array([0.0, 100.0]), np.array([1500.0, 1700.0]))
    start = np.radians(80.0)
    deepest = (1500 / np.sin(start) - 1500) / 2
    to_there = -np.log(np.tan(start / 2)) / 2
    x, d = (values[0] for values in trace(cast, np.zeros(1), np.array([start]), np.array([to_there])))
    assert d == pytest.approx(deepest)
    far, up = (values[0] for values in trace(cast, np.zeros(1), np.array([start]), np.array([2 * to_there])))
    assert up == pytest.approx(0.0, abs=1e-9)
    assert far == pytest.approx(2 * x)


def test_water_of_one_speed_bends_nothing() -> None:
    cast = Cast(np.array([0.0, 3.0, 8.0]), np.full(3, 1480.0))
    angles, times = np.radians([0.0, 40.0, 89.0, 135.0]), np.full(4, 0.008)
    x, d = trace(cast, np.full(4, 2.0), angles, times)
    np.testing.assert_allclose(x, 1480 * 0.008 * np.sin(angles), atol=2e-6)
    np.testing.assert_allclose(d, 2 + 1480 * 0.008 * np.cos(angles), atol=2e-6)


def test_the_first_order_of_the_adjustment_is_its_limit() -> None:
    """(g r² / 2c)(e_z - 2 d_z d) of maths/adjustment/design_matrix.py, z up."""
    g, c, r = 0.2, 1480.0, 9.0
    cast = Cast(np.array([0.0, 30.0]), np.array([c - 15 * g, c + 15 * g]))
    for angle in np.radians([10.0, 45.0, 75.0, 100.0]):
        x, d = trace(cast, np.array([15.0]), np.array([angle]), np.array([r / c]))
        ray = np.array([np.sin(angle), -np.cos(angle)])  # across, up
        moved = g * r**2 / (2 * c) * (np.array([0.0, 1.0]) - 2 * ray[1] * ray)
        np.testing.assert_allclose([x[0], 15.0 - d[0]], r * ray + moved, atol=2e-5)
