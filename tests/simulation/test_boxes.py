"""Boxes before the target, and growth on its wet faces, against points placed by hand."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.simulation.mesh import box_polygons, build_mesh
from pipeline.simulation.relief import Relief
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.scenario_surroundings import Surroundings
from pipeline.simulation.session import simulate_session

Change = Callable[..., Scenario]
BOX = {"name": "fender", "low_m": [-0.4, -0.5, -2.0], "high_m": [-0.1, 0.7, 1.0]}


@pytest.mark.parametrize("sensor", ["mbes", "laser"])
def test_both_sensors_see_a_box_in_place_of_what_is_behind(
    changed: Change, noise_free: Scenario, place: Callable[..., np.ndarray], sensor: str
) -> None:
    session = simulate_session(changed(noise_free, surroundings={"boxes": [BOX]}), 1)
    points = place(session, sensor, session.truth[sensor]["mount"])
    inside = (points[:, 1] > -0.45) & (points[:, 1] < 0.65) & (points[:, 2] > -1.9) & (points[:, 2] < 0.9)
    inside &= points[:, 0] < 0.5
    assert np.sum(inside) > 30
    np.testing.assert_allclose(points[inside, 0], -0.4, atol=1e-4)
    beside = (np.abs(points[:, 1] - 1.0) < 0.2) & (np.abs(points[:, 2]) < 1.9) & (points[:, 0] < 0.5)
    assert np.sum(beside) > 10
    np.testing.assert_allclose(points[beside, 0], 0.0, atol=1e-4)


def test_a_box_is_turned_counter_clockwise_about_its_middle() -> None:
    """By 30° about (-0.25, 0.1): the front's normal (-1, 0) turns to (-cos 30°, -sin 30°)."""
    surroundings = parse(Surroundings, {"boxes": [BOX | {"turn_deg": 30.0}]}, "test")
    fronts = []
    for polygon in box_polygons(surroundings):
        corners = polygon.vertices_m
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        off_m = normal @ (corners[0] - np.array([-0.25, 0.1, -0.5]))
        assert off_m > 0  # outward
        fronts += [off_m] if np.allclose(normal, [-np.cos(np.pi / 6), -0.5, 0.0]) else []
    assert fronts == pytest.approx([0.15])


def test_a_box_without_an_extent_is_refused() -> None:
    flat: dict[str, Any] = BOX | {"high_m": [-0.4, 0.7, 1.0]}
    with pytest.raises(ConfigError, match=r"boxes.0 = .*: high_m = \[-0.4, 0.7, 1.0\] must lie above low_m"):
        parse(Surroundings, {"boxes": [flat]}, "test")


def test_growth_covers_the_wet_faces_alone_and_is_never_below_them(changed: Change, noise_free: Scenario) -> None:
    settings = {"fouling_m": 0.01, "fouling_sigma_m": 0.02, "unevenness_length_m": 0.2, "boxes": [BOX]}
    scenario = changed(noise_free, surroundings=settings)
    mesh = build_mesh(scenario.target, scenario.surroundings)
    relief = Relief(scenario.target, scenario.surroundings, mesh, 5)
    assert relief
    many = np.random.default_rng(0).uniform(-1, 1, (20000, 3)) * [0.0, 20.0, 20.0]
    heights = relief.heights_m(np.full(len(many), mesh.names.index("wall_3")), many)
    wet = many[:, 2] < scenario.target.water_level_m
    assert not heights[~wet].any()
    assert heights.min() == 0.0
    below = np.mean(heights[wet] == 0.0)
    assert below == pytest.approx(0.31, abs=0.05)  # Φ(-1/2)
    assert np.median(heights[wet]) == pytest.approx(0.01, abs=0.003)
    box = next(k for k, name in enumerate(mesh.names) if name.startswith("/fender"))
    assert not relief.heights_m(np.full(len(many), box), many).any()
