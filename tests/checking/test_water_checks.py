"""Water that rises between passes: whether poolcal check tells it, and whether readings agree with the boat."""

from typing import Any

import numpy as np
import pytest

from pipeline.checking.findings import Finding
from pipeline.checking.track import Leg
from pipeline.checking.water_checks import water_findings
from pipeline.config.pool import PoolConfig
from pipeline.config.yaml_models import parse
from pipeline.gps_time import NS, gps_ns_from_unix_utc

START_NS = int(gps_ns_from_unix_utc(np.array([1_778_302_800]), np.array([0]))[0])  # 2026-05-09T05:00:00Z
TARGET = {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5}
PLACE = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}


def told(rise_m: float, by_time: Any = None, margin_m: float = 0.10) -> list[Finding]:
    """Two passes of ten seconds, at 05:00 and 05:10; a third one is behind the target, and does not count."""
    content = {"target": {**TARGET, "origin": PLACE, "water_level_m": -0.2, "water_by_time": by_time}}
    pool = parse(PoolConfig, content | {"segment": {"water_margin_m": margin_m}}, "pool")
    legs = [
        Leg(start, start + 10 * NS, away_m, 0.4, 1.0, height_m, True, {"laser": 1.0, "mbes": 1.0})
        for start, away_m, height_m in (
            (START_NS, 4.0, 1.3), (START_NS + 600 * NS, 7.0, 1.3 + rise_m), (START_NS + 1200 * NS, -5.0, 9.0)
        )
    ]  # fmt: skip
    return list(water_findings(legs, pool))


def staff(rise_m: float, last: str = "05:10:30") -> dict[str, Any]:
    times, heights = ("04:59", "05:01", "05:02", last), (3.0, 3.0, 3.0 + rise_m, 3.0 + rise_m)
    return {"readings": [[f"2026-05-09T{time}Z", height] for time, height in zip(times, heights, strict=True)]}


@pytest.mark.parametrize(
    ("rise_m", "margin_m", "found"), [(0.09, 0.1, 0), (0.12, 0.1, 1), (-0.3, 0.1, 1), (0.3, 0.4, 0)]
)
def test_water_that_rises_between_passes_is_told(rise_m: float, margin_m: float, found: int) -> None:
    findings = told(rise_m, margin_m=margin_m)
    assert len(findings) == found
    for finding in findings:
        assert (finding.question, finding.severity) == ("water", "look")
        higher, lower = ("2026-05-09T05:10:00Z", "2026-05-09T05:00:00Z")[:: 1 if rise_m > 0 else -1]
        assert f"{abs(rise_m):.2f} m higher in the pass of {higher} than in that of {lower}" in finding.words
        assert "target.water_by_time how: ins_above_water_m" in finding.words


@pytest.mark.parametrize(("above_m", "found"), [(1.5, 0), (1.25, 0), (1.1, 1), (2.2, 1)])
def test_the_height_of_the_ins_above_the_water_is_held_against_the_given_level(above_m: float, found: int) -> None:
    """The water stands at -0.2 m by water_level_m; the INS at 1.3 and 1.6 m."""
    findings = told(0.3, {"ins_above_water_m": above_m})
    assert [(finding.question, finding.severity) for finding in findings] == [("water", "look")] * found
    assert all("measure the height of the INS above the water" in finding.words for finding in findings)


DISAGREE = [(0.3, 0.3, 0), (0.3, 0.21, 0), (0.3, 0.19, 1), (-0.3, 0.3, 1)]  # the last: of the wrong sign


@pytest.mark.parametrize(("boat_m", "staff_m", "found"), DISAGREE)
def test_readings_that_the_boat_contradicts_are_told(boat_m: float, staff_m: float, found: int) -> None:
    findings = told(boat_m, staff(staff_m))
    assert [finding.severity for finding in findings] == ["look"] * found
    for finding in findings:
        assert "from the pass of 2026-05-09T05:00:00Z to the pass of 2026-05-09T05:10:00Z the water" in finding.words
        assert f"rises by {staff_m:+.2f} m by target.water_by_time.readings" in finding.words
        assert f"the boat by {boat_m:+.2f} m" in finding.words


@pytest.mark.parametrize(("last", "found"), [("05:09:11", 0), ("05:09:09", 1)])
def test_a_pass_that_the_readings_do_not_cover_is_told(last: str, found: int) -> None:
    findings = told(0.0, staff(0.0, last))
    assert [finding.severity for finding in findings] == ["fault"] * found
    words = "do not cover the pass from 2026-05-09T05:10:00Z to 2026-05-09T05:10:10Z; add"
    assert all(words in finding.words for finding in findings)
