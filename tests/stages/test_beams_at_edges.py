"""How near to an edge a sounding may lie: limits worked out by hand, and a session whose corners are loud.

By hand: the sonar hangs level before the wall and looks along +x with one beam, whose widths are 0.5° in height and 1°
along the wall. Half an array's floor is λ 0.886 / (4 w): 0.0952 m and 0.0476 m at 400 kHz.
"""

import json
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
from tests.support.simulated import calibrated, made
from tests.support.targets import by_letters
from tools.session_rows import errors_of

SEAWARD = {"roll_deg": -90.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": 0.0}
WALL_END_M, WATER_MARGIN_M = 1.5, 0.1
LARGEST_NSE = 22.5  # by the random covariance: six squares are larger in one session of a thousand
NARROW = 1e-4  # m on either side of a limit


@pytest.fixture
def target() -> TargetModel:
    return by_letters(a=8.0, b=3.0, c=1.0, e=0.5)


def sounding(
    range_m: float, y_m: float, z_m: float, x_m: float = 0.0, **beam: Any
) -> tuple[np.ndarray, TargetBeams]:
    """The point and the beam of a sounding straight ahead at a range; the wall is at x = 0."""
    settings = {"beam_deg": (0.5, 1.0), "frequency_hz": 4e5, "aperture_m": None, "focused": (True, False)} | beam
    sonar = SonarBeams.model_validate(settings | {"mount": SEAWARD, "angle_sigma_deg": 0.01, "range_sigma_m": 0.008})
    R = mount_of(sonar.mount).R_body_from_sensor
    ahead = np.array([[range_m, 0.0, 0.0]])
    return np.array([[x_m, y_m, z_m]]), beams_in_target(np.eye(3)[None], R, ahead @ R, sonar)


def labelled(target: TargetModel, widths: float, point: np.ndarray, beam: TargetBeams) -> bool:
    """Whether a sounding has a label."""
    limits = sonar_limits(Segment(margin_m=0.03, side_lobe_widths=widths, water_margin_m=WATER_MARGIN_M), 0.0, 0.05)
    return bool(label_points(target, point, beam, limits).face[0] >= 0)


@pytest.mark.parametrize(
    ("range_m", "widths", "beam", "limit_m"),
    [
        (4.0, 0.5, {"focused": (True, True)}, 0.03 + 4.0 * np.tan(np.radians(0.5))),  # 0.065
        (4.0, 0.5, {}, 0.03 + 0.0476),  # within 5.45 m the array is the limit
        (8.0, 0.5, {}, 0.03 + 8.0 * np.tan(np.radians(0.5))),  # 0.100
        (4.0, 0.5, {"frequency_hz": 2e5}, 0.03 + 2 * 0.0476),
        (4.0, 0.5, {"aperture_m": (0.4, 0.3)}, 0.03 + 0.075),
        (4.0, 2.0, {}, 4 * 0.0476),  # two widths, and no margin besides
        (8.0, 2.0, {}, 4 * 8.0 * np.tan(np.radians(0.5))),
        (4.0, 0.75, {}, 0.03 + 0.0476),  # 0.071 is less
    ],
)
def test_along_the_wall(
    target: TargetModel, range_m: float, widths: float, beam: dict[str, Any], limit_m: float
) -> None:
    """No face of the target is known to turn away along the whole of the wall's edge."""
    exact = NARROW + 2e-5  # 0.0476 is rounded
    for off_m, good in ((limit_m + exact, True), (limit_m - exact, False)):
        assert labelled(target, widths, *sounding(range_m, WALL_END_M - off_m, -2.0, **beam)) == good


@pytest.mark.parametrize(
    ("range_m", "widths", "beam", "half_m"),
    [
        (4.0, 0.5, {}, 4.0 * np.tan(np.radians(0.25))),  # reception is focused
        (8.0, 0.5, {}, 8.0 * np.tan(np.radians(0.25))),
        (4.0, 2.0, {}, 4 * 4.0 * np.tan(np.radians(0.25))),
        (4.0, 0.5, {"focused": (False, False)}, 0.0952),
        (8.0, 0.5, {"focused": (False, False)}, 0.0952),  # 22 m is where its near field ends
        (25.0, 0.5, {"focused": (False, False)}, 25.0 * np.tan(np.radians(0.25))),
        (8.0, 1.0, {"aperture_m": (0.2, 0.1), "focused": (False, False)}, 0.1),
    ],
)
def test_below_the_water(
    target: TargetModel, range_m: float, widths: float, beam: dict[str, Any], half_m: float
) -> None:
    exact = NARROW + 3e-5  # 0.0952 is rounded
    for off_m, good in ((half_m + exact, True), (half_m - exact, False)):
        assert labelled(target, widths, *sounding(range_m, 0.0, -WATER_MARGIN_M - off_m, **beam)) == good


def test_an_outer_edge_is_no_corner(target: TargetModel) -> None:
    """P1-1 stands between z = -3 and -2.5; its top and its bottom turn away, and half a width and the margin remain.

    The beam at 45° to it covers 4 m · tan 0.25° in height. Toward the back wall, at y = -2.5, two widths remain: of
    1° along the track, on a face at 45° to it.
    """
    half_m, along_m = 4.0 * np.tan(np.radians(0.25)), 0.0476
    for off_m, good in ((0.03 + half_m + NARROW, True), (0.03 + half_m - NARROW, False)):
        assert labelled(target, 2.0, *sounding(4.0, -2.0, -2.5 - off_m, x_m=0.5)) == good
    for off_m, good in ((4 * along_m + NARROW, True), (4 * along_m - NARROW, False)):
        assert labelled(target, 2.0, *sounding(4.0, -2.5 + off_m, -2.75, x_m=1.0 - off_m)) == good


@pytest.mark.parametrize("beyond_m", [0.0, 0.02])
@pytest.mark.parametrize(("range_m", "half_m"), [(4.0, 0.0476), (8.0, 8.0 * np.tan(np.radians(0.5)))])
def test_corner_rays_reach_the_footprints_corners(range_m: float, half_m: float, beyond_m: float) -> None:
    """In height the beam may also stray by three sigmas of 0.01°, which the near field does not change."""
    _, beam = sounding(range_m, 0.0, -2.0)
    met = [corner[0] * range_m for corner in beam.corners(np.array([0]), beyond_m)]
    wide = half_m + beyond_m
    np.testing.assert_allclose(sorted(ray[1] for ray in met), [-wide] * 2 + [wide] * 2, atol=1e-4)
    high = range_m * np.tan(np.radians(0.25)) * (1 + 0.03 / 0.25) + beyond_m
    np.testing.assert_allclose(sorted(ray[2] for ray in met), [-high] * 2 + [high] * 2, atol=1e-4)


@pytest.mark.thorough
def test_a_session_with_loud_corners() -> None:
    """Within 1.5 widths of a corner each range is drawn halfway to the corner's: tops seem millimetres off.

    The measured points still lie on the faces, so that only their beams' distance from the corner tells.
    """
    session = made({"mbes": {"side_lobe_share": 1.0, "side_lobe_pull": 0.5, "side_lobe_widths": 1.5}})
    found = {}
    for widths in (0.5, 1.5):
        result = calibrated(session, pool={"segment": {"side_lobe_widths": widths}})
        calibration = json.loads(result["report/calibration.json"])
        block = calibration["methods"]["adjustment"]
        error = errors_of(np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"]), session.truth)
        nse = error @ np.linalg.solve(np.array(block["covariance"]), error)
        found[widths] = calibration["verdict"], nse, 1000 * abs(error[5])
    assert found[1.5][0] == "accepted"
    assert found[1.5][1] < LARGEST_NSE
    assert found[1.5][2] < 2.0
    assert found[0.5][0] == "rejected"
    assert found[0.5][1] > LARGEST_NSE
    assert found[0.5][2] > 3.0
