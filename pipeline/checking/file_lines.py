"""Lines of poolcal check on what the table of files does not show: what is left out, and the gaps that end a pass."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from pipeline.checking.file_survey import SurveyedFile, Times
from pipeline.gps_time import utc_text
from pipeline.readers.file_summaries import gaps_table

UNSAID = "no detection"  # a beam without an echo is no loss
SHOWN = 6  # gaps


def left_out_lines(files: Sequence[SurveyedFile]) -> Iterator[str]:
    """Yield a line for each sensor and reason for which records are left out, in the words of ``poolcal run``."""
    for sensor in dict.fromkeys(file.sensor for file in files):
        of_sensor = [file for file in files if file.sensor == sensor]
        dropped = sum((file.dropped for file in of_sensor), Counter[str]())
        read = sum(dropped.values()) + sum(round(file.records * file.share) for file in of_sensor)
        whole = all(file.share == 1.0 and file.ended for file in of_sensor)
        for reason, count in sorted(dropped.items()):
            if count and reason != UNSAID:
                yield f"{sensor}: left out {count:,} of {read:,}{'' if whole else ' that were read'}: {reason}"


def gaps_of(epochs: Mapping[str, Times], max_gap_ns: int) -> pd.DataFrame:
    """Return the gaps of INS and soundings that end a pass, as table ``gaps`` of a run has them."""
    return gaps_table({sensor: t_ns for sensor, t_ns in epochs.items() if sensor != "laser"}, max_gap_ns)


def gaps_line(gaps: pd.DataFrame) -> str:
    """Return the line on the gaps that end a pass, the longest first, as the report has it; empty without any."""
    rows = gaps.sort_values("duration_s", ascending=False, kind="stable").to_dict("records")
    if not rows:
        return ""
    shown = "; ".join(
        f"{row['sensor']} {utc_text(int(row['start_ns']))[11:19]}, {row['duration_s']:.1f} s" for row in rows[:SHOWN]
    )
    more = len(rows) - SHOWN
    return f"Gaps that end a pass, the longest first: {shown}{f'; and {more} shorter' if more > 0 else ''}"
