"""Settings of a run. They are read from YAML, kept in run.yaml, and refused if they cannot be correct."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from pipeline.atomic_files import write_text
from pipeline.config.about import About
from pipeline.config.fill_in import refuse_unfilled
from pipeline.config.found import Found
from pipeline.config.heads import HEADS, heads_apart
from pipeline.config.load import pool_in, session_in, session_yaml, stated_keys
from pipeline.config.pool import PoolConfig
from pipeline.config.session import Calibrated, Mbes, SessionConfig
from pipeline.config.stage_settings import settings_by_name
from pipeline.config.target import Target
from pipeline.config.verdict import VerdictLimits
from pipeline.config.yaml_file import SESSION_YAML, YamlFile, content_of, read_yaml, text_of
from pipeline.config.yaml_models import parse
from pipeline.errors import ArtefactError, ConfigError
from pipeline.limits.verdict_limits import limits_of
from pipeline.readers.casts import with_cast
from pipeline.target.design import target_of

RUN_YAML = "run.yaml"


@dataclass(frozen=True)
class Settings:
    """The checked settings of a run, of the pool and of the session, and the folder with the raw files.

    ``files``: SHA-256 of the files that they were read from, by ``session`` and ``config``; ``stated``: the keys to
    which these files themselves give a value, by the same names. An older run.yaml has neither.
    """

    session_folder: Path
    pool: PoolConfig
    session: SessionConfig
    files: Mapping[str, str] = field(default_factory=dict)
    stated: Mapping[str, Sequence[str]] = field(default_factory=dict)

    @property
    def limits(self) -> VerdictLimits:
        """The limits of the verdict on the calibrated sensor."""
        return limits_of(self.pool.verdict, self.session.calibrated)

    def resolved(self) -> dict[str, Any]:
        """Return every setting by the name under which a stage's Config asks for it."""
        return settings_by_name(self.pool, self.session)

    def is_about_changed(self) -> bool:
        """Return whether ``about`` in session.yaml is another than the run's; False if there is no such file now.

        A file with a fault has been edited since, and may hold names that the run does not have.
        """
        path = self.session_folder / SESSION_YAML
        try:
            text = text_of(path)
        except ConfigError:
            return False
        try:
            block = content_of(text, path).get("about") or {}
            return not isinstance(block, dict) or parse(About, block, str(path)) != self.session.about
        except ConfigError:
            return True

    def of_head(self, head: str) -> "Settings":
        """Return the settings of a run as if the session had this head of the sonar alone."""
        return replace(self, session=self.session.alone(head))

    def as_json(self) -> dict[str, Any]:
        """Return the settings as plain values, defaults filled in."""
        return {**self.pool.model_dump(mode="json"), **self.session.model_dump(mode="json")}


def load_settings(
    session_folder: Path,
    config_path: Path,
    calibrated: Calibrated | None = "mbes",
    find: Callable[[SessionConfig, Found], Mapping[str, Any]] | None = None,
    several_heads: bool = False,
) -> Settings:
    """Read and check both YAML files, each of them once: a file that is changed meanwhile gives no mixture.

    Parameters
    ----------
    session_folder
        The folder with session.yaml.
    config_path
        The pool's YAML file.
    calibrated
        "mbes": the sonar. "laser": the laser; a sonar in the session is ignored. None: the sonar if the session has
        one, otherwise the laser.
    find
        Function that finds a target of the kind "found" in the session's files; None: such a target is refused.
    several_heads
        False: refuse a session with several heads of the sonar.
    """
    config = YamlFile.read(config_path)
    files = {"session": YamlFile.read(session_yaml(session_folder)), "config": config}
    refuse_unfilled(files.values())
    session = session_in(files["session"], with_cast, several_heads or calibrated == "laser")
    if (calibrated or session.calibrated) == "laser":
        refuse_found_target(config)
    pool = pool_in(config, None if find is None else partial(find, session))
    try:
        target_of(pool.target)
    except ConfigError as error:
        raise ConfigError(f"{config_path}: {error}") from error
    refuse_unknown_faces(pool, config_path)
    if calibrated == "laser":
        session = session.model_copy(update=dict.fromkeys(HEADS))
    elif calibrated == "mbes" and session.calibrated == "laser":
        where = session_folder / SESSION_YAML
        raise ConfigError(f"{where}: mbes: is missing; add it (poolcal laser calibrates the laser without a sonar)")
    if session.mbes is not None:
        refuse_shallow_cast(pool.target, session.mbes, session_folder / SESSION_YAML)
    digests = {name: file.sha256 for name, file in files.items()}
    stated = {
        "session": stated_keys(heads_apart(files["session"].content, SESSION_YAML)),
        "config": stated_keys(config.content),
    }
    return Settings(session_folder.resolve(), pool, session, digests, stated)


