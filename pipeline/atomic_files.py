"""Files of a run folder: written whole or not at all, hashed once, removed safely.

Whatever the disk refuses (full, read-only, not permitted, something in the way) is the user's to correct, so it becomes
an :class:`~pipeline.errors.ArtefactError`; nothing else does.
"""

import contextlib
import errno
import hashlib
import json
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import ArtefactError

MOST_JSON_BYTES = 300_000_000
_REMEDIES = {
    errno.ENOSPC: "make room and run again",
    errno.EDQUOT: "make room within the quota and run again",
    errno.EROFS: "name a run folder on a disk that can be written",
    errno.EACCES: "correct its permissions or name another run folder",
    errno.EPERM: "correct its permissions or name another run folder",
    errno.EEXIST: "move what is in the way, or name another run folder",
    errno.ELOOP: "remove the symbolic link that is in the way, or name another run folder",
    errno.ENOTDIR: "move what is in the way, or name another run folder",
}


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Everything the operating system refuses inside becomes one line that names ``path`` and the remedy."""
    try:
        yield
    except OSError as error:
        number = error.errno if error.errno is not None else _errno_in(str(error))
        reason = os.strerror(number) if number else str(error)
        where = error.filename if isinstance(error.filename, str) else path
        remedy = _REMEDIES.get(number or 0, "correct this or name another run folder")
        raise ArtefactError(f"{where}: cannot be written ({reason}); {remedy}") from error


def _errno_in(message: str) -> int | None:
    """pyarrow says the number in words.

    >>> _errno_in("Error writing bytes to file. Detail: [errno 28] No space left on device")
    28
    """
    digits = message.lower().partition("[errno ")[2].partition("]")[0]
    return int(digits) if digits.isdigit() else None


def write_text(path: Path, text: str) -> None:
    """UTF-8, and whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Whole or not at all: written beside, on the disk, then renamed over. No link that lies in the way is followed."""
    beside = path.with_name(path.name + ".new")
    with writing(path):
        try:
            beside.unlink(missing_ok=True)
            with beside.open("xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            beside.replace(path)
        except OSError:
            with contextlib.suppress(OSError):
                beside.unlink()
            raise


def remove(path: Path) -> None:
    """A file, link or folder, whether it is there or not."""
    with writing(path):
        if path.is_dir() and not path.is_symlink():
            try:
                shutil.rmtree(path)
            except OSError as error:  # it names what it cannot remove by its last name alone
                last = Path(error.filename).name if isinstance(error.filename, str) else path.name
                place = path if last == path.name else f"{path} (its {last})"
                raise OSError(error.errno, error.strerror, str(place)) from error
        else:
            path.unlink(missing_ok=True)


def flush_to_disk(folder: Path) -> None:
    """Have the disk hold a finished folder, with all its files, before a rename says that it is complete."""
    with writing(folder):
        for place, _, names in os.walk(folder, topdown=False):
            for name in names:
                _sync(os.path.join(place, name))
            flush_names(Path(place))


def flush_names(folder: Path) -> None:
    """Have the disk hold the names in a folder, as after a rename. (Some network disks refuse: their server sees to
    it.)"""
    with contextlib.suppress(OSError):
        _sync(folder)


def _sync(path: str | Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def read_regular(path: Path, most: int) -> bytes:
    """A file's content, of at most ``most`` bytes and one more: a longer one is the caller's to refuse.

    Raises
    ------
    OSError
        It cannot be read, or is no regular file: a FIFO would be waited for without end, a device has no end.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "is no regular file", str(path))
        return file.read(most + 1)


def read_json(path: Path) -> object:
    """What a JSON file of a run folder says.

    Raises
    ------
    OSError
        As :func:`read_regular`.
    ValueError
        It is no JSON, or nested too deeply.
    """
    content = read_regular(path, MOST_JSON_BYTES)
    if len(content) > MOST_JSON_BYTES:
        raise ValueError(f"has more than {MOST_JSON_BYTES:,} bytes")
    try:
        return json.loads(content.decode("utf-8"))
    except RecursionError as error:
        raise ValueError("is nested too deeply") from error


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder for the time being."""
    try:
        place = tempfile.TemporaryDirectory(prefix="poolcal-")
    except OSError as error:
        raise ArtefactError(
            f"no temporary folder can be made ({error.strerror or error}); name one that can be written, with room: "
            "TMPDIR=/some/folder poolcal ..."
        ) from error
    with place as name:
        yield Path(name)


def sha256(path: Path) -> str:
    """SHA-256 of a file's content; a file that cannot be read is an ArtefactError."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ArtefactError(f"{path}: cannot be read ({error.strerror}); correct this and run again") from error


