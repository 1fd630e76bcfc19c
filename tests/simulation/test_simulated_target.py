"""The mesh against coordinates worked out by hand for a = 8, b = 3, c = 1, e = 0.5."""

import numpy as np
import pytest

from pipeline.config.target import Letters, Origin
from pipeline.simulation.mesh import block_bases_m, build_mesh, corner_lines, target_polygons
from pipeline.simulation.raycast import RayCaster
from pipeline.simulation.scenario_surroundings import Surroundings

ORIGIN = Origin(latitude_deg=36.0, longitude_deg=120.1, height_m=12.0)


def target(**changes: object) -> Letters:
    letters: dict[str, object] = {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5, "origin": ORIGIN, "azimuth_deg": 0.0}
    return Letters.model_validate(letters | changes)


def corners(design: Letters, name: str) -> set[tuple[float, ...]]:
    polygon = next(p for p in target_polygons(design) if p.name == name)
    return {tuple(np.round(vertex, 9) + 0.0) for vertex in polygon.vertices_m}


def test_corners_of_wall_and_blocks() -> None:
    front = {(0.0, -1.5, -4.0), (0.0, 1.5, -4.0), (0.0, 1.5, 4.0), (0.0, -1.5, 4.0)}
    assert corners(target(), "wall_3") == front
    low = {(0.0, -1.5, -4.0), (1.0, -2.5, -4.0), (1.0, -2.5, -3.5), (0.0, -1.5, -3.5)}
    assert corners(target(), "south_0_2") == low  # the slanted face, from the wall's edge out and back to x = c
    assert corners(target(), "south_0_top") == {(0.0, -1.5, -3.5), (1.0, -1.5, -3.5), (1.0, -2.5, -3.5)}
    assert corners(target(), "north_1_bottom") == {(0.0, 1.5, -2.5), (1.0, 1.5, -2.5), (1.0, 2.5, -2.5)}
    assert corners(target(), "north_7_top") == {(0.0, 1.5, 4.0), (1.0, 1.5, 4.0), (1.0, 2.5, 4.0)}
    assert len(target_polygons(target())) == 6 + 2 * 8 * 5


def test_bases_of_the_low_and_the_high_side() -> None:
    assert block_bases_m(target(), "south") == [-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0]
    assert block_bases_m(target(), "north") == [-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5]
    turned = target(low_side="north", first_base_m=-3.8, stagger_m=0.3, blocks_per_side=2)
    assert block_bases_m(turned, "north") == pytest.approx([-3.8, -2.8])
    assert block_bases_m(turned, "south") == pytest.approx([-3.5, -2.5])


def test_normals_look_outward() -> None:
    mesh = build_mesh(target(), Surroundings())
    normal = dict(zip(mesh.names, mesh.normals, strict=True))
    np.testing.assert_allclose(normal["wall_3"], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(normal["south_3_2"], np.array([-1, -1, 0]) / np.sqrt(2), atol=1e-12)
    np.testing.assert_allclose(normal["north_3_2"], np.array([-1, 1, 0]) / np.sqrt(2), atol=1e-12)
    np.testing.assert_allclose(normal["south_3_top"], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(normal["south_3_bottom"], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(normal["back_wall"], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(normal["floor"], [0, 0, 1], atol=1e-12)


def test_coplanar_faces_share_their_surface() -> None:
    mesh = build_mesh(target(), Surroundings())
    surface = dict(zip(mesh.names, mesh.surfaces.tolist(), strict=True))
    assert len({surface[f"south_{k}_2"] for k in range(8)}) == 1
    assert surface["south_0_2"] != surface["north_0_2"]
    assert surface["south_0_top"] != surface["south_1_top"]


def test_rays_meet_the_first_face_exactly() -> None:
    caster = RayCaster(build_mesh(target(), Surroundings()))
    origins = np.array([[-5.0, 0.3, -1.0], [-5.0, -2.0, -3.75], [-5.0, -2.0, -3.25], [-5.0, 0.0, 9.0]])
    ranges, surfaces = caster.cast(origins, np.tile([1.0, 0.0, 0.0], (4, 1)))
    np.testing.assert_allclose(ranges[:3], [5.0, 5.5, 6.0], atol=1e-14)  # wall, slanted face, back wall in the gap
    assert np.isinf(ranges[3])
    assert surfaces[3] == -1
    far = np.array([[-7.123456789, 0.3, -1.0]])
    direction = np.array([[0.8, 0.05, -0.1]]) / np.linalg.norm([0.8, 0.05, -0.1])
    assert caster.cast(far, direction)[0][0] == pytest.approx(7.123456789 / direction[0, 0], abs=1e-12)  # not float32


def test_corner_lines_stand_where_faces_meet_the_back_wall() -> None:
    lines = {tuple(np.round(line, 9)) for line in corner_lines(target())}
    assert (1.0, -2.5, -4.0, -3.5) in lines
    assert (1.0, 1.5, -3.0, -2.5) in lines  # in the gap above the north side's first block
    assert len(lines) == 2 * (8 + 7)


def test_a_tilted_target_leans_in_a_plumb_pool() -> None:
    mesh = build_mesh(target(), Surroundings(tilt_deg=(0.0, 0.5)))
    normal = dict(zip(mesh.names, mesh.normals, strict=True))
    tilt = np.radians(0.5)
    np.testing.assert_allclose(normal["wall_3"], [-np.cos(tilt), 0, np.sin(tilt)], atol=1e-12)
    np.testing.assert_allclose(normal["floor"], [0, 0, 1], atol=1e-12)
