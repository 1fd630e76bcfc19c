"""Lines about files that a session does not use; many of one kind in one folder are one line."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import PurePosixPath

from pipeline.console import plural
from pipeline.starting.folder_files import LeftOut

ALIKE = 3  # files of one suffix, left out for one reason in one folder; more than these are one line


def left_out_lines(left_out: Sequence[LeftOut], most: int) -> list[str]:
    """Return at most ``most`` lines with names and reasons, and one that says how many files more there are.

    Parameters
    ----------
    left_out
        The files.
    most
        The largest number of lines.
    """
    lines = list(_lines(sorted(left_out)))
    more = sum(number for number, _ in lines[most:])
    last = [f"and {plural(more, 'file')} more"] if more else []
    return [*(line for _, line in lines[:most]), *last]


def _lines(left_out: Sequence[LeftOut]) -> Iterator[tuple[int, str]]:
    """Yield lines in order of the first file of each, with the number of its files."""
    first: dict[tuple[str, str, str], LeftOut] = {}
    for one in left_out:
        first.setdefault(_kind(one), one)
    together = sorted(left_out, key=lambda one: (first[_kind(one)], one))
    for _, group in groupby(together, _kind):
        files = list(group)
        if len(files) <= ALIKE:
            yield from ((1, f"{one.name}: {one.why}") for one in files)
        else:
            others = plural(len(files) - 1, "file")
            yield len(files), f"{files[0].name} and {others} more of its folder and suffix: {files[0].why}"


def _kind(one: LeftOut) -> tuple[str, str, str]:
    path = PurePosixPath(one.name)
    return str(path.parent), path.suffix, one.why
