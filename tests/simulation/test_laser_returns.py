"""What the laser returns: biases by incidence, splashes, mixed pixels; by hand, of a level, still scanner.

The scanner is at (-5, y, 2.1). The ray at the zenith angle t looks along (sin t, 0, cos t).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from tests.support.level_geometry import LEVEL, STILL

Change = Callable[..., Scenario]


@pytest.fixture
def one_pass(changed: Change, noise_free: Scenario) -> Callable[..., SimulatedSession]:
    def simulated(**laser: Any) -> SimulatedSession:
        given = {"mount": LEVEL | {"z_m": 1.1}, "point_rate_hz": 4000.0, "line_rate_hz": 20.0} | laser
        track = {"distances_m": [5.0], "ins_height_m": 1.0}
        return simulate_session(changed(noise_free, track=track, motion=STILL, laser=given), 1)

    return simulated


def seen(session: SimulatedSession) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ranges (n,), zenith angles (n,), and points (n, 3) in the target frame."""
    x, y, z = (session.laser[name] for name in ("x_m", "y_m", "z_m"))
    along = -4.5 + 0.4 * (session.laser["t_ns"] - session.truth["passes"][0]["start_ns"]) / 1e9
    points = np.stack([x - 5.0, y + along, z + 2.1], axis=1)
    return np.sqrt(x**2 + y**2 + z**2), np.arctan2(x, z), points


def faces(points: np.ndarray) -> dict[str, np.ndarray]:
    """Which points are well within the wall, the slanted faces, tops and bottoms."""
    x, y, z = points.T
    inside = np.abs((z + 0.25) % 0.5 - 0.25) > 0.02
    return {
        "wall": (np.abs(x) < 1e-4) & (np.abs(y) < 1.45) & inside,
        "slanted": (np.abs(np.abs(y) - 1.5 - x) < 1e-4) & (x > 0.05) & (x < 0.95) & inside,
        "level": (np.abs((z + 0.25) % 0.5 - 0.25) < 1e-4) & (x > np.abs(y) - 1.45) & (x > 0.02) & (x < 0.95),
    }


def test_biases_by_incidence_and_of_level_faces(one_pass: Callable[..., SimulatedSession]) -> None:
    """tan² i with cos i = sin t on the wall, sin t / √2 on slanted faces, |cos t| on level ones, as at 80° beyond."""
    plain, by_incidence, by_level = one_pass(), one_pass(incidence_bias_m=0.001), one_pass(level_bias_m=-0.004)
    ranges, zenith, points = seen(plain)
    longer = seen(by_incidence)[0] - ranges
    cosine = {"wall": np.sin(zenith), "slanted": np.sin(zenith) / np.sqrt(2), "level": np.abs(np.cos(zenith))}
    for name, rows in faces(points).items():
        assert rows.sum() > 50, name
        expected = 0.001 * (1 / np.maximum(cosine[name][rows], np.cos(np.radians(80.0))) ** 2 - 1)
        np.testing.assert_allclose(longer[rows], expected, atol=1e-6)
        of_level = -0.004 if name == "level" else 0.0
        np.testing.assert_allclose((seen(by_level)[0] - ranges)[rows], of_level, atol=1e-9)


def test_a_bias_of_all_ranges(one_pass: Callable[..., SimulatedSession]) -> None:
    ranges, _, points = seen(one_pass())
    longer = seen(one_pass(range_bias_m=0.003))[0] - ranges
    for rows in faces(points).values():
        np.testing.assert_allclose(longer[rows], 0.003, atol=1e-9)


def test_splashes_end_rays_just_above_the_water(one_pass: Callable[..., SimulatedSession]) -> None:
    plain = one_pass()
    wet = one_pass(splash_share=0.5, splash_height_m=0.2, splash_depth_m=0.1)
    ranges, _, points = seen(plain)
    shorter = ranges - seen(wet)[0]
    near = (points[:, 2] > 0) & (points[:, 2] < 0.2)
    assert near.sum() > 200
    assert np.abs(shorter[~near]).max() == 0
    assert np.mean(shorter[near] > 0) == pytest.approx(0.5, abs=0.1)
    assert shorter[near].min() >= 0
    assert shorter[near].max() == pytest.approx(0.1, abs=0.005)


def test_a_wide_beam_mixes_what_it_meets_at_an_edge(one_pass: Callable[..., SimulatedSession]) -> None:
    """Below a block's lower front edge the back wall is 1 - u behind the slanted face at x = u. There, and only there,
    a spot of 2 cm gives points between the two, with the share of its four rays and its doubly counted axis."""
    plain, wide = one_pass(), one_pass(spot_m=0.02)
    ranges, zenith, points = seen(plain)
    mixed = seen(wide)[0] - ranges
    for rows in faces(points).values():
        well_within = rows & (np.abs((points[:, 2] + 0.25) % 0.5 - 0.25) > 0.03)
        assert np.abs(mixed[well_within]).max(initial=0.0) < 1e-12
    x, y, z = points.T
    height = (z + 0.25) % 0.5 - 0.25
    u = -1.5 - y
    before = (u > 0.6) & (u < 0.95) & (np.abs(x - u) < 1e-4) & (np.abs(mixed) > 1e-3) & (height > 0)
    before &= (z + 4) % 1 < 0.03  # just above a lower edge of a block on the low side
    assert before.sum() >= 3
    behind = (1 - u[before]) / np.sin(zenith[before])  # as far as the ray below goes farther
    assert np.median(mixed[before] / behind) == pytest.approx(1 / 6, abs=1e-3)  # one of six is the back wall's
    assert np.all(mixed[before] > 0)
    assert np.all(mixed[before] < behind / 2)


@pytest.mark.parametrize(("divergence_deg", "half_m"), [(0.0, 0.01), (0.2, 0.01 + 6.3 * np.radians(0.1))])
def test_a_beam_widens_with_range(
    one_pass: Callable[..., SimulatedSession], divergence_deg: float, half_m: float
) -> None:
    """Points of slanted faces that mix with the back wall below lie no higher above the edge than half the spot."""
    dense = {"line_rate_hz": 50.0, "point_rate_hz": 10000.0}
    ranges, zenith, points = seen(one_pass(**dense))
    wide = seen(one_pass(**dense, spot_m=0.02, spot_divergence_deg=divergence_deg))[0]
    x, y, z = points.T
    before = (-1.5 - y > 0.6) & (-1.5 - y < 0.95) & (np.abs(x + 1.5 + y) < 1e-4) & (z % 1 < 0.1)
    above = (z[before & (wide != ranges)] % 1) * np.sin(zenith[before & (wide != ranges)])
    assert len(above) > 30
    assert 0.8 * half_m < above.max() < 1.02 * half_m
