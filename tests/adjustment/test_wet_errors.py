"""A-priori errors of wet faces: what a layer of growth has in common on all of them, and on which side it lies."""

import numpy as np
import pytest

from pipeline.adjustment.consider import known_parameters
from pipeline.adjustment.wet_errors import outward_of, wet_errors, wet_faces_uncertain
from pipeline.config.pool import AsBuilt
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State

NORMALS = {"wall": [-1.0, 0.0, 0.0], "return": [-1.0, -1.0, 0.0], "behind": [-1.0, 0.0, 0.0]}
SURFACES = tuple(
    ObservedSurface.at(name, np.array(normal) / np.linalg.norm(normal), np.zeros(3)) for name, normal in NORMALS.items()
)
STATE = State.at(np.eye(3), np.zeros(3), SURFACES)
FACES = Faces(("a", "b", "c", "d"), np.array([0, 1, 2, 2]), np.array([1.0, 1.0, -1.0, -1.0]))
SHIFTS = [STATE.names.index(f"wet_{name}_shift") for name in NORMALS]
OVERGROWN = AsBuilt(offset_sigma_m=0.004, angle_sigma_deg=0.1, bow_sigma_m=0.002, growth_sigma_m=0.015)


def test_the_shifts_are_those_of_layers_drawn_at_random() -> None:
    """Growth shifts a face toward the boat: along the normal of a family that looks there, else against it."""
    outward = outward_of(FACES, STATE)
    assert outward == {"wall": 1.0, "return": 1.0, "behind": -1.0}
    errors = wet_errors(STATE.names, OVERGROWN, OVERGROWN.bow_sigma_m, outward)
    draws = np.random.default_rng(1)
    layer = 0.015 * draws.normal(size=(200_000, 1)) * [1.0, 1.0, -1.0]
    expected = np.cov(layer + 0.004 * draws.normal(size=(200_000, 3)), rowvar=False)
    found = errors.covariance(np.array(SHIFTS))
    np.testing.assert_allclose(found, expected, atol=0.01 * 0.015**2)
    np.testing.assert_allclose(errors.sigmas[SHIFTS], np.hypot(0.004, 0.015), rtol=1e-12)


def test_turns_and_bows_are_of_each_family_alone() -> None:
    errors = wet_errors(STATE.names, OVERGROWN, OVERGROWN.bow_sigma_m, outward_of(FACES, STATE))
    numbers = np.array([k for k, name in enumerate(STATE.names) if name.startswith("wet_") and k not in SHIFTS])
    expected = [np.radians(0.1) if STATE.names[k].endswith(("turn_1", "turn_2")) else 0.002 for k in numbers.tolist()]
    np.testing.assert_allclose(errors.covariance(numbers), np.diag(np.square(expected)), rtol=1e-12)
    assert not errors.sigmas[[k for k, name in enumerate(STATE.names) if not name.startswith("wet_")]].any()


def test_the_values_known_beforehand_have_this_covariance() -> None:
    errors = wet_errors(STATE.names, OVERGROWN, OVERGROWN.bow_sigma_m, outward_of(FACES, STATE))
    known = known_parameters(STATE, errors, ())
    assert known is not None
    places = np.searchsorted(known.numbers, SHIFTS)
    np.testing.assert_array_equal(known.covariance[np.ix_(places, places)], errors.covariance(np.array(SHIFTS)))


def test_without_growth_the_shifts_are_independent() -> None:
    errors = wet_errors(STATE.names, AsBuilt(offset_sigma_m=0.004), 0.0, {})
    assert not errors.blocks
    np.testing.assert_allclose(errors.sigmas[SHIFTS], 0.004)


@pytest.mark.parametrize(
    ("survey", "uncertain"),
    [({"growth_sigma_m": 0.0021}, True), ({"growth_sigma_m": 0.002}, False), ({"angle_sigma_deg": 0.021}, True)],
)
def test_thick_growth_makes_wet_faces_uncertain(survey: dict[str, float], uncertain: bool) -> None:
    assert wet_faces_uncertain(AsBuilt(**survey)) is uncertain


def test_growth_alone_is_refused() -> None:
    with pytest.raises(ValueError, match=r"growth_sigma_m = 0\.01 with offset_sigma_m = 0: no layer"):
        AsBuilt(growth_sigma_m=0.01, offset_sigma_m=0.0)
