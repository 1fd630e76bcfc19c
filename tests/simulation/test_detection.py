"""What the sonar detects: errors by incidence, near field, side lobes, surface image; by hand, of a level, still head.

The head is at (-5, y, -1). The beam at θ looks along (sin θ, 0, -cos θ).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pipeline.simulation.beams import BeamBundles, swing_rad
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.raycast import RayCaster
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from tests.support.level_geometry import LEVEL, LEVEL_CURVES, STILL, range_m

Change = Callable[..., Scenario]
Pass = Callable[..., SimulatedSession]


@pytest.fixture
def one_pass(changed: Change, noise_free: Scenario) -> Pass:
    """A pass at 5 m, beams at whole degrees."""

    def simulated(**mbes: Any) -> SimulatedSession:
        given = {"mount": LEVEL, "beams": 161, "sector_deg": 160.0} | mbes
        track = {"distances_m": [5.0], "ins_height_m": 1.0}
        return simulate_session(changed(noise_free, track=track, motion=STILL, mbes=given), 1)

    return simulated


def of_law(cosine: float, law: str) -> float:
    return float((1 / cosine - 1) / 0.41421356 if law == "secant" else np.tan(np.arccos(cosine)) ** 2)


@pytest.mark.parametrize("law", ["secant", "tangent_squared"])
def test_a_bias_by_incidence_is_what_was_asked_for_at_45_degrees(one_pass: Pass, law: str) -> None:
    plain, biased = one_pass(), one_pass(incidence_bias_m=0.02, incidence_law=law)

    def longer_m(angle_deg: float, y_m: float) -> float:
        return range_m(biased, angle_deg, y_m) - range_m(plain, angle_deg, y_m)

    assert longer_m(-45.0, 0.0) == pytest.approx(0.02, abs=1e-6)  # the floor at 45°
    assert longer_m(0.0, 0.0) == pytest.approx(0.0, abs=1e-6)
    assert longer_m(60.0, 0.0) == pytest.approx(0.02 * of_law(np.sin(np.radians(60)), law), abs=1e-6)  # the wall
    slanted = np.sin(np.radians(74.0)) / np.sqrt(2)  # P1: its normal is (-1, -1, 0) / √2
    assert longer_m(74.0, -2.0) == pytest.approx(0.02 * of_law(slanted, law), abs=1e-6)
    top = np.cos(np.radians(75.0))
    assert longer_m(75.0, -1.6) == pytest.approx(0.02 * of_law(top, law), abs=LEVEL_CURVES)


def test_a_bias_of_level_faces_leaves_the_others(one_pass: Pass) -> None:
    plain, biased = one_pass(), one_pass(level_bias_m=-0.01)
    for angle_deg, y_m, longer in ((0.0, 0.0, -0.01), (75.0, -1.6, -0.01), (60.0, 0.0, 0.0), (74.0, -2.0, 0.0)):
        assert range_m(biased, angle_deg, y_m) - range_m(plain, angle_deg, y_m) == pytest.approx(longer, abs=1e-9)


def test_a_bias_of_all_ranges(one_pass: Pass) -> None:
    plain, biased = one_pass(), one_pass(range_bias_m=0.01)
    for angle_deg, y_m in ((0.0, 0.0), (60.0, 0.0), (74.0, -2.0)):
        assert range_m(biased, angle_deg, y_m) - range_m(plain, angle_deg, y_m) == pytest.approx(0.01, abs=1e-9)


def noise_m(noisy: SimulatedSession, clean: SimulatedSession, angle_deg: float, y_m: tuple[float, float]) -> np.ndarray:
    """Noise of the ranges of a beam while y is between two values."""
    found = []
    for session in (noisy, clean):
        mbes = session.mbes
        y = -4.5 + 0.4 * (mbes["t_ns"] - session.truth["passes"][0]["start_ns"]) / 1e9
        rows = (np.abs(np.degrees(mbes["angle_rad"]) - angle_deg) < 0.1) & (y > y_m[0]) & (y < y_m[1])
        found.append(750 * mbes["two_way_time_s"][rows])
    return np.asarray(found[0] - found[1])


def test_noise_grows_with_incidence(one_pass: Pass) -> None:
    dense = {"ping_rate_hz": 40.0, "beams": 81}  # every second degree
    clean = one_pass(**dense)
    by_any, by_slant = (
        one_pass(**dense, range_sigma_m=0.004, **{name: 3.0}) for name in ("incidence_noise", "slanted_noise")
    )
    everywhere, on_wall, on_slant = (-4.5, 4.5), (-1.45, 1.45), (-2.35, -1.6)
    assert noise_m(by_any, clean, 0.0, everywhere).std() == pytest.approx(0.004, rel=0.12)
    assert noise_m(by_any, clean, -44.0, everywhere).std() == pytest.approx(0.0118, rel=0.12)  # tan² 44° = 0.933
    assert noise_m(by_any, clean, 60.0, on_wall).std() == pytest.approx(0.004 * np.sqrt(1 + 8 / 3), rel=0.15)
    assert noise_m(by_slant, clean, -44.0, everywhere).std() == pytest.approx(0.004, rel=0.12)
    assert noise_m(by_slant, clean, 60.0, on_wall).std() == pytest.approx(0.004, rel=0.15)
    assert noise_m(by_slant, clean, 74.0, on_slant).std() == pytest.approx(0.004 * np.sqrt(1 + 8 * 1.08), rel=0.25)


def test_no_beam_is_narrower_than_the_aperture(changed: Change, noise_free: Scenario) -> None:
    """The outermost rays of a beam: half a width off its axis, or half an aperture at the face 5 m off."""
    seen: list[np.ndarray] = []

    class Watched(RayCaster):
        def first_met(self, origins_m: Any, directions: Any) -> Any:
            seen.append(directions)
            return super().first_met(origins_m, directions)

    near = {"beam_deg": [0.5, 1.0], "point_beams": False, "sub_rays": [3, 3], "aperture_m": [0.2, 0.05]}
    scenario = changed(noise_free, mbes=near)
    beams = BeamBundles(scenario.mbes, Watched(build_mesh(scenario.target, scenario.surroundings)), 0.0)
    level = np.array([[np.radians(85.0)]])
    swing, _ = swing_rad(np.sin(level), np.zeros((1, 1)))
    beams.paths(np.array([[-5.0, 0.0, -1.0]]), np.eye(3)[None], swing, np.zeros((1, 1)))
    across, along = (np.arcsin(seen[-1][:, k]) for k in (0, 1))
    range_to_wall = 5 / np.sin(level[0, 0])
    assert across.max() - np.radians(85.0) == pytest.approx(0.1 / range_to_wall, rel=1e-3)
    assert along.max() == pytest.approx(np.radians(0.5), rel=1e-9)  # 1° is 0.09 m there, more than 0.05 m


def test_a_side_lobe_hears_the_corner(one_pass: Pass) -> None:
    """The corner of P1-1 and the back wall is at (1, -2.5); from y = -2.4 the beam meets P1-1 at x = 0.9."""
    dense = {"ping_rate_hz": 10.0}  # a ping every 4 cm
    plain, strong = one_pass(**dense), one_pass(**dense, side_lobe_share=1.0)
    theta = np.radians(74.0)
    assert range_m(plain, 74.0, -2.4) == pytest.approx(5.9 / np.sin(theta), abs=0.022)
    corner = np.linalg.norm([6.0, -0.1, 6.0 / np.tan(theta)])
    assert range_m(strong, 74.0, -2.4) == pytest.approx(corner, abs=1e-3)  # late by a decimetre
    for angle_deg, y_m in ((60.0, 0.0), (-30.0, 0.0), (74.0, -2.0), (65.0, -1.45)):  # far from any, or it is hidden
        assert range_m(strong, angle_deg, y_m) == range_m(plain, angle_deg, y_m)
    drawn = one_pass(**dense, side_lobe_share=1.0, side_lobe_pull=0.25)
    own, full = range_m(plain, 74.0, -2.4), range_m(strong, 74.0, -2.4)
    assert range_m(drawn, 74.0, -2.4) == pytest.approx(own + 0.25 * (full - own), abs=1e-6)  # both echoes are as one
    narrow = one_pass(**dense, side_lobe_share=1.0, side_lobe_widths=0.5)
    assert range_m(narrow, 74.0, -2.4) == range_m(plain, 74.0, -2.4)


def test_below_the_water_the_wall_has_an_image(one_pass: Pass) -> None:
    """With the head turned by 32° the beam at 65° looks up by 7°: onto the wall at z = -1 + 5 tan 7° = -0.386."""
    upward = {"mount": LEVEL | {"roll_deg": -32.0}, "beams": 131, "sector_deg": 130.0}
    plain, mirrored = one_pass(**upward), one_pass(**upward, image_share=1.0, image_depth_m=0.5)
    direct, by_surface = np.hypot(5.0, 1 - 0.386), np.hypot(5.0, 1 + 0.386)
    assert range_m(plain, 65.0, 0.0) == pytest.approx(direct, abs=1e-3)
    assert range_m(mirrored, 65.0, 0.0) == pytest.approx((direct + by_surface) / 2, abs=1e-3)
    assert by_surface - direct > 0.1
    assert range_m(mirrored, 60.0, 0.0) == range_m(plain, 60.0, 0.0)  # z = -0.83


@pytest.mark.parametrize("offset", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.3), (0.0, 0.0, -0.3)])
def test_the_transmitter_is_off_along_every_axis(one_pass: Pass, offset: tuple[float, float, float]) -> None:
    """Forward or to starboard and up are positive: the wall is nearer to a transmitter at +x, the floor farther at +z.

    Without give_projector_offset session.yaml does not know.
    """
    session = one_pass(projector_offset_m=list(offset))
    assert "projector_offset_m" not in session.session["mbes"]
    for angle_deg, place in ((60.0, (5.0, 0.0, -5.0 / np.tan(np.radians(60)))), (0.0, (0.0, 0.0, -3.3))):
        from_transmitter = np.sqrt(sum((p - o) ** 2 for p, o in zip(place, offset, strict=True)))
        expected = (np.sqrt(sum(p**2 for p in place)) + from_transmitter) / 2
        assert range_m(session, angle_deg, 0.0) == pytest.approx(expected, abs=2 * LEVEL_CURVES)
    told = one_pass(projector_offset_m=list(offset), give_projector_offset=True)
    assert told.session["mbes"]["projector_offset_m"] == list(offset)
