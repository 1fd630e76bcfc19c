"""Run native decoders in a process of their own, because a damaged file may end that process without an exception.

The process (the worker) writes to its standard output in native byte order. For each batch it writes the number of rows
n as int64, and then the rows: n records of the same size, or the columns one after another, each as n float64. A number
0 ends the output. To report an error it writes -1, the length of a message as int64, and the message in UTF-8. A worker
may write one text in place of batches: its length as int64, and the text in UTF-8. Any other output, or none, raises a
RawDataError of the file.
"""

import contextlib
import fcntl
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError

REMEDY = "copy or export it again"
PIPE_BYTES = 1 << 20  # as much as Linux usually allows: both processes wait for each other less often
DecodedColumns = tuple[NDArray[np.float64], ...]


def decoded_batches(program: Path, arguments: list[str], name: str, width: int, batch: int) -> Iterator[DecodedColumns]:
    """Yield the columns that a worker decodes, batch by batch.

    Parameters
    ----------
    program : Path
        The worker's Python file.
    arguments : list of str
        The worker's command-line arguments.
    name : str
        The raw file's path in the session folder, for messages.
    width : int
        Number of columns.
    batch : int
        Largest number of rows in a batch.

    Yields
    ------
    tuple of ``width`` (n,) arrays

    Raises
    ------
    RawDataError
        The file is damaged: the worker reports an error, or ends without the final count.
    """
    for data in decoded_records(program, arguments, name, width * 8, batch):
        yield tuple(np.frombuffer(data, np.float64).reshape(width, -1))


def decoded_records(program: Path, arguments: list[str], name: str, size: int, batch: int) -> Iterator[bytes]:
    """Yield the records that a worker decodes, batch by batch.

    Parameters
    ----------
    program, arguments, name, batch
        As for :func:`decoded_batches`.
    size : int
        Bytes of a record.
    """
    with _started(program, arguments) as stream:
        while count := _count(stream, name, batch):
            yield _exactly(stream, size * count, name)


def decoded_text(program: Path, arguments: list[str], name: str, most: int) -> str:
    """Return the one text that a worker writes in place of batches.

    Parameters
    ----------
    program, arguments, name
        As for :func:`decoded_batches`.
    most : int
        Largest length of the text, bytes.
    """
    with _started(program, arguments) as stream:
        return _exactly(stream, _count(stream, name, most), name).decode("utf-8", "replace")


@contextlib.contextmanager
def _started(program: Path, arguments: list[str]) -> Iterator[IO[bytes]]:
    command = [sys.executable, "-P", str(program), *arguments]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as worker:
        try:
            assert worker.stdout is not None
            with contextlib.suppress(OSError, AttributeError):  # systems and users have limits; a small pipe will do
                fcntl.fcntl(worker.stdout, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
            yield worker.stdout
        finally:
            worker.kill()


def _count(stream: IO[bytes], name: str, most: int) -> int:
    (count,) = struct.unpack("=q", _exactly(stream, 8, name))
    if 0 <= count <= most:
        return int(count)
    (length,) = struct.unpack("=q", _exactly(stream, 8, name))
    reason = _exactly(stream, min(max(length, 0), 4096), name).decode("utf-8", "replace")
    raise RawDataError(f"{name}: is damaged ({reason}); {REMEDY}")


def _exactly(stream: IO[bytes], count: int, name: str) -> bytes:
    data = stream.read(count)
    if len(data) < count:
        raise RawDataError(f"{name}: is damaged: unpacking it ended the unpacking program; {REMEDY}")
    return data
