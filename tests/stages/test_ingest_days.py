"""Sensors that have no time in common: whole days apart has a cause of its own."""

import pytest

from pipeline.errors import RawDataError
from pipeline.gps_time import NS, WEEK_NS
from pipeline.readers.file_summaries import refuse_disjoint_times

HOUR_NS, DAY_NS = 3600 * NS, 86_400 * NS
SUNDAY = (2400 * WEEK_NS + 10 * HOUR_NS, 2400 * WEEK_NS + 11 * HOUR_NS)


def moved(span: tuple[int, int], days: int) -> tuple[int, int]:
    return span[0] + days * DAY_NS, span[1] + days * DAY_NS


@pytest.mark.parametrize("days", [1, 3, 6])
def test_an_ins_in_seconds_of_the_day(days: int) -> None:
    said = f"laser is {days} days? ahead of the INS: the INS's times are all of a Sunday and seem to be seconds of the"
    with pytest.raises(RawDataError, match=said) as error:
        refuse_disjoint_times(SUNDAY, {"laser": moved(SUNDAY, days)})
    assert "\n" not in str(error.value)


def test_whole_days_of_other_causes() -> None:
    with pytest.raises(RawDataError, match="mbes is 2 days behind the INS: check the clocks"):
        refuse_disjoint_times(moved(SUNDAY, 3), {"mbes": moved(SUNDAY, 1)})
    with pytest.raises(RawDataError, match="check the instruments' clocks and latency_s"):
        refuse_disjoint_times(SUNDAY, {"mbes": (SUNDAY[1] + 5 * HOUR_NS, SUNDAY[1] + 6 * HOUR_NS)})
    with pytest.raises(RawDataError, match="1 week apart: check gps_week"):
        refuse_disjoint_times(SUNDAY, {"mbes": moved(SUNDAY, 7)})
    with pytest.raises(RawDataError, match="30 days apart: name files of one session"):
        refuse_disjoint_times(SUNDAY, {"mbes": moved(SUNDAY, 30)})
    refuse_disjoint_times(SUNDAY, {"laser": SUNDAY})
