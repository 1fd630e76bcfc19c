"""The log of a session: all that its last calibration has said, in a file beside its run folder."""

from pathlib import Path

from pipeline.atomic_files import read_regular, write_text, writing
from pipeline.console import printable
from pipeline.errors import ArtefactError, PoolcalError

HEAD = "poolcal repeat: "  # a file without it is somebody else's, and is not replaced


def log_of(run: Path) -> Path:
    """Return the path of a run folder's log. It is not in the folder, which holds nothing but results."""
    return run.with_name(run.name + ".repeat.log")


def write_log(run: Path, label: str, said: str) -> str:
    """Write the log of a session, whole or not at all.

    Parameters
    ----------
    run
        The run folder.
    label
        The session's name.
    said
        What its process has written.

    Returns
    -------
    str
        The reason if the log could not be written, else an empty text: the calibration does not depend on it.
    """
    path = log_of(run)
    lines = (printable(line) for line in said.split("\n"))
    try:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.exists() and not read_regular(path, len(HEAD)).startswith(HEAD.encode()):
                raise ArtefactError(f"{path}: is there, and poolcal did not write it; move it")
        write_text(path, f"{HEAD}{label}\n" + "\n".join(lines))
    except PoolcalError as error:
        return str(error)
    return ""
