"""Files that a command writes to paths from its options. None may replace a file of a run or of a session."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from pipeline.atomic_files import writing
from pipeline.errors import ArtefactError, ConfigError

HEAD_BYTES = 65_536


@contextlib.contextmanager
def as_written(run: Path) -> Iterator[None]:
    """Turn an error in reading values of calibration.json into an ArtefactError: somebody has changed the file."""
    try:
        yield
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, AttributeError) as error:
        raise ArtefactError(f"{run}: its calibration.json is not as poolcal writes it; run it again") from error


def refuse_output(
    option: str, file: Path | None, *runs: Path, begins: bytes = b"", suffix: str | None = None, holds: bytes = b""
) -> None:
    """Raise a ConfigError if a command must not write ``file``.

    Parameters
    ----------
    option
        The option with the path, for example ``--html``.
    file
        The path of the file; None: no file is written.
    runs
        Folders with a run's results or a session's files. The file must not lie in them.
    begins
        An existing file is replaced only if it begins with these bytes, as files that poolcal writes do.
    suffix
        The suffix that the file must have; None: that of the option's name, such as ``.html``.
    holds
        An existing file is replaced only if these bytes stand in its first HEAD_BYTES.
    """
    if file is None:
        return
    suffix = suffix or option.replace("--", ".")
    if file.suffix != suffix:
        raise ConfigError(f"{option} {file}: name a file that ends in {suffix}")
    with writing(file):
        if not file.parent.is_dir():
            raise ConfigError(f"{option} {file}: there is no folder {file.parent}; make it, or name another file")
        if os.path.lexists(file) and not file.is_file():
            raise ConfigError(f"{option} {file}: is no file; name another")
        for run_folder in runs:
            if Path(os.path.realpath(file)).is_relative_to(os.path.realpath(run_folder)):
                raise ConfigError(f"{option} {file}: lies in the folder {run_folder}; name a file elsewhere")
        if (begins or holds) and file.is_file():
            with file.open("rb") as there:
                head = there.read(HEAD_BYTES)
            if not head.startswith(begins) or holds not in head:
                raise ConfigError(f"{option} {file}: is there, and poolcal did not write it; name another file")
