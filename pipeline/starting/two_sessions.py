"""Signs that a folder holds files of two sessions: a long time between two files, or files without the INS's."""

from collections.abc import Iterator, Mapping

from pipeline.config.instruments import Sensor
from pipeline.gps_time import NS, utc_text
from pipeline.starting.file_groups import FileGroup

LONG_NS = 12 * 3600 * NS  # a session lasts hours
_ADVICE = "if they are of two sessions, give each a folder of its own"


def two_session_doubts(chosen: Mapping[Sensor, FileGroup]) -> Iterator[str]:
    """Yield a sentence for each sensor whose files are far apart, and for each that runs without the INS.

    Parameters
    ----------
    chosen
        By sensor, the files that the session takes. Those of an unknown week are left out.
    """
    dated = {sensor: group for sensor, group in chosen.items() if group.span_ns is not None}
    for group in dated.values():
        yield from _far_apart(group)
    for sensor, group in dated.items():
        if sensor != "ins" and "ins" in dated:
            yield from _without_ins(group, dated["ins"])


def _far_apart(group: FileGroup) -> Iterator[str]:
    """Yield a sentence on the longest time between two files, if it is long."""
    files = sorted(group.files, key=lambda file: (file.span_ns, file.name))
    last, gaps = files[0], []
    for file in files[1:]:
        gaps.append((file.span_ns[0] - last.span_ns[1], last.name, file.name))
        last = max(last, file, key=lambda one: one.span_ns[1])
    long = [gap for gap in gaps if gap[0] > LONG_NS]
    if long:
        gap_ns, before, after = max(long, key=lambda gap: gap[0])
        hours = gap_ns / (3600 * NS)
        time = f"{hours:.0f} hours" if hours < 48 else f"{hours / 24:.0f} days"
        yield f"{after}: begins {time} after the end of {before}; {_ADVICE}"


def _without_ins(group: FileGroup, ins: FileGroup) -> Iterator[str]:
    """Yield a sentence if files of a sensor lie outside all times of the INS."""
    outside = [
        file
        for file in group.files
        if not any(one.span_ns[0] <= file.span_ns[1] and file.span_ns[0] <= one.span_ns[1] for one in ins.files)
    ]
    if outside:
        first = min(outside, key=lambda file: (file.span_ns, file.name))
        others = f" (and {len(outside) - 1} more)" if len(outside) > 1 else ""
        when = f"{utc_text(first.span_ns[0])} to {utc_text(first.span_ns[1])}"
        yield f"{first.name}{others}: runs from {when}, when no file of the INS does; {_ADVICE}"
