"""A run folder: locked while in use, every stage swapped in whole, what it was made from in run.yaml."""

import contextlib
import errno
import fcntl
import os
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import yaml
from pydantic import BaseModel

from pipeline.atomic_files import read_json, remove, settle, settle_names, write_text, writing
from pipeline.config.pool import PoolConfig, load_pool, load_session
from pipeline.config.session import Calibrated, Mbes, SessionConfig
from pipeline.config.target import Target
from pipeline.config.yaml_models import parse, read_yaml
from pipeline.errors import ArtefactError, ConfigError
from pipeline.mount import target_of
from pipeline.readers.casts import with_cast
from pipeline.run import manifest

RUN_YAML = "run.yaml"
LOCK = ".lock"
DIGESTS = "digests.json"


@dataclass(frozen=True)
class Settings:
    """What a run is made from: both configs, checked, and where the raw files are."""

    session_folder: Path
    pool: PoolConfig
    session: SessionConfig

    def resolved(self) -> dict[str, Any]:
        """Every setting by the name under which a stage's Config asks for it."""
        blocks = (self.pool, self.session)
        found = {name: getattr(block, name) for block in blocks for name in type(block).model_fields}
        return found | {"target_place": self.pool.target_place, "recordings": self.session.recordings}

    def resolved_plainly(self) -> dict[str, Any]:
        """The same as plain values."""
        return {
            name: value.model_dump(mode="json") if isinstance(value, BaseModel) else value
            for name, value in self.resolved().items()
        }

    def as_json(self) -> dict[str, Any]:
        """The same as plain values, defaults filled in."""
        return {**self.pool.model_dump(mode="json"), **self.session.model_dump(mode="json")}


def load_settings(
    session_folder: Path, config_path: Path, calibrated: Calibrated | None = "mbes"
) -> Settings:
    """Both YAML files, read and checked, for calibrating the sonar, or the laser by itself: of a session with both the
    sonar is left out then. None: whatever the session can."""
    pool = load_pool(config_path)
    try:
        target_of(pool.target)
    except ConfigError as error:
        raise ConfigError(f"{config_path}: {error}") from error
    refuse_faces(pool, config_path)
    session = load_session(session_folder, with_cast)
    if calibrated == "laser":
        session = session.model_copy(update={"mbes": None})
    elif calibrated == "mbes" and session.mbes is None:
        where = session_folder / "session.yaml"
        raise ConfigError(f"{where}: mbes: is missing; add it (poolcal laser calibrates the laser without a sonar)")
    if session.mbes is not None:
        refuse_cast(pool.target, session.mbes, session_folder / "session.yaml")
    return Settings(session_folder.resolve(), pool, session)


def refuse_faces(pool: PoolConfig, path: Path) -> None:
    """Faces as built are faces of the target."""
    names = [face.name for face in target_of(pool.target).faces]
    for name in pool.as_built.faces:
        if name not in names:
            known = ", ".join(names)
            raise ConfigError(f"{path}: as_built.faces: {name!r}: no face of this target; its faces are {known}")


def refuse_cast(target: Target, mbes: Mbes, path: Path) -> None:
    """A cast is of the water that the rays go through: at least of half the depth down to the target's lower end."""
    if mbes.svp is None:
        return
    depth = target_of(target).depth_m
    first, last = mbes.svp[0][0], mbes.svp[-1][0]
    if min(last, depth) - first < depth / 2:
        raise ConfigError(
            f"{path}: mbes.svp: reaches from {first:g} to {last:g} m, the target down to {depth:g} m: less than half "
            "of that; give a cast of the whole depth"
        )


def refuse_folders(run: Path, session_folder: Path) -> None:
    """Raw data and results never share a folder: a run folder is swapped and cleared. And a name must be text."""
    for path in (run, session_folder):
        try:
            str(path).encode()
        except UnicodeEncodeError as error:
            raise ConfigError(f"{str(path)!r}: the name is no UTF-8 text; rename the folder") from error
    inner, outer = run.resolve(), session_folder.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise ConfigError(f"--run {run}: lies in the session folder {session_folder}, or round it; name a folder apart")


def holds_run(run: Path) -> bool:
    """Whether it is a run folder."""
    return (run / RUN_YAML).is_file()


def refuse_other(run: Path, calibrated: Calibrated) -> None:
    """A run folder is the sonar's or the laser's, not both in turn. (Settings of an older program need not be read.)"""
    try:
        session = read_yaml(run / RUN_YAML)["session"] if holds_run(run) else None
    except (ConfigError, KeyError):
        return
    if not isinstance(session, dict):
        return
    was = "laser" if session.get("mbes") is None else "mbes"
    if was != calibrated:
        what = {"mbes": "the sonar", "laser": "the laser"}[was]
        raise ArtefactError(f"{run}: holds a calibration of {what}; name another run folder")


