"""What a cast's own error does to the change of the sound speed with depth."""

import numpy as np
import pytest

from pipeline.adjustment.consider import gradient_sigma, sonar_errors
from pipeline.config.mount import Mount
from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser, Mbes
from pipeline.maths.adjustment.parameters import PROJECTOR_PARAMETERS

MOUNT = Mount(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, x_m=0.0, y_m=0.0, z_m=0.0)


def sonar(svp: list[list[float]] | None = None, **more: float) -> Mbes:
    cast = None if svp is None else tuple((depth, speed) for depth, speed in svp)
    return Mbes(files=["a"], format="table", mount=MOUNT, svp=cast, **more)


def test_it_is_the_scatter_of_the_slope_between_the_ends() -> None:
    """Two hundred thousand casts whose ends are each off by themselves."""
    errors = np.random.default_rng(3).normal(scale=0.07, size=(200_000, 2))
    slopes = np.diff(errors, axis=1)[:, 0] / 3.5
    found = gradient_sigma(sonar([[0.0, 1480.0], [1.0, 1481.0], [3.5, 1480.0]], svp_sigma_m_s=0.07), 3.5)
    assert found == pytest.approx(slopes.std(), rel=0.01)


def test_depths_below_the_target_do_not_make_it_surer() -> None:
    long, short = [[0.0, 1480.0], [100.0, 1490.0]], [[0.0, 1480.0], [4.0, 1480.4]]
    assert gradient_sigma(sonar(long), 4.0) == gradient_sigma(sonar(short), 4.0)
    assert gradient_sigma(sonar(long), None) < gradient_sigma(sonar(short), None)


def test_where_there_is_no_cast_the_gradient_is_as_unknown_as_without() -> None:
    whole = sonar([[0.0, 1480.0], [4.0, 1480.0]], sound_speed_gradient_sigma_1_s=0.3)
    half = sonar([[2.0, 1480.0], [4.0, 1480.0]], sound_speed_gradient_sigma_1_s=0.3)
    assert gradient_sigma(sonar(sound_speed_gradient_sigma_1_s=0.3), 4.0) == 0.3
    assert gradient_sigma(whole, 4.0) == pytest.approx(np.sqrt(2) * 0.05 / 4)
    assert gradient_sigma(half, 4.0) == pytest.approx(np.hypot(np.sqrt(2) * 0.05 / 2, 0.15))


def test_each_bias_has_its_own_setting() -> None:
    """In the unit of its parameter: metres, and shares of the sound speed."""
    laser = Laser(files=["a"], format="las", mount=MOUNT, incidence_bias_sigma_m=0.0007)
    mbes = sonar(
        incidence_bias_sigma_m=0.002, level_bias_sigma_m=0.006, projector_sigma_m=0.004, sound_speed_sigma_m_s=0.74
    )
    expected = {"laser_incidence": 0.0007, "mbes_incidence": 0.002, "mbes_level_range": 0.006}
    expected |= dict.fromkeys(PROJECTOR_PARAMETERS, 0.004)
    expected |= dict.fromkeys(("sound_speed", "steering_speed"), 0.74 / 1480)
    found = sonar_errors(list(expected), laser, {"mbes": mbes}, AsBuilt(), {})
    assert dict(zip(expected, found.sigmas, strict=True)) == pytest.approx(expected)
    assert not found.blocks  # independent of each other


def test_it_is_never_nothing_unless_it_is_said_to_be() -> None:
    laser = Laser(files=["a"], format="las", mount=MOUNT)
    cast = [[0.0, 1480.0], [4.0, 1480.0]]
    names = ["sound_speed_gradient"]
    assert sonar_errors(names, laser, {"mbes": sonar(cast)}, AsBuilt(), {}, 4.0).sigmas[0] > 0
    assert sonar_errors(names, laser, {"mbes": sonar(cast, svp_sigma_m_s=0.0)}, AsBuilt(), {}, 4.0).sigmas[0] == 0.0
