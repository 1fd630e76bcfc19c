"""Words for the times of files."""

from pipeline.gps_time import utc_text
from pipeline.starting.file_groups import FileGroup

NO_DATE = "of a week that the files do not name"


def span_words(group: FileGroup) -> str:
    """Return the times of the first and the last record of a group's files, UTC."""
    span = group.span_ns
    return NO_DATE if span is None else f"{utc_text(span[0])} to {utc_text(span[1])}"
