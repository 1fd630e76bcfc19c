"""Beams within the near field of their array, where they are no narrower than half the array."""

import numpy as np

SPEED_M_S = 1500.0  # of sound, for the wavelength; 5 % do not matter
HALF_POWER = 0.886  # width to -3 dB of the far-field beam of a uniform line array, times aperture, over the wavelength
LEAST_WIDTH = 0.5  # of a beam in the near field, in apertures


def aperture_m(beam_rad: float, frequency_hz: float) -> float:
    """Return the length L of the uniform line array whose beam has a given width w to -3 dB.

    The far-field pattern of a uniform line is sinc²(L sin θ / λ). It has fallen to one half where its argument is
    0.443, so that w = 0.886 λ / L (H. L. Van Trees, Optimum Array Processing, 2002, section 2.4.1). An array that is
    shaded is longer: see :func:`near_range_m`.

    Parameters
    ----------
    beam_rad
        w, rad.
    frequency_hz
        Frequency of the sound, Hz.
    """
    return HALF_POWER * SPEED_M_S / frequency_hz / beam_rad


def near_range_m(beam_rad: float, aperture_m: float) -> float:
    """Return the range to which a beam that is not focused is no narrower than there: half the aperture.

    A Gaussian beam has the half-power width d₀ at its waist and w = (2 ln 2 / π) λ / d₀ far off (A. E. Siegman, Lasers,
    1986, section 17.1, with half-power widths), so that d₀ = 0.441 λ / w: half the aperture L = 0.886 λ / w of the
    uniform array with the same w. The uniform array itself gathers 72 % of its energy, as many as are between the -3 dB
    points far off, in 0.6 L to 0.65 L from 0.08 to 0.5 of L² / λ (Fresnel integral), and one with a Hann window of
    1.6 L in 0.52 L. So w r is the width beyond the range r = L / (2 · 2 tan(w / 2)), and L / 2 within it.

    Parameters
    ----------
    beam_rad
        w, rad.
    aperture_m
        L, m.
    """
    return float(LEAST_WIDTH * aperture_m / (2 * np.tan(beam_rad / 2)))
