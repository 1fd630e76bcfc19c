"""Settings of a run: read from YAML, kept in run.yaml, refused where they cannot be meant."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from pipeline.atomic_files import write_text
from pipeline.config.load import load_pool, load_session
from pipeline.config.pool import PoolConfig
from pipeline.config.session import Calibrated, Mbes, SessionConfig
from pipeline.config.stage_settings import settings_by_name
from pipeline.config.target import Target
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ArtefactError, ConfigError
from pipeline.readers.casts import with_cast
from pipeline.target.design import target_of

RUN_YAML = "run.yaml"


@dataclass(frozen=True)
class Settings:
    """What a run is made from: the settings of the pool and of the session, checked, and where the raw files are."""

    session_folder: Path
    pool: PoolConfig
    session: SessionConfig

    def resolved(self) -> dict[str, Any]:
        """Return every setting by the name under which a stage's Config asks for it."""
        return settings_by_name(self.pool, self.session)

    def as_json(self) -> dict[str, Any]:
        """Return the settings as plain values, defaults filled in."""
        return {**self.pool.model_dump(mode="json"), **self.session.model_dump(mode="json")}


def load_settings(session_folder: Path, config_path: Path, calibrated: Calibrated | None = "mbes") -> Settings:
    """Read and check both YAML files.

    Parameters
    ----------
    session_folder
        The folder with session.yaml.
    config_path
        The pool's YAML file.
    calibrated
        "mbes" for the sonar; "laser" for the laser itself, which leaves the sonar out; None for either, as the session
        has it.
    """
    pool = load_pool(config_path)
    try:
        target_of(pool.target)
    except ConfigError as error:
        raise ConfigError(f"{config_path}: {error}") from error
    refuse_unknown_faces(pool, config_path)
    session = load_session(session_folder, with_cast)
    if calibrated == "laser":
        session = session.model_copy(update={"mbes": None})
    elif calibrated == "mbes" and session.calibrated == "laser":
        where = session_folder / "session.yaml"
        raise ConfigError(f"{where}: mbes: is missing; add it (poolcal laser calibrates the laser without a sonar)")
    if session.mbes is not None:
        refuse_shallow_cast(pool.target, session.mbes, session_folder / "session.yaml")
    return Settings(session_folder.resolve(), pool, session)


def refuse_unknown_faces(pool: PoolConfig, path: Path) -> None:
    """Refuse faces as built that the target does not have; ``path`` names the pool's file."""
    names = [face.name for face in target_of(pool.target).faces]
    for name in pool.as_built.faces:
        if name not in names:
            known = ", ".join(names)
            raise ConfigError(f"{path}: as_built.faces: {name!r}: no face of this target; its faces are {known}")


def refuse_shallow_cast(target: Target, mbes: Mbes, path: Path) -> None:
    """Refuse a cast that is not of the water through which the rays go: of less than half the depth of the target.

    Parameters
    ----------
    target
        The target; its lower end is the depth.
    mbes
        The sonar's settings, with the cast.
    path
        session.yaml, for the message.
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
    """Refuse a run folder in or round the session's, for it is swapped and cleared, and names that are no text."""
    for path in (run, session_folder):
        try:
            str(path).encode()
        except UnicodeEncodeError as error:
            raise ConfigError(f"{str(path)!r}: the name is no UTF-8 text; rename the folder") from error
    inner, outer = run.resolve(), session_folder.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise ConfigError(f"--run {run}: lies in the session folder {session_folder}, or round it; name a folder apart")


def holds_run(run: Path) -> bool:
    """Return whether it is a run folder."""
    return (run / RUN_YAML).is_file()


def refuse_other_sensor(run: Path, calibrated: Calibrated) -> None:
    """Refuse a run folder with a calibration of the other sensor; settings of an older program need not be readable."""
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
        "config": settings.pool.model_dump(mode="json"),
        "session": settings.session.model_dump(mode="json"),
    }
    head = "# Written by poolcal: the config and the session of this run, as used, defaults filled in.\n"
    write_text(run / RUN_YAML, head + yaml.safe_dump(content, sort_keys=False, width=120))


def read_settings(run: Path) -> Settings:
    """Read run.yaml: what the run in this folder was made from."""
    path = run / RUN_YAML
    if not path.is_file():
        raise ArtefactError(f"{run}: holds no {RUN_YAML}, so it is no run folder; name one of poolcal run's")
    content = read_yaml(path)
    folder = content.get("session_folder")
    if set(content) != {"session_folder", "config", "session"} or not isinstance(folder, str):
        raise ConfigError(f"{path}: must hold session_folder, config and session; run poolcal run again")
    pool = parse(PoolConfig, content["config"], f"{path}: config")
    return Settings(Path(folder), pool, parse(SessionConfig, content["session"], f"{path}: session"))


def calibrated_in(run: Path) -> Calibrated:
    """Return the sensor that the run in this folder calibrates."""
    return read_settings(run).session.calibrated
