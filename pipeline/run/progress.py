"""The progress of a run: on a terminal a bar with rate and time left, elsewhere one line for each finished stage.

A command without stages shows on a terminal what it is doing, and elsewhere nothing.
"""

import contextlib
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TextIO

from pipeline.language.chosen import translated
from pipeline.language.speaking import say

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

MAX_REASONS = 3


@dataclass
class Progress:
    """Print the progress of a run. Several workers may use it at the same time."""

    stream: TextIO = field(default_factory=lambda: sys.stderr)
    quiet: bool = False
    _rows: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _bar: "Bar | None" = None

    def note(self, text: str) -> None:
        """Print a line."""
        if not self.quiet:
            say(text, self.stream)

    def reasons(self, stage: str, reasons: Sequence[str]) -> None:
        """Print why a stage is run."""
        for reason in reasons[:MAX_REASONS]:
            self.note(f"{stage}: {reason}")
        if len(reasons) > MAX_REASONS:
            self.note(f"{stage}: and {len(reasons) - MAX_REASONS} more")

    @contextlib.contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Show the progress of one stage. At the end print its time, its rows and its rate."""
        self._rows, start = 0, time.perf_counter()
        with self.shown(name):
            yield
        seconds = time.perf_counter() - start
        rate = f", {self._rows:,} rows, {self._rows / max(seconds, 1e-9):,.0f} rows/s" if self._rows else ""
        self.note(f"{name}: done in {seconds:.1f} s{rate}")

    @contextlib.contextmanager
    def shown(self, words: str) -> Iterator[None]:
        """Show on a terminal what is being done, as long as it is; elsewhere print nothing."""
        if self.quiet or not self.stream.isatty():
            yield
            return
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        columns: tuple[Any, ...] = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn())
        columns += (TextColumn("{task.fields[rate]}"), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
        with Progress(*columns, console=Console(file=self.stream), transient=True) as self._bar:
            self._bar.add_task(translated(words), total=None, rate="")
            try:
                yield
            finally:
                self._bar = None

    def next(self, words: str) -> None:
        """Show other words: a further step of what is being done."""
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], description=translated(words))

    def begin(self, total: int | None) -> None:
        """Start to count the rows of the streams that are mapped next; ``total``: their number, None if unknown."""
        self._rows = 0
        if self._bar is not None:
            self._bar.reset(self._bar.task_ids[0], total=total, rate="")

    def advance(self, rows: int) -> None:
        """Count rows that a worker has processed."""
        with self._lock:
            self._rows += rows
            if self._bar is not None:
                task = self._bar.tasks[0]
                rate = f"{self._rows / task.elapsed:,.0f} rows/s" if task.elapsed else ""
                self._bar.update(task.id, completed=self._rows, rate=rate)
