"""A file that laspy writes points to, and that remembers why it could not be written.

The compressor of LAZ tells of a full disk only that a write has failed, with an error of its own kind.
"""

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, cast


class _Disk(io.FileIO):
    """A new file; ``fault`` is the first error in writing to it."""

    fault: OSError | None = None

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            self.fault = self.fault or error
            raise


@contextlib.contextmanager
def points_file(path: Path) -> Iterator[BinaryIO]:
    """Yield a new file to write to; raise the system's own error if it could not be written."""
    disk = _Disk(path, "x+")
    try:
        with contextlib.closing(cast(BinaryIO, io.BufferedRandom(disk))) as file:
            yield file
    except Exception:
        if disk.fault is not None:
            raise disk.fault from None
        raise
