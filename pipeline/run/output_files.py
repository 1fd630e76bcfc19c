"""Files that a command writes where its options say: none of them may replace anything of a run."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from pipeline.atomic_files import writing
from pipeline.errors import ArtefactError, ConfigError


@contextlib.contextmanager
def as_written(run: Path) -> Iterator[None]:
    """Turn an error in values of a run's calibration.json, which somebody changed then, into an ArtefactError."""
    try:
        yield
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, AttributeError) as error:
        raise ArtefactError(f"{run}: its calibration.json is not as poolcal writes it; run it again") from error


def refuse_output(option: str, file: Path | None, *runs: Path, begins: bytes = b"") -> None:
    """Refuse a file that must not be written; None is none.

    Parameters
    ----------
    option
        The option that names it, such as ``--html``: the file's name ends so.
    file
        The file.
    runs
        Folders with a run's results or a session's files, in which it must not lie.
    begins
        Only a file that begins so is replaced: what we wrote, and never a plan or a config.
    """
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