def refuse_found_target(config: YamlFile) -> None:
    """Raise a ConfigError if a pool's file has a target that was found by a laser, or is to be found."""
    target = config.content.get("target")
    if isinstance(target, dict) and (target.get("kind") == "found" or target.get("found")):
        raise ConfigError(
            f"{config.path}: target: faces that were found lie where a laser saw them, so they cannot tell how a laser "
            "is mounted; give faces that were surveyed"
        )


def refuse_unknown_faces(pool: PoolConfig, path: Path) -> None:
    """Raise a ConfigError if ``as_built.faces`` has a face that the target has not; ``path``: the pool's file."""
    names = [face.name for face in target_of(pool.target).faces]
    for name in pool.as_built.faces:
        if name not in names:
            known = ", ".join(names)
            raise ConfigError(f"{path}: as_built.faces: {name!r}: no face of this target; its faces are {known}")


def refuse_shallow_cast(target: Target, mbes: Mbes, path: Path) -> None:
    """Raise a ConfigError if a cast covers less than half the depths from 0 to the target's lower end.

    Parameters
    ----------
    target
        The target.
    mbes
        The sonar's settings, with the cast.
    path
        The path of session.yaml, for the message.
    """
    if mbes.svp is None:
        return
    depth = target_of(target).depth_m
    first, last = mbes.svp[0][0], mbes.svp[-1][0]
    if min(last, depth) - first < depth / 2:
        raise ConfigError(
            f"{path}: mbes.svp: reaches from {first:g} to {last:g} m, the target down to {depth:g} m: less than half "
            "of that; give a cast of the whole depth"
        )


def refuse_shared_folder(run: Path, session_folder: Path) -> None:
    """Raise a ConfigError if one of the two folders lies in the other, or if a name is not UTF-8.

    A run folder must hold no other files, because poolcal replaces and removes folders in it.
    """
    for path in (run, session_folder):
        try:
            str(path).encode()
        except UnicodeEncodeError as error:
            raise ConfigError(f"{str(path)!r}: the name is no UTF-8 text; rename the folder") from error
    inner, outer = (Path(os.path.realpath(path)) for path in (run, session_folder))  # a link to itself, too
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise ConfigError(f"--run {run}: lies in the session folder {session_folder}, or round it; name a folder apart")


def holds_run(run: Path) -> bool:
    """Return whether ``run`` is a run folder: run.yaml is in it."""
    return os.path.isfile(run / RUN_YAML)  # a folder that is closed to us is none


def refuse_other_sensor(run: Path, calibrated: Calibrated) -> None:
    """Refuse a run folder with a calibration of the other sensor. A run.yaml that cannot be read is not refused."""
    try:
        session = read_yaml(run / RUN_YAML)["session"] if holds_run(run) else None
    except (ConfigError, KeyError):
        return
    if not isinstance(session, dict):
        return
    was = "laser" if session.get("mbes") is None else "mbes"
    if was != calibrated:
        noun = {"mbes": "the sonar", "laser": "the laser"}[was]
        raise ArtefactError(f"{run}: holds a calibration of {noun}; name another run folder")


def write_settings(run: Path, settings: Settings) -> None:
    """Write run.yaml."""
    content = {
        "session_folder": str(settings.session_folder),
        "files": dict(settings.files),
        "stated": {name: list(keys) for name, keys in settings.stated.items()},
        "config": settings.pool.model_dump(mode="json"),
        "session": settings.session.model_dump(mode="json"),
    }
    head = "# Written by poolcal: the config and the session of this run, as used, defaults filled in.\n"
    write_text(run / RUN_YAML, head + yaml.safe_dump(content, sort_keys=False, width=120))


def read_settings(run: Path) -> Settings:
    """Return the settings in run.yaml, with which the run in this folder was made."""
    path = run / RUN_YAML
    if not holds_run(run):
        raise ArtefactError(f"{run}: holds no {RUN_YAML}, so it is no run folder; name one of poolcal run's")
    content = read_yaml(path)
    folder, files, stated = content.get("session_folder"), content.get("files", {}), content.get("stated", {})
    known = {"session_folder", "files", "stated", "config", "session"}
    if {*content, "files", "stated"} != known or not isinstance(folder, str):
        raise ConfigError(f"{path}: must hold session_folder, config and session; run poolcal run again")
    if not isinstance(files, dict) or not all(isinstance(digest, str) for digest in files.values()):
        raise ConfigError(f"{path}: files: must hold digests of files; run poolcal run again")
    if not isinstance(stated, dict) or not all(isinstance(keys, list) for keys in stated.values()):
        raise ConfigError(f"{path}: stated: must hold lists of keys; run poolcal run again")
    pool = parse(PoolConfig, content["config"], f"{path}: config")
    session = parse(SessionConfig, content["session"], f"{path}: session")
    return Settings(Path(folder), pool, session, files, stated)


def calibrated_in(run: Path) -> Calibrated:
    """Return the sensor that the run in this folder calibrates."""
    return read_settings(run).session.calibrated
