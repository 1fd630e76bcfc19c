"""Least squares of points on a target's planes: directions that the points do not determine."""

import numpy as np
import pytest

from pipeline.maths.target.placements import TargetPose
from pipeline.maths.target.registration import FacePlanes, Refinement, SearchResult, refine

SIGMAS = np.array([np.radians(3.0), 0.5, 0.5, 0.5])
WALLS = np.array([[-1.0, 0.0, 0.0], [-0.7, -0.7, 0.0], [-0.7, 0.7, 0.0]])


def refined(lean_deg: float, least_m: float, bias_m: float = 0.003) -> Refinement:
    """Fit of 30,000 points on three walls that lean the same way; those of the third stand out by a bias."""
    rng = np.random.default_rng(1)
    normals = WALLS / np.linalg.norm(WALLS, axis=1, keepdims=True) + [0.0, 0.0, np.tan(np.radians(lean_deg))]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    face = np.repeat([0, 1, 2], 10_000)
    points = np.column_stack([np.zeros(30_000), rng.uniform(-4, 4, 30_000), rng.uniform(0, 2, 30_000)])
    away = np.einsum("ni,ni->n", points, normals[face]) - rng.normal(0, 0.005, 30_000) - bias_m * (face == 2)
    points -= away[:, None] * normals[face]
    pose = TargetPose(points + np.array([0.1, 0.0, 0.0]), SIGMAS)
    planes = FacePlanes(normals, np.zeros(3))
    return refine(pose, np.zeros(4), lambda *_: face.astype(np.int16), planes, least_m=least_m)


def test_height_is_left_to_the_prior_on_walls_that_hardly_lean() -> None:
    """Three millimetres between walls that lean by 0.01° are no metres of height."""
    assert abs(refined(0.01, least_m=0.0).parameters[3]) > 0.3
    found = refined(0.01, least_m=0.02)
    assert abs(found.parameters[3]) < 1e-3
    np.testing.assert_allclose(np.sqrt(found.covariance[3, 3]), 0.5, rtol=1e-3)
    np.testing.assert_allclose(found.parameters[1], 0.1, atol=0.005)


def test_height_is_found_on_a_slope() -> None:
    one, other = refined(30.0, least_m=0.02), refined(30.0, least_m=0.0)
    np.testing.assert_array_equal(one.parameters, other.parameters)
    assert one.covariance[3, 3] < 0.001**2


@pytest.mark.parametrize("lean_deg", [0.01, 5.0])
def test_what_is_determined_does_not_depend_on_what_is_left_to_the_prior(lean_deg: float) -> None:
    one, other = refined(lean_deg, least_m=0.02, bias_m=0.0), refined(lean_deg, least_m=0.0, bias_m=0.0)
    np.testing.assert_allclose(one.parameters[:3], other.parameters[:3], atol=3e-3)


@pytest.mark.parametrize(
    ("within", "refined", "edges_known", "said"),
    [
        (True, (9.0, 9.0), True, True),
        (False, (0.1, -0.2), False, True),
        (False, (0.1, 0.31), False, False),
        (False, (-0.11, 0.0), False, False),
        (False, (0.1, -0.2), True, False),
    ],
)
def test_a_pose_that_the_edges_of_a_found_target_drew_too_far_is_judged_by_its_refinement(
    within: bool, refined: tuple[float, float], edges_known: bool, said: bool
) -> None:
    found = SearchResult(np.array([0.0, 0.8]), 0.9, 0.0, within)
    assert found.or_within(np.array(refined), np.array([0.1, 0.3]), edges_known) == said
