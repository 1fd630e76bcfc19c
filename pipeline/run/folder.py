"""A run folder. It is locked while it is in use, and a stage's new folder replaces the old one as a whole."""

import contextlib
import errno
import fcntl
import os
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

from pipeline.atomic_files import flush_names, flush_to_disk, remove, writing
from pipeline.errors import ArtefactError
from pipeline.run import manifest
from pipeline.run.settings import RUN_YAML

LOCK = ".lock"
DIGESTS = "digests.json"
FOUND = "found.json"


# --- the lock --------------------------------------------------------------------------------------------------------
@contextlib.contextmanager
def locked(run: Path, stages: Sequence[str]) -> Iterator[None]:
    """Lock the folder ``run`` against other processes. The folder is made if it does not exist.

    The folders of ``stages`` are then repaired, in case an earlier process was killed.
    """
    with writing(run):
        run.mkdir(parents=True, exist_ok=True)
        strangers = sorted(entry.name for entry in run.iterdir() if entry.name not in (LOCK, DIGESTS, FOUND))
        if strangers and not (run / RUN_YAML).is_file() and strangers != [RUN_YAML + ".new"]:
            raise ArtefactError(f"{run}: holds {strangers[0]} but no {RUN_YAML}, so it is no run folder; name another")
        file = _opened(run / LOCK, os.O_RDWR | os.O_CREAT)
    with file:
        _lock(file, run, fcntl.LOCK_EX)
        with writing(run / LOCK):
            file.truncate(0)
            file.write(f"{os.getpid()}\n")
            file.flush()
        for stage in stages:
            recover(run / stage)
        yield


@contextlib.contextmanager
def reading(run: Path) -> Iterator[None]:
    """Keep writing processes out of ``run`` while it is read; no lock if the lock file is missing or not readable."""
    try:
        file = _opened(run / LOCK, os.O_RDONLY)
    except OSError:
        yield
        return
    with file:
        _lock(file, run, fcntl.LOCK_SH)
        yield


def _opened(lock: Path, how: int) -> TextIO:
    """Open the lock file. A link or irregular file is refused, because a run folder may come from somebody else."""
    handle = os.open(lock, how | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EEXIST, "is no regular file", str(lock))
    return os.fdopen(handle, "r" if how == os.O_RDONLY else "r+", encoding="utf-8")


def _lock(file: TextIO, run: Path, how: int) -> None:
    try:
        fcntl.flock(file, how | fcntl.LOCK_NB)
    except BlockingIOError as error:
        file.seek(0)
        holder = file.read(20).strip()
        by = f"process {holder}" if holder.isdigit() else "another process"
        raise ArtefactError(f"{run}: is in use by {by}; wait for it to end, or name another run folder") from error
    except OSError as error:
        raise ArtefactError(f"{run}: cannot be locked ({error.strerror}); use a run folder on a local disk") from error


# --- a stage's folder ------------------------------------------------------------------------------------------------
def partial(stage: Path) -> Path:
    """Return the folder in which a stage writes its files until all are complete."""
    return stage.with_name(stage.name + ".partial")


def _old(stage: Path) -> Path:
    return stage.with_name(stage.name + ".old")


def keeping(stage: Path) -> Path:
    """Return the folder to which an accepted result is copied before the copy gets its number."""
    return stage.with_name(stage.name + ".keeping")


def swap_in(stage: Path) -> None:
    """Put the finished partial folder in the stage's place.

    If the process is killed at any step, :func:`recover` still has a complete result. This is true after a power cut
    too, because every file is on the disk before the first rename.
    """
    flush_to_disk(partial(stage))
    with writing(stage):
        remove(_old(stage))
        if os.path.lexists(stage):
            stage.rename(_old(stage))
        partial(stage).rename(stage)
        flush_names(stage.parent)
    remove(_old(stage))


def recover(stage: Path) -> None:
    """Repair a stage's folder after a process that was killed.

    If the folder itself is missing, the partial folder takes its place, or else the old one, if complete. The other
    temporary folders are removed.
    """
    with writing(stage):
        if not os.path.lexists(stage):
            for candidate in (partial(stage), _old(stage)):  # killed between the two renames of swap_in
                if manifest.read_manifest(candidate) is not None:
                    candidate.rename(stage)
                    break
        remove(partial(stage))
        remove(keeping(stage))
        if os.path.lexists(stage):
            remove(_old(stage))


def touch(stage: Path) -> None:
    """Set the manifest's time to now, so that the program ``make`` takes the stage for current."""
    with writing(stage / manifest.NAME):
        (stage / manifest.NAME).touch()


