"""Reading of the YAML files of a pool and of a session, together with the files that they name."""

import os
import shlex
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pipeline.config.fill_in import refuse_unfilled
from pipeline.config.found import Find, with_found
from pipeline.config.heads import heads_apart, refuse_several, refuse_single_blocks
from pipeline.config.instruments import dotted_keys, merge_presets
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.target_mesh import with_mesh
from pipeline.config.water_by_time import with_readings
from pipeline.config.yaml_file import SESSION_YAML, YamlFile
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError

WithCast = Callable[[dict[str, Any], Path], dict[str, Any]]


def load_pool(path: Path) -> PoolConfig:
    """Return the pool's config, checked."""
    return pool_in(YamlFile.read(path))


def pool_in(file: YamlFile, find: Find | None = None) -> PoolConfig:
    """Return the config in a pool's file, checked; ``find``: as for :func:`with_found`."""
    if "target" not in file.content and {"ins", "laser"} & file.content.keys():
        raise ConfigError(
            f"{file.path}: is a session's file; --config wants the pool's, which says where the target is"
        )
    refuse_unfilled([file])
    content = with_readings(with_mesh(file.content, file.path), file.path)
    content = with_found(content, file.path, find)
    return parse(PoolConfig, content, str(file.path))


def session_yaml(folder: Path) -> Path:
    """Return the path of a session folder's session.yaml; raise ConfigError if there is no such folder or file."""
    if not folder.is_dir():
        raise ConfigError(f"{folder}: is no folder; SESSION is the folder that holds session.yaml")
    path = folder / SESSION_YAML
    if not os.path.lexists(path):
        raise ConfigError(
            f"{path}: there is no such file; poolcal init {shlex.quote(str(folder))} writes it from the raw files"
        )
    return path


def load_session(folder: Path, with_cast: WithCast | None = None) -> SessionConfig:
    """Return the session's config, checked; as :func:`session_in`, from the session folder."""
    return session_in(YamlFile.read(session_yaml(folder)), with_cast)


def session_in(file: YamlFile, with_cast: WithCast | None = None, several_heads: bool = False) -> SessionConfig:
    """Return the config in session.yaml, checked.

    Parameters
    ----------
    file : YamlFile
        session.yaml in its session folder.
    with_cast : Callable, optional
        Function that replaces the name of a cast's file by the cast, in the content of session.yaml. It stands in
        readers/casts.py, which no module of config may import. A session that names such a file cannot be loaded
        without it.
    several_heads : bool
        False: refuse a session with several heads of the sonar.

    Raises
    ------
    ConfigError
        session.yaml, or a preset that it names, has a fault. The message is one line.
    """
    refuse_unfilled([file])
    folder = file.path.parent
    refuse_single_blocks(file.content, str(file.path))
    own = heads_apart(file.content, str(file.path))
    if not several_heads:
        refuse_several(own, str(file.path))
    content, own_keys = merge_presets(own, folder)
    content = content if with_cast is None else with_cast(content, folder)
    ins = content.get("ins")
    if isinstance(ins, dict) and "drift" in ins and "ins.drift" not in own_keys:
        # The drift comes from a preset: sigmas in the INS files take precedence over it.
        content = content | {"ins": {"drift_from": "files"} | ins}
    return parse(SessionConfig, {"name": folder.resolve().name[:300] or "session"} | content, str(file.path))


def stated_keys(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the dotted keys that a YAML file's content states itself (``ins.drift.heading_deg``), in its order.

    A block's own key is none of them, nor are keys below ``about``, from which nothing is computed.
    """
    keys = list(dotted_keys(content))
    blocks = {key.rpartition(".")[0] for key in keys}
    return tuple(key for key in keys if key not in blocks and key.partition(".")[0] != "about")
