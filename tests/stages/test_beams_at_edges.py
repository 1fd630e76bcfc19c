"""How near to an edge a sounding may lie: limits worked out by hand, and a session whose corners are loud.

By hand: the sonar hangs level before the wall and looks along +x with one beam, whose widths are 0.5° in height and 1°
along the wall. Half an array's floor is λ 0.886 / (4 w): 0.0952 m and 0.0476 m at 400 kHz.
"""

from typing import Any

import numpy as np
import pytest

from pipeline.config.pool import Segment
from pipeline.config.stage_settings import SonarBeams
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import label_points
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.target.label_limits import sonar_limits
from pipeline.target.sonar_beams import beams_in_target
from tests.support.targets import by_letters

SEAWARD = {"roll_deg": -90.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": 0.0}
WALL_END_M, WATER_MARGIN_M = 1.5, 0.1
NARROW = 1e-4  # m on either side of a limit


@pytest.fixture
def target() -> TargetModel:
    return by_letters(a=8.0, b=3.0, c=1.0, e=0.5)


def sounding(range_m: float, y_m: float, z_m: float, **beam: Any) -> tuple[np.ndarray, TargetBeams]:
    """The point and the beam of a sounding of the wall, straight ahead at a range."""
    settings = {"beam_deg": (0.5, 1.0), "frequency_hz": 4e5, "aperture_m": None, "focused": (True, False)} | beam
    sonar = SonarBeams.model_validate(settings | {"mount": SEAWARD, "angle_sigma_deg": 0.01, "range_sigma_m": 0.008})
    R = mount_of(sonar.mount).R_body_from_sensor
    ahead = np.array([[range_m, 0.0, 0.0]])
    return np.array([[0.0, y_m, z_m]]), beams_in_target(np.eye(3)[None], R, ahead @ R, sonar)


def labelled(target: TargetModel, factor: float, point: np.ndarray, beam: TargetBeams) -> bool:
    """Whether a sounding has a label."""
    limits = sonar_limits(Segment(beam_factor=factor, water_margin_m=WATER_MARGIN_M), 0.0, 0.05)
    return bool(label_points(target, point, beam, limits).face[0] >= 0)


@pytest.mark.parametrize(
    ("range_m", "factor", "beam", "half_m"),
    [
        (4.0, 1.0, {"focused": (True, True)}, 4.0 * np.tan(np.radians(0.5))),  # 0.035
        (4.0, 1.0, {}, 0.0476),  # within 5.45 m the array is the limit
        (8.0, 1.0, {}, 8.0 * np.tan(np.radians(0.5))),  # 0.070
        (4.0, 1.5, {}, 1.5 * 0.0476),
        (8.0, 1.5, {}, 1.5 * 8.0 * np.tan(np.radians(0.5))),
        (4.0, 1.0, {"frequency_hz": 2e5}, 2 * 0.0476),
        (4.0, 1.0, {"aperture_m": (0.4, 0.3)}, 0.075),
    ],
)
def test_along_the_wall(
    target: TargetModel, range_m: float, factor: float, beam: dict[str, Any], half_m: float
) -> None:
    limit_m = WALL_END_M - 0.03 - half_m
    exact = NARROW + 1e-5  # 0.0476 is rounded
    assert labelled(target, factor, *sounding(range_m, limit_m - exact, -2.0, **beam))
    assert not labelled(target, factor, *sounding(range_m, limit_m + exact, -2.0, **beam))


@pytest.mark.parametrize(
    ("range_m", "factor", "beam", "half_m"),
    [
        (4.0, 1.0, {}, 4.0 * np.tan(np.radians(0.25))),  # reception is focused
        (8.0, 1.0, {}, 8.0 * np.tan(np.radians(0.25))),
        (4.0, 1.5, {}, 1.5 * 4.0 * np.tan(np.radians(0.25))),
        (4.0, 1.0, {"focused": (False, False)}, 0.0952),
        (8.0, 1.0, {"focused": (False, False)}, 0.0952),  # 22 m is where its near field ends
        (25.0, 1.0, {"focused": (False, False)}, 25.0 * np.tan(np.radians(0.25))),
        (8.0, 2.0, {"aperture_m": (0.2, 0.1), "focused": (False, False)}, 0.1),
    ],
)
def test_below_the_water(
    target: TargetModel, range_m: float, factor: float, beam: dict[str, Any], half_m: float
) -> None:
    limit_m = -WATER_MARGIN_M - half_m
    exact = NARROW + 3e-5  # 0.0952 is rounded
    assert labelled(target, factor, *sounding(range_m, 0.0, limit_m - exact, **beam))
    assert not labelled(target, factor, *sounding(range_m, 0.0, limit_m + exact, **beam))


@pytest.mark.parametrize(("range_m", "half_m"), [(4.0, 0.0476), (8.0, 8.0 * np.tan(np.radians(0.5)))])
def test_corner_rays_reach_the_footprints_corners(range_m: float, half_m: float) -> None:
    """In height the beam may also stray by three sigmas of 0.01°, which the near field does not change."""
    _, beam = sounding(range_m, 0.0, -2.0)
    met = [corner[0] * range_m for corner in beam.corners(np.array([0]))]
    np.testing.assert_allclose(sorted(ray[1] for ray in met), [-half_m] * 2 + [half_m] * 2, atol=1e-4)
    high = range_m * np.tan(np.radians(0.25)) * (1 + 0.03 / 0.25)
    np.testing.assert_allclose(sorted(ray[2] for ray in met), [-high] * 2 + [high] * 2, atol=1e-4)
