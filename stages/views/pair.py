"""Two runs in one recording: everything of the first under /a, of the second under /b, and what differs in words."""

from pathlib import Path
from typing import Any

from pipeline.diff import text
from pipeline.tables import Tables
from stages.views import log, recording_id, save, words
from stages.views.tour import side_by_side

SHOWN = ("segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report")  # in the target's frame


class Below:
    """A recording in which every entity lies one level deeper."""

    def __init__(self, recording: Any, name: str) -> None:
        self._recording, self._name = recording, name

    def log(self, path: str, *parts: Any, **options: Any) -> None:
        self._recording.log(f"{self._name}/{path}", *parts, **options)

    def send_columns(self, path: str, **columns: Any) -> None:
        self._recording.send_columns(f"{self._name}/{path}", **columns)

    def set_time(self, timeline: str, **at: Any) -> None:
        self._recording.set_time(timeline, **at)


def save_pair(first: Path, second: Path, found: dict[str, Any], path: Path) -> None:
    """``found``: the comparison of the two, from :func:`pipeline.diff.diff`."""

    def draw(recording: Any) -> None:
        for name, run in (("a", first), ("b", second)):
            for stage in SHOWN:
                log(Below(recording, name), stage, Tables(run))
        recording.log("tables/comparison", words(text(found)), static=True)

    save(path, recording_id(first, second), side_by_side(), draw)
