"""Near field: apertures and widths against sums over the elements of an array."""

import numpy as np
import pytest

from pipeline.maths.sonar.near_field import aperture_m, near_range_m

WAVELENGTH_M = 1500.0 / 400_000.0
WIDTHS_RAD = [np.radians(0.5), np.radians(1.0)]
MAIN_LOBE = 0.72  # of the energy of a uniform line lies between its -3 dB points


def intensity(offsets_m: np.ndarray, range_m: float, elements_m: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Of an array along x, at points that lie aside of its axis: waves of all elements, added (Fresnel's distance)."""
    path_m = (offsets_m[:, None] - elements_m) ** 2 / (2 * range_m)
    return np.asarray(np.abs(np.exp(2j * np.pi * path_m / WAVELENGTH_M) @ weights) ** 2)


def width_m(range_m: float, length_m: float, shaded: bool) -> float:
    """Width in which the share MAIN_LOBE of the energy arrives."""
    elements = (np.arange(800) + 0.5) / 800 * length_m - length_m / 2
    weights = np.cos(np.pi * elements / length_m) ** 2 if shaded else np.ones(800)
    reach = 1.2 * length_m + 0.03 * range_m
    offsets = np.linspace(-reach, reach, 1201)
    energy = np.cumsum(intensity(offsets, range_m, elements, weights))
    low, high = (np.interp(share * energy[-1], energy, offsets) for share in ((1 - MAIN_LOBE) / 2, (1 + MAIN_LOBE) / 2))
    return float(high - low)


@pytest.mark.parametrize("beam_rad", WIDTHS_RAD)
def test_the_aperture_gives_the_beam_its_width(beam_rad: float) -> None:
    """At half the width, far off, half of the axis's power."""
    length = aperture_m(beam_rad, 400_000.0)
    elements = (np.arange(800) + 0.5) / 800 * length - length / 2
    far = 1e6
    axis, side = intensity(np.array([0.0, far * np.tan(beam_rad / 2)]), far, elements, np.ones(800))
    assert side / axis == pytest.approx(0.5, abs=0.002)
    assert aperture_m(beam_rad, 200_000.0) == pytest.approx(2 * length)


@pytest.mark.parametrize("beam_rad", WIDTHS_RAD)
@pytest.mark.parametrize("range_m", [4.0, 5.0, 6.0, 8.0, 40.0])
def test_a_beam_is_about_as_wide_as_its_array_makes_it(beam_rad: float, range_m: float) -> None:
    """Within 30 % at all ranges, for a uniform array and for one with a Hann window, 1.44 / 0.886 times as long."""
    length = aperture_m(beam_rad, 400_000.0)
    expected = 2 * np.tan(beam_rad / 2) * max(range_m, near_range_m(beam_rad, length))
    for longer, shaded in ((1.0, False), (1.44 / 0.886, True)):
        assert width_m(range_m, longer * length, shaded) == pytest.approx(expected, rel=0.3), shaded


def test_the_near_field_ends_where_the_beam_is_half_the_array() -> None:
    assert near_range_m(np.radians(1.0), 0.2) == pytest.approx(0.1 / (2 * np.tan(np.radians(0.5))))
