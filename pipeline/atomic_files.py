"""Files of a run folder: they are written whole or not at all, read, hashed, and removed safely.

The disk may be full or read-only, a permission may be missing, or another file may be in the way. The user must correct
these errors, so they become an :class:`~pipeline.errors.ArtefactError`. No other error does.
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
    """Turn an error of the operating system in the block into an ArtefactError with the path and the remedy."""
    try:
        yield
    except OSError as error:
        number = error.errno if error.errno is not None else _errno_in(str(error))
        reason = os.strerror(number) if number else str(error)
        where = error.filename if isinstance(error.filename, str) else path
        remedy = _REMEDIES.get(number or 0, "correct this or name another run folder")
        raise ArtefactError(f"{where}: cannot be written ({reason}); {remedy}") from error


def _errno_in(message: str) -> int | None:
    """Return the error number that a message of pyarrow contains; None if it has none.

    >>> _errno_in("Error writing bytes to file. Detail: [errno 28] No space left on device")
    28
    """
    digits = message.lower().partition("[errno ")[2].partition("]")[0]
    return int(digits) if digits.isdigit() else None


def write_text(path: Path, text: str) -> None:
    """Write a text file as UTF-8, whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file whole or not at all.

    The content goes to a new file in the same folder, and to the disk. Then the new file is renamed to ``path``. A
    symbolic link at ``path`` is replaced, not followed.
    """
    with replacing(path) as beside, beside.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield the path of a new file in the same folder, which is renamed to ``path`` if the block ends without an error.

    The block must write the new file, to the disk. After an error, Ctrl-C included, the new file is removed.
    """
    beside = path.with_name(path.name + ".new")
    with writing(path):
        try:
            beside.unlink(missing_ok=True)
            yield beside
            beside.replace(path)
        except BaseException:
            with contextlib.suppress(OSError):
                beside.unlink()
            raise


def remove(path: Path) -> None:
    """Remove a file, link or folder, if it exists."""
    with writing(path):
        if path.is_dir() and not path.is_symlink():
            try:
                shutil.rmtree(path)
            except OSError as error:  # its filename is only the last part of the path
                last = Path(error.filename).name if isinstance(error.filename, str) else path.name
                named = path if last == path.name else f"{path} (its {last})"
                raise OSError(error.errno, error.strerror, str(named)) from error
        else:
            path.unlink(missing_ok=True)


def flush_to_disk(folder: Path) -> None:
    """Write a finished folder, with all its files, to the disk, before a rename marks it as complete."""
    with writing(folder):
        for parent, _, names in os.walk(folder, topdown=False):
            for name in names:
                _sync(os.path.join(parent, name))
            flush_names(Path(parent))


def flush_file(path: Path) -> None:
    """Write a finished file to the disk, before a rename puts it in its place."""
    with writing(path):
        _sync(path)


def flush_names(folder: Path) -> None:
    """Write a folder's list of names to the disk, which is necessary after a rename.

    Some network disks refuse this, because their server does it.
    """
    with contextlib.suppress(OSError):
        _sync(folder)


def _sync(path: str | Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def read_regular(path: Path, most: int) -> bytes:
    """Return the content of a regular file, cut off after ``most`` + 1 bytes.

    The caller refuses a file with more than ``most`` bytes.

    Raises
    ------
    OSError
        The file cannot be read, or it is no regular file. (Reading a FIFO may never return; a device may have no end.)
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "is no regular file", str(path))
        return file.read(most + 1)


def read_json(path: Path) -> object:
    """Return the content of a JSON file of a run folder.

    Raises
    ------
    OSError
        As in :func:`read_regular`.
    ValueError
        The content is no JSON, is too long, or is nested too deeply.
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
    """Make a temporary folder, yield its path, and remove the folder at the end."""
    try:
        temporary = tempfile.TemporaryDirectory(prefix="poolcal-")
    except OSError as error:
        raise ArtefactError(
            f"no temporary folder can be made ({error.strerror or error}); name one that can be written, with room: "
            "TMPDIR=/some/folder poolcal ..."
        ) from error
    with temporary as name:
        yield Path(name)


def sha256(path: Path) -> str:
    """Return the SHA-256 digest (hex) of a file's content. A file that cannot be read raises ArtefactError."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ArtefactError(f"{path}: cannot be read ({error.strerror}); correct this and run again") from error


