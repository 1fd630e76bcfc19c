"""The YAML files of a pool and of a session, read whole."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.target_mesh import with_mesh
from pipeline.config.yaml_models import parse, read_yaml
from pipeline.errors import ConfigError


def load_pool(path: Path) -> PoolConfig:
    """The pool's config, checked."""
    content = read_yaml(path)
    if "target" not in content and {"ins", "laser"} & content.keys():
        raise ConfigError(f"{path}: is a session's file; --config wants the pool's, which says where the target is")
    return parse(PoolConfig, with_mesh(content, path), str(path))


def load_session(
    folder: Path, with_cast: Callable[[dict[str, Any], Path], dict[str, Any]] | None = None
) -> SessionConfig:
    """The session's config, checked. ``with_cast``: puts a cast in the place of its file's name (readers/casts.py,
    which the simulator must not come to through here); a session that names one cannot be loaded without."""
    if not folder.is_dir():
        raise ConfigError(f"{folder}: is no folder; SESSION is the folder that holds session.yaml")
    from pipeline.config.instruments import applied  # here: it is made of the models above

    path = folder / "session.yaml"
    content, own = applied(read_yaml(path), folder)
    content = content if with_cast is None else with_cast(content, folder)
    ins = content.get("ins")
    if isinstance(ins, dict) and "drift" in ins and "ins.drift" not in own:  # a preset's: what files tell goes first
        content = content | {"ins": {"drift_from": "files"} | ins}
    return parse(SessionConfig, {"name": folder.resolve().name[:300] or "session"} | content, str(path))
