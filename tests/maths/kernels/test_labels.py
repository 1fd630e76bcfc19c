"""Labels by the compiled loop against numpy's: the same face and reason for each point, for both sensors."""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import LabelSettings, label_points, near_planes
from tests.support.label_oracle import label_points_by_numpy, planes_with_points
from tests.support.targets import by_letters

MODEL = by_letters(10.0, 2.0, 0.9, 0.3)
LASER = LabelSettings(0.05, 0.03, np.radians(5), lowest_m=0.05, spot_m=0.004, ramp_m=0.03, seen="dry")
SONAR = LabelSettings(0.05, 0.03, np.radians(5), highest_m=0.5, ramp_m=0.03, seen="wet", corner_factor=2.0)
SHARP = LabelSettings(0.05, 0.03, np.radians(5))  # averaged points: no ramp, no footprint


def near_the_target(rng: np.random.Generator, points: int) -> np.ndarray:
    """Points on faces with noise, some of them away from every face."""
    faces = rng.integers(0, len(MODEL.faces), points)
    places = np.empty((points, 3))
    for row, number in enumerate(faces.tolist()):
        corners = MODEL.faces[number].vertices_m
        share = rng.dirichlet(np.ones(len(corners)))
        places[row] = share @ corners + rng.normal(0, 0.02, 3)
    return places + np.where(rng.random((points, 1)) < 0.2, rng.normal(0, 1, (points, 3)), 0.0)


def seen_from_the_front(rng: np.random.Generator, places: np.ndarray) -> TargetBeams:
    """Rays from about 6 m in front of the wall, higher and lower than the point."""
    fronts = np.mean([face.normal for face in MODEL.faces if abs(face.normal[2]) < 0.5], axis=0)
    away = 6 * fronts / np.linalg.norm(fronts)
    return TargetBeams.from_origins(places + away + rng.normal(0, 1, places.shape), places)


def finite(beams: TargetBeams) -> TargetBeams:
    """The same rays with the widths of a sonar's beams."""
    across = np.cross(beams.directions, [0.0, 0.0, 1.0]) * 0.003
    along = np.cross(beams.directions, [0.0, 1.0, 0.0]) * 0.004
    return TargetBeams(beams.directions, beams.ranges_m, (across, along), (2.0, 3.0), 0.3)


@pytest.mark.parametrize("sensor", ["laser", "sonar", "averages"])
@given(seed=st.integers(0, 2**32), points=st.integers(0, 80))
@settings(max_examples=25, deadline=None)
def test_labels_are_those_of_numpy(sensor: str, seed: int, points: int) -> None:
    rng = np.random.default_rng(seed)
    places = near_the_target(rng, points)
    round_beams = seen_from_the_front(rng, places)
    beams, chosen = {
        "laser": (round_beams, LASER),
        "sonar": (finite(round_beams), SONAR),
        "averages": (TargetBeams.head_on(points), SHARP),
    }[sensor]
    places[rng.random(points) < 0.05] = np.nan  # after the rays: each of the two may lack a value
    among = rng.random(points) < 0.8
    found = label_points(MODEL, places, beams, chosen, among)
    with np.errstate(invalid="ignore"):
        expected = label_points_by_numpy(MODEL, places, beams, chosen, among)
    for field in fields(found):
        one, other = getattr(found, field.name), getattr(expected, field.name)
        np.testing.assert_allclose(one.astype(float), other.astype(float), rtol=0, atol=1e-12, err_msg=field.name)


@given(seed=st.integers(0, 2**32), points=st.integers(0, 80), seen=st.sampled_from(["dry", "wet", "both"]))
@settings(max_examples=25, deadline=None)
def test_points_near_planes_are_those_of_numpy(seed: int, points: int, seen: str) -> None:
    rng = np.random.default_rng(seed)
    places, among = near_the_target(rng, points), rng.random(points) < 0.8
    expected = np.zeros(points, dtype=bool)
    for plane in planes_with_points(MODEL, places, 0.03, among, seen):
        expected[plane.rows] = True
    np.testing.assert_array_equal(near_planes(MODEL, places, 0.03, among, seen), expected)


def test_the_comparison_has_points_with_each_answer() -> None:
    """Else the comparison would say nothing."""
    rng = np.random.default_rng(0)
    places = near_the_target(rng, 4000)
    beams = seen_from_the_front(rng, places)
    by_laser, by_sonar = label_points(MODEL, places, beams, LASER), label_points(MODEL, places, finite(beams), SONAR)
    for labels in (by_laser, by_sonar):
        counts = [np.mean(mask) for mask in (labels.face >= 0, labels.off_surface, labels.near_edge, labels.grazing)]
        assert min(counts) > 0.02, counts
