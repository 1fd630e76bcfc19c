"""Whether a run folder holds another session's run, which nobody means to replace.

What makes a session the same is one file in common of what is calibrated: a sonar's file, or, where the laser is
calibrated, a laser's, by content. So it may be moved, renamed, corrected in session.yaml, and have more files or fewer.
An INS's file in common says nothing: one log may hold several sessions. Where no file is in common (all were exported
again), a session in the same folder under the same name is taken for the same.
"""

from collections.abc import Sequence
from pathlib import Path

from pipeline.artefacts.catalogue.results import CALIBRATION_JSON
from pipeline.atomic_files import read_json
from pipeline.config.yaml_file import read_yaml
from pipeline.errors import ArtefactError, ConfigError
from pipeline.run import manifest
from pipeline.run.freshness import EMPTY, Run, raw_of
from pipeline.run.settings import RUN_YAML


def refuse_another(this: Run, stages: Sequence[str]) -> None:
    """One line, where the run folder's results are of another session than ``this`` run's."""
    session = this.settings.session
    there = _digests_in(this.path, stages)
    sensor = session.calibrated
    if not there or there & set(raw_of(this, sensor).values()):
        return
    name, folder = _recorded(this.path)
    if name == session.name and folder is not None and folder.resolve() == this.settings.session_folder:
        return
    what, command = {"mbes": ("sonar", "run"), "laser": ("laser", "laser")}[sensor]
    of = f"{name!r} in {folder}" if folder is not None else f"which its {RUN_YAML} does not tell"
    raise ArtefactError(
        f"{this.path}: holds the run of another session, {of}: no {what} file of {session.name!r} in "
        f"{this.settings.session_folder} is in it; name another run folder, or replace that run by "
        f"poolcal {command} --overwrite"
    )


def _digests_in(run: Path, stages: Sequence[str]) -> set[str]:
    """Digests of the raw files that the results in a run folder were made from."""
    found = {digest for stage in stages if (one := manifest.read(run / stage)) for digest in one.key.raw.values()}
    if not found:  # manifests of another version of the program, say
        try:
            content = read_json(run / "report" / CALIBRATION_JSON.name)
        except (OSError, ValueError):
            return set()
        inputs = content.get("inputs") if isinstance(content, dict) else None
        found = {str(digest) for digest in inputs.values()} if isinstance(inputs, dict) else set()
    return found - {EMPTY}


def _recorded(run: Path) -> tuple[str, Path | None]:
    """Name and folder of the session in run.yaml, as far as they can be read."""
    try:
        content = read_yaml(run / RUN_YAML)
    except ConfigError:
        return "", None
    session, folder = content.get("session"), content.get("session_folder")
    name = session.get("name") if isinstance(session, dict) else None
    return str(name), Path(folder) if isinstance(folder, str) else None
