"""The warning that the boat's height contradicts the water's level by time."""

import pandas as pd
import pytest

from pipeline.config.target import Letters, Origin
from pipeline.config.water_by_time import WaterByTime
from pipeline.report.reason_codes import ReasonCode
from pipeline.report.water_check import water_contradicted
from tests.support.evidence import codes

ORIGIN = Origin(latitude_deg=36.0, longitude_deg=120.1, height_m=12.0)
READINGS = (("2026-05-09T05:00:00Z", 0.0), ("2026-05-09T06:00:00Z", 0.3))
RISING = Letters(a=8.0, b=3.0, c=1.0, e=0.5, origin=ORIGIN, water_by_time=WaterByTime(readings=READINGS))


@pytest.mark.parametrize(("boat_m", "told"), [(0.21, False), (0.19, True)])
def test_water_that_rises_otherwise_than_the_boat_is_told(boat_m: float, told: bool) -> None:
    """The second pass is far from the target, in a basin with water of its own."""
    levels = pd.DataFrame({"pass": [0, 1, 2], "level_m": [0.0, 9.0, 0.3], "ins_m": [1.3, 1.3, 1.3 + boat_m]})
    statements = water_contradicted(levels, pd.DataFrame({"pass": [0, 2, 2]}), RISING, 0.1)
    assert codes(statements) == [ReasonCode.WATER_CONTRADICTED] * told
    words = "from pass 0 to pass 2 the water rises by +0.30 m by target.water_by_time.readings, and the boat by +0.19 m"
    assert all(statement.words.startswith(words) for statement in statements)


def test_still_water_is_not_judged() -> None:
    levels = pd.DataFrame({"pass": [0, 1], "level_m": [0.0, 0.0], "ins_m": [1.3, 2.3]})
    still = RISING.model_copy(update={"water_by_time": None})
    assert water_contradicted(levels, pd.DataFrame({"pass": [0, 1]}), still, 0.1) == []