# --- run.yaml --------------------------------------------------------------------------------------------------------
def write_settings(run: Path, settings: Settings) -> None:
    content = {
        "session_folder": str(settings.session_folder),
        "config": settings.pool.model_dump(mode="json"),
        "session": settings.session.model_dump(mode="json"),
    }
    head = "# Written by poolcal: the config and the session of this run, as used, defaults filled in.\n"
    write_text(run / RUN_YAML, head + yaml.safe_dump(content, sort_keys=False, width=120))


def read_settings(run: Path) -> Settings:
    """What the run in this folder was made from."""
    path = run / RUN_YAML
    if not path.is_file():
        raise ArtefactError(f"{run}: holds no {RUN_YAML}, so it is no run folder; name one of poolcal run's")
    content = read_yaml(path)
    folder = content.get("session_folder")
    if set(content) != {"session_folder", "config", "session"} or not isinstance(folder, str):
        raise ConfigError(f"{path}: must hold session_folder, config and session; run poolcal run again")
    pool = parse(PoolConfig, content["config"], f"{path}: config")
    return Settings(Path(folder), pool, parse(SessionConfig, content["session"], f"{path}: session"))


# --- the lock --------------------------------------------------------------------------------------------------------
@contextlib.contextmanager
def locked(run: Path, stages: Sequence[str]) -> Iterator[None]:
    """Make ``run`` if need be, keep every other process out of it, and tidy up after a process that was killed."""
    with writing(run):
        run.mkdir(parents=True, exist_ok=True)
        strangers = sorted(entry.name for entry in run.iterdir() if entry.name not in (LOCK, DIGESTS))
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
    """Keep writers out while a run is checked. A folder that cannot be written needs no lock."""
    try:
        file = _opened(run / LOCK, os.O_RDONLY)
    except OSError:
        yield
        return
    with file:
        _lock(file, run, fcntl.LOCK_SH)
        yield


def _opened(lock: Path, how: int) -> TextIO:
    """A run folder may come from somebody else: no link is followed, and nothing but a regular file is opened."""
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
    return stage.with_name(stage.name + ".partial")


def _old(stage: Path) -> Path:
    return stage.with_name(stage.name + ".old")


def keeping(stage: Path) -> Path:
    return stage.with_name(stage.name + ".keeping")


def swap_in(stage: Path) -> None:
    """The finished partial folder takes the stage's place. Killed at any step, :func:`recover` finds a whole result;
    and so it does after a power cut, for the disk holds every file before the first rename."""
    settle(partial(stage))
    with writing(stage):
        remove(_old(stage))
        if os.path.lexists(stage):
            stage.rename(_old(stage))
        partial(stage).rename(stage)
        settle_names(stage.parent)
    remove(_old(stage))


def recover(stage: Path) -> None:
    """Bring a stage's folder into a whole state: the newest complete result stands, all else goes."""
    with writing(stage):
        if not os.path.lexists(stage):
            for candidate in (partial(stage), _old(stage)):  # between the two renames: both are complete
                if manifest.read(candidate) is not None:
                    candidate.rename(stage)
                    break
        remove(partial(stage))
        remove(keeping(stage))
        if os.path.lexists(stage):
            remove(_old(stage))


def touch(stage: Path) -> None:
    """Tell make that a result was looked at and found current."""
    with writing(stage / manifest.NAME):
        (stage / manifest.NAME).touch()


def calibration(run: Path) -> dict[str, Any]:
    """RUN/report/calibration.json."""
    path = run / "report" / "calibration.json"
    if run.is_file():
        raise ConfigError(f"{run}: is a file; RUN is a run folder, and stands first")
    try:
        content = read_json(path)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise ArtefactError(f"{path}: cannot be read ({reason}); run poolcal run again") from error
    if not isinstance(content, dict) or content.get("verdict") not in ("accepted", "rejected"):
        raise ArtefactError(f"{path}: holds no verdict; run poolcal run again")
    return content


@contextlib.contextmanager
def as_written(run: Path) -> Iterator[None]:
    """Where values are taken out of a run's calibration.json: one that somebody changed is an ArtefactError."""
    try:
        yield
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, AttributeError) as error:
        raise ArtefactError(f"{run}: its calibration.json is not as poolcal writes it; run it again") from error


def refuse_output(option: str, file: Path | None, *runs: Path, begins: bytes = b"") -> None:
    """A file of its kind, never among a run's results or a session's files (``runs``). One that is there is replaced if
    it ``begins`` as we write it: a plan or a config never."""
    if file is None:
        return
    suffix = option.replace("--", ".")
    if file.suffix != suffix:
        raise ConfigError(f"{option} {file}: name a file that ends in {suffix}")
    if file.exists() and not file.is_file():
        raise ConfigError(f"{option} {file}: is no file; name another")
    for run_folder in runs:
        if file.resolve().is_relative_to(run_folder.resolve()):
            raise ConfigError(f"{option} {file}: lies in the folder {run_folder}; name a file elsewhere")
    if begins and file.is_file():
        with writing(file), file.open("rb") as there:
            if there.read(len(begins)) != begins:
                raise ConfigError(f"{option} {file}: is there, and poolcal did not write it; name another file")
