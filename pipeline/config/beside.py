"""Files that a config names: they stand beside it, or in a folder beside it."""

from pathlib import Path

from pipeline.atomic_files import read_regular
from pipeline.errors import ConfigError

SHOWN = 100  # letters of a name that a message repeats


def content_beside(path: Path, name: str, where: str, most: int) -> bytes:
    """Return the content of the file that the config at ``path`` names; ``where``: its key, for messages.

    Raises
    ------
    ConfigError
        The name leads elsewhere, also by a symbolic link; the file cannot be read, or has more than ``most`` bytes.
    """
    where = f"{path}: {where} = {name[:SHOWN]!r}"
    if not name or Path(name).is_absolute() or ".." in Path(name).parts or set(name) & {"\\", "\0"}:
        raise ConfigError(f"{where}: must name a file beside this one, or in a folder beside it")
    try:
        if not (path.parent / name).resolve().is_relative_to(path.parent.resolve()):
            raise ConfigError(f"{where}: leads out of this file's folder; copy the file itself there")
        content = read_regular(path.parent / name, most)
    except (OSError, RuntimeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "links in a circle"
        raise ConfigError(f"{where}: cannot be read ({reason}); check the path") from error
    if len(content) > most:
        raise ConfigError(f"{where}: more than {most:,} bytes; give what is needed here alone")
    return content
