"""Files that a command is told to write: none of them may replace anything of a run."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from pipeline.atomic_files import writing
from pipeline.errors import ArtefactError, ConfigError


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
