"""The sonar's beams in the target frame: directions and footprints."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.stage_settings import SonarBeams
from pipeline.maths.sonar.near_field import aperture_m, near_range_m
from pipeline.maths.sonar.soundings import beam_half_widths
from pipeline.maths.target.beams import TargetBeams

Array = NDArray[np.float64]
STRAY_SIGMAS = 3.0


def beams_in_target(
    R_target_from_body: Array,
    R_body_from_mbes: Array,
    points_mbes_m: Array,
    mbes: SonarBeams,
) -> TargetBeams:
    """Return the rays and half widths of soundings. Their beams may stray by three sigmas of the angle.

    If a beam strays over an edge, its range is a mean over all surfaces that it meets.

    Parameters
    ----------
    R_target_from_body
        Attitudes (n, 3, 3).
    R_body_from_mbes
        Rotation of the sonar (3, 3).
    points_mbes_m
        Soundings (n, 3), mbes frame.
    mbes
        Widths of the beams, their arrays, and the sigma of their angle.
    """
    ranges = np.linalg.norm(points_mbes_m, axis=1)
    unit = points_mbes_m / ranges[:, None]
    vectors = (unit, *beam_half_widths(unit, *np.radians(mbes.beam_deg)))
    turned = [np.einsum("nij,nj->ni", R_target_from_body, v @ R_body_from_mbes.T) for v in vectors]
    stray = STRAY_SIGMAS * mbes.angle_sigma_deg / (mbes.beam_deg[0] / 2)
    return TargetBeams(turned[0], ranges, (turned[1], turned[2]), near_ranges_m(mbes), stray)


def near_ranges_m(mbes: SonarBeams) -> tuple[float, ...]:
    """Return the ranges, across and along, to which beams are no narrower than there; 0 for an array that is focused.

    Parameters
    ----------
    mbes
        Widths of the beams, and their arrays.
    """
    widths = [float(np.radians(width)) for width in mbes.beam_deg]
    apertures = mbes.aperture_m or [aperture_m(width, mbes.frequency_hz) for width in widths]
    arrays = zip(widths, apertures, mbes.focused, strict=True)
    return tuple(0.0 if focused else near_range_m(width, aperture) for width, aperture, focused in arrays)
