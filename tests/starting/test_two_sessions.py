"""Files of two days or weeks in one folder are pointed out; those of one session, past midnight too, are not."""

import numpy as np
import pytest

from pipeline.checking.file_survey import SurveyedFile
from pipeline.config.instruments import Sensor
from pipeline.gps_time import NS, WEEK_NS
from pipeline.readers.file_kind import LAS, NOVATEL, SBET, FileKind
from pipeline.starting.file_groups import FileGroup
from pipeline.starting.session_text import _is_about
from pipeline.starting.two_sessions import two_session_doubts

HOUR_S = 3600.0


def file(sensor: Sensor, name: str, start_s: float, end_s: float) -> SurveyedFile:
    t_ns = 2418 * WEEK_NS + (np.array([start_s, end_s]) * NS).astype(np.int64)
    return SurveyedFile(sensor, name, 1, records=2, epochs_ns=t_ns)


def group(sensor: Sensor, *files: SurveyedFile, kind: FileKind = LAS) -> FileGroup:
    return FileGroup(sensor, kind, files, tuple(one.name for one in files))


def doubts(*groups: FileGroup) -> list[str]:
    return list(two_session_doubts({one.sensor: one for one in groups}))


INS = group("ins", file("ins", "ins/a.gps", 0, HOUR_S), kind=NOVATEL)


def test_one_session_is_no_doubt() -> None:
    assert doubts(INS, group("laser", file("laser", "b.las", 0, 9), file("laser", "a.las", 90, 99))) == []
    late = group("ins", file("ins", "a", 0, 9), file("ins", "b", 9 + 12 * HOUR_S, 99 + 12 * HOUR_S))
    assert doubts(late) == []  # twelve hours, and not more
    assert doubts(group("laser", file("laser", "a.las", 0, 9))) == []


@pytest.mark.parametrize(("apart_s", "said"), [(13 * HOUR_S, "13 hours"), (47.4 * HOUR_S, "47 hours"),
                                               (7 * 24 * HOUR_S, "7 days")])  # fmt: skip
def test_a_day_between_two_files(apart_s: float, said: str) -> None:
    """A long file within which another one ends: the time counts from the end of the long one."""
    files = (file("ins", "船/c.gps", 9 + apart_s, 99 + apart_s), file("ins", "a.gps", 0, 9), file("ins", "b.gps", 1, 2))
    (doubt,) = doubts(group("ins", *files))
    assert (
        doubt
        == f"船/c.gps: begins {said} after the end of a.gps; if they are of two sessions, give each a folder of its own"
    )
    assert _is_about(doubt, group("ins", *files))


def test_files_when_the_ins_does_not_run() -> None:
    """The GPS week begins 18 s before the UTC day."""
    week = 7 * 24 * HOUR_S
    laser = group("laser", file("laser", "a.las", week, week + 9), file("laser", "b.las", week + 10, week + 19))
    (doubt,) = doubts(INS, laser)
    assert doubt.startswith("a.las (and 1 more): runs from 2026-05-16T23:59:42Z to 2026-05-16T23:59:51Z, when no file")
    partly = group(
        "laser", file("laser", "a.las", HOUR_S - 1, HOUR_S + 9), file("laser", "b.las", HOUR_S + 1, HOUR_S + 9)
    )
    (doubt,) = doubts(INS, partly)
    assert doubt.startswith("b.las: runs from")


def test_files_of_an_unknown_week_are_left_out() -> None:
    far = (file("ins", "a.sbet", 0, 9), file("ins", "b.sbet", 20 * HOUR_S, 21 * HOUR_S))
    undated = FileGroup("ins", SBET, far, ("a.sbet", "b.sbet"), frozenset({"a.sbet", "b.sbet"}))
    assert doubts(undated, group("laser", file("laser", "a.las", 9e5, 9.1e5))) == []
