"""GPS weeks of files that have seconds of the week alone, from the dates of the other files."""

from collections.abc import Iterable, Sequence

from pipeline.gps_time import WEEK_NS
from pipeline.starting.file_groups import PROVISIONAL_WEEK, FileGroup


def with_weeks(groups: Sequence[FileGroup]) -> list[FileGroup]:
    """Return the groups; those without a week get it where the dated files of the folder leave one week alone."""
    dated = [file.span_ns for group in groups for file in group.files if file.name not in group.undated]
    return [_dated(group, dated) if group.undated else group for group in groups]


def _dated(group: FileGroup, dated: Sequence[tuple[int, int]]) -> FileGroup:
    own = [file.span_ns for file in group.files if file.name in group.undated]
    weeks = {PROVISIONAL_WEEK + later for span in own for later in _weeks_later(span, dated)}
    return group.in_week(weeks.pop()) if len(weeks) == 1 else group


def _weeks_later(span: tuple[int, int], dated: Iterable[tuple[int, int]]) -> set[int]:
    """Return by how many weeks a file must be moved to run at the same time as one of the dated files.

    Files that last less than a week together overlap for one number of weeks at most, for which their middles are
    nearest to each other.
    """
    middle = sum(span) / 2
    found = set()
    for first, last in dated:
        weeks = round(((first + last) / 2 - middle) / WEEK_NS)
        if span[0] + weeks * WEEK_NS <= last and first <= span[1] + weeks * WEEK_NS:
            found.add(weeks)
    return found
