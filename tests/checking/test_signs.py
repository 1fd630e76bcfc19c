"""poolcal check on small coarse angles of the wrong sign."""

import numpy as np
import pandas as pd
import pytest

from pipeline.checking import trial_findings
from pipeline.config.mount import Mount
from pipeline.config.target import Letters, Origin
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.target.design import target_of
from tests.support.mount_errors import rotation_error

TRUE = Mount(roll_deg=-48.8, pitch_deg=1.2, yaw_deg=-2.0, x_m=0.3, y_m=0.2, z_m=-2.0)
BLOCKS = target_of(Letters(a=8, b=3, c=1, e=0.5, origin=Origin(latitude_deg=36, longitude_deg=120, height_m=12)))


def _provisional(given: Mount) -> pd.DataFrame:
    turn_deg = np.degrees(rotation_error(mount_of(TRUE).R_body_from_sensor, mount_of(given).R_body_from_sensor))
    return pd.DataFrame([dict(zip((f"rotation_{a}_deg" for a in "xyz"), turn_deg, strict=True))])


SIGNS = [
    ({"pitch_deg": -2.0}, "mbes.mount.pitch_deg = 2 in place of -2", "fault"),
    ({"pitch_deg": -1.2}, "mbes.mount.pitch_deg = 1.2 in place of -1.2", "look"),
    ({"yaw_deg": 2.8}, "mbes.mount.yaw_deg = -2.8 in place of 2.8", "fault"),
    ({"pitch_deg": -2.0, "yaw_deg": 2.8}, "pitch_deg = 2 in place of -2, mbes.mount.yaw_deg = -2.8", "fault"),
]


@pytest.mark.parametrize(("wrong", "said", "severity"), SIGNS)
def test_wrong_signs_of_small_angles(wrong: dict[str, float], said: str, severity: str) -> None:
    given = TRUE.model_copy(update=wrong)
    (found,) = trial_findings.sign_findings(given, _provisional(given), BLOCKS, 3.0)
    assert said in found.words
    assert "roll_deg -48.8, pitch_deg 1.2, yaw_deg -2.0" in found.words
    assert found.severity == severity


@pytest.mark.parametrize("near", [{"pitch_deg": 2.0, "yaw_deg": -2.8}, {"yaw_deg": -4.9}, {"pitch_deg": -0.2}])
def test_coarse_angles_are_no_wrong_signs(near: dict[str, float]) -> None:
    given = TRUE.model_copy(update=near)
    assert list(trial_findings.sign_findings(given, _provisional(given), BLOCKS, 3.0)) == []


def test_a_plain_wall_says_nothing_of_signs() -> None:
    """Its soundings leave yaw and more to chance."""
    given = TRUE.model_copy(update={"yaw_deg": 2.8})
    flat = TargetModel(BLOCKS.faces[:1], BLOCKS.families[:1], (), BLOCKS.water_level_m, None)
    assert list(trial_findings.sign_findings(given, _provisional(given), flat, 3.0)) == []
