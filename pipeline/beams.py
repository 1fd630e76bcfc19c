"""The sonar's beams in the target frame: directions and footprints."""

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.labelling import Beams
from pipeline.maths.soundings import beam_half_widths

Array = NDArray[np.float64]


def beams_in_target(
    R_target_from_body: Array,
    R_body_from_mbes: Array,
    points_mbes_m: Array,
    beam_rad: tuple[float, float],
) -> Beams:
    """Rays and half widths of soundings (n, 3) with attitudes (n, 3, 3); ``beam_rad``: full widths across, along."""
    vectors = (points_mbes_m, *beam_half_widths(points_mbes_m, *beam_rad))
    turned = [np.einsum("nij,nj->ni", R_target_from_body, v @ R_body_from_mbes.T) for v in vectors]
    return Beams(turned[0] / np.linalg.norm(turned[0], axis=1, keepdims=True), (turned[1], turned[2]))
