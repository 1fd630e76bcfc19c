"""GPS weeks from the other files' dates: one that fits, none, or several."""

from dataclasses import replace

import numpy as np

from pipeline.checking.file_survey import SurveyedFile
from pipeline.gps_time import NS, WEEK_NS
from pipeline.readers.file_kind import E57, SBET, FileKind
from pipeline.starting.file_groups import PROVISIONAL_WEEK, FileGroup
from pipeline.starting.weeks import with_weeks


def _file(name: str, week: int, start_s: float, end_s: float) -> SurveyedFile:
    t_ns = week * WEEK_NS + np.array([start_s * NS, end_s * NS]).astype(np.int64)
    return SurveyedFile("ins", name, 1, records=2, epochs_ns=t_ns)


def _group(kind: FileKind, *files: SurveyedFile, undated: bool) -> FileGroup:
    names = tuple(file.name for file in files)
    return FileGroup("ins", kind, files, names, frozenset(names) if undated else frozenset())


def _week(*dated: SurveyedFile, start_s: float = 1000.0, end_s: float = 2000.0) -> int | None:
    own = _group(SBET, _file("a", PROVISIONAL_WEEK, start_s, end_s), undated=True)
    group, *_ = with_weeks([own, _group(E57, *dated, undated=False)])
    if group.gps_week is not None:
        assert group.span_ns == (
            group.gps_week * WEEK_NS + round(start_s * NS), group.gps_week * WEEK_NS + round(end_s * NS)
        )
    return group.gps_week


def test_the_week_in_which_the_files_run_together() -> None:
    assert _week(_file("b", 2418, 1500, 1600)) == 2418
    assert _week(_file("b", 1333, 1500, 1600)) == 1333


def test_a_session_over_the_weeks_end() -> None:
    last = WEEK_NS / NS
    assert _week(_file("b", 2418, 5, 60), start_s=last - 100, end_s=last + 100) == 2417
    assert _week(_file("b", 2417, last - 50, last - 40), start_s=last - 100, end_s=last + 100) == 2417


def test_no_week_where_none_or_several_fit() -> None:
    assert _week() is None
    assert _week(_file("b", 2418, 2001, 3000)) is None  # never at the same time of the week
    assert _week(_file("b", 2418, 1500, 1600), _file("c", 2419, 1500, 1600)) is None
    assert _week(_file("b", 2418, 1500, 1600), _file("c", 2419, 50_000, 60_000)) == 2418


def test_dated_files_keep_their_times() -> None:
    own = _group(SBET, _file("a", PROVISIONAL_WEEK, 0, 9), _file("b", 2418, 3, 5), undated=True)
    (group,) = with_weeks([replace(own, undated=frozenset({"a"}))])
    assert group.gps_week == 2418
    assert [file.span_ns[0] // WEEK_NS for file in group.files] == [2418, 2418]
