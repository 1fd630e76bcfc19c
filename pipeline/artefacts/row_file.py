"""Rows of numbers in a temporary file without a name: a table too long for memory, written once and read in pieces.

The file has no place in a run. It vanishes when nothing refers to it any more, and when the program ends or is killed.
"""

import mmap
import tempfile
import weakref

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ArtefactError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class RowFile:
    """Rows (n, columns) of float64. They are appended by one thread, and then read by any number of threads."""

    def __init__(self, columns: int) -> None:
        self._columns = columns
        try:
            self._file = tempfile.TemporaryFile(buffering=0, prefix="poolcal-")  # noqa: SIM115 (open as long as the object)
        except OSError as error:
            raise _no_room(error) from error
        weakref.finalize(self, self._file.close)

    def append(self, rows: Array) -> None:
        """Write rows (m, columns) after those that are there.

        Nothing waits in a buffer: it would be written again, and fail again, when the file is closed.
        """
        left = np.ascontiguousarray(rows, dtype=np.float64).reshape(-1).view(np.uint8)
        try:
            while len(left):
                left = left[self._file.write(left.data) :]
        except OSError as error:
            raise _no_room(error) from error

    def read(self, rows: Integers) -> Array:
        """Return a copy of rows (m,), in the order of their numbers here; memory is taken for these alone."""
        if not len(rows):
            return np.empty((0, self._columns))
        first, last = int(rows.min()), int(rows.max())
        row_bytes = self._columns * 8
        start = first * row_bytes // mmap.ALLOCATIONGRANULARITY * mmap.ALLOCATIONGRANULARITY
        length = (last + 1) * row_bytes - start
        with mmap.mmap(self._file.fileno(), length, access=mmap.ACCESS_READ, offset=start) as mapped:
            skipped = first * row_bytes - start
            numbers = np.frombuffer(mapped, dtype=np.float64, offset=skipped).reshape(-1, self._columns)
            found = numbers[rows - first]
            del numbers  # nothing may refer to what is no longer mapped
        return found


def _no_room(error: OSError) -> ArtefactError:
    return ArtefactError(
        f"{tempfile.gettempdir()}: a temporary file cannot be written ({error.strerror or error}); name a folder with "
        "room: TMPDIR=/some/folder poolcal ..."
    )
