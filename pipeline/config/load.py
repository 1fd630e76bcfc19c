"""Reading of the YAML files of a pool and of a session, together with the files that they name."""

import os
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipeline.config.fill_in import read_filled, refuse_unfilled
from pipeline.config.instruments import dotted_keys, merge_presets
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.target_mesh import with_mesh
from pipeline.config.yaml_file import SESSION_YAML, content_of, text_of
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError


def load_pool(path: Path) -> PoolConfig:
    """Return the pool's config, checked."""
    text = text_of(path)
    content = content_of(text, path)
    if "target" not in content and {"ins", "laser"} & content.keys():
        raise ConfigError(f"{path}: is a session's file; --config wants the pool's, which says where the target is")
    refuse_unfilled({path: text})
    return parse(PoolConfig, with_mesh(content, path), str(path))


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


def load_session(
    folder: Path, with_cast: Callable[[dict[str, Any], Path], dict[str, Any]] | None = None
) -> SessionConfig:
    """Return the session's config, checked.

    Parameters
    ----------
    folder : Path
        The session folder.
    with_cast : Callable, optional
        Function that replaces the name of a cast's file by the cast, in the content of session.yaml. It stands in
        readers/casts.py, which no module of config may import. A session that names such a file cannot be loaded
        without it.

    Raises
    ------
    ConfigError
        session.yaml, or a preset that it names, has a fault. The message is one line.
    """
    path = session_yaml(folder)
    content, own_keys = merge_presets(read_filled(path), folder)
    content = content if with_cast is None else with_cast(content, folder)
    ins = content.get("ins")
    if isinstance(ins, dict) and "drift" in ins and "ins.drift" not in own_keys:
        # The drift comes from a preset: sigmas in the INS files take precedence over it.
        content = content | {"ins": {"drift_from": "files"} | ins}
    return parse(SessionConfig, {"name": folder.resolve().name[:300] or "session"} | content, str(path))


def stated_keys(path: Path) -> tuple[str, ...]:
    """Return the dotted keys to which a YAML file itself gives a value (``ins.drift.heading_deg``), in its order.

    A block's own key is none of them, nor are keys below ``about``, from which nothing is computed.
    """
    keys = list(dotted_keys(content_of(text_of(path), path)))
    blocks = {key.rpartition(".")[0] for key in keys}
    return tuple(key for key in keys if key not in blocks and key.partition(".")[0] != "about")
