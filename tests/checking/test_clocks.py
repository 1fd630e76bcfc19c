"""poolcal check: clocks that are off by milliseconds, time zones, whole days and weeks."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.support.checks import FINE, SBET, assert_only
from tests.support.effort import often
from tests.support.places import edit

pytestmark = pytest.mark.usefixtures("calibrated_where_marked")


def _shift_ins(session: Path, seconds: float) -> None:
    """SBET: the first of 17 doubles is the time."""
    path = session / "ins" / "ins.sbet"
    records = np.fromfile(path, "<f8").reshape(-1, 17)
    records[:, 0] += seconds
    records.tofile(path)


def test_utc_taken_for_gps_shows_in_when_sensors_ran(spoilt: Callable[..., Path]) -> None:
    session = spoilt(**SBET)
    _shift_ins(session, -18.0)  # the INS in UTC
    assert_only(session, "clock", "ins: its clock is 18 s behind both sensors'", "UTC and GPS time are mixed up")


def test_a_clock_is_told_from_the_target_where_all_ran_on(spoilt: Callable[..., Path]) -> None:
    """With sensors that run without pause when they ran tells nothing."""
    session = spoilt("messy")
    edit(session / "session.yaml", "laser", latency_s=7.0)  # taken off: the laser is 7 s behind
    said = assert_only(session, "clock", "laser: its points hit the target if its clock is", " s behind the INS's")
    assert abs(float(said.split("clock is ")[1].split(" s")[0]) - 7.0) < 1.0  # the origin is 0.2 m off along the track


@pytest.mark.parametrize(("weeks", "said"), [(-1, "1 week behind"), (2, "2 weeks ahead of")])
def test_a_wrong_week(spoilt: Callable[..., Path], weeks: int, said: str) -> None:
    session = spoilt(**SBET)
    edit(session / "session.yaml", "ins", gps_week=2418 + weeks)
    week = f"write ins.gps_week: 2418 in place of {2418 + weeks}"
    assert_only(session, "clock", f"ins: its clock is {said} both sensors'", week)


def test_a_time_zone(spoilt: Callable[..., Path]) -> None:
    session = spoilt(**SBET)
    _shift_ins(session, 8 * 3600.0)
    assert_only(session, "clock", "8 hours ahead of both sensors'", "time zone")


@pytest.mark.parametrize(
    ("days", "said"),
    [(-2, ("2 days behind", "all of a Sunday and seem to be")), (1, ("1 day ahead", "check the clocks"))],
)
def test_whole_days(spoilt: Callable[..., Path], days: int, said: tuple[str, ...]) -> None:
    """Seconds of the day in place of the week are those of a Sunday; the session is of a Tuesday."""
    session = spoilt(**SBET)
    _shift_ins(session, days * 86_400.0)
    assert_only(session, "clock", *said)


@pytest.mark.calibrates
@pytest.mark.parametrize(
    ("sensor", "latency_ms"), [("ins", 20), *often([], [("mbes", -16), ("laser", 12), ("mbes", 100)])]
)
def test_a_clock_off_by_milliseconds(spoilt: Callable[..., Path], sensor: str, latency_ms: int) -> None:
    """Latency is taken off: a clock of which too much is taken off is behind."""
    session = spoilt(**FINE)
    edit(session / "session.yaml", sensor, latency_s=latency_ms / 1000)
    side = "ahead of" if latency_ms < 0 else "behind"
    said = assert_only(session, "latency", f"{sensor}: its clock is", side, " ms ")
    assert abs(float(said.split(" is ")[1].split(" ms")[0]) - abs(latency_ms)) < 8
    low, high = (float(number) for number in said.split(" (")[1].split(" ms, 95 %")[0].split(" to "))
    assert low - 8 < abs(latency_ms) < high + 8
    if sensor == "ins":
        assert abs(float(said.split("about ")[1].split(" s,")[0]) + latency_ms / 1000) < 0.008
    else:
        assert f"{sensor}_latency]" in said
