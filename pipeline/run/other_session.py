"""Refuse a run folder with the run of another session, so that it is not replaced by mistake.

Two runs are of the same session if they have at least one file of the calibrated sensor in common, by content.
Therefore a session may be moved or renamed, its session.yaml corrected, and files added or removed. A common file of
the INS proves nothing, because one log may cover several sessions. If no file is in common (all were exported again), a
session with the same folder and the same name is taken for the same one.
"""

import os
from collections.abc import Sequence
from pathlib import Path

from pipeline.artefacts.catalogue.results import CALIBRATION_JSON
from pipeline.atomic_files import read_json
from pipeline.config.yaml_file import read_yaml
from pipeline.errors import ArtefactError, ConfigError
from pipeline.run import manifest
from pipeline.run.freshness import EMPTY, Run, raw_of
from pipeline.run.settings import RUN_YAML


def refuse_other_session(this: Run, stages: Sequence[str]) -> None:
    """Raise an ArtefactError if the results in the run folder are of another session than ``this`` run."""
    session = this.settings.session
    recorded = _digests_in(this.path, stages)
    sensor = session.calibrated
    if not recorded or recorded & set(raw_of(this, sensor).values()):
        return
    name, folder = _recorded_session(this.path)
    if name == session.name and folder is not None and Path(os.path.realpath(folder)) == this.settings.session_folder:
        return
    noun, command = {"mbes": ("sonar", "run"), "laser": ("laser", "laser")}[sensor]
    recorded_session = f"{name!r} in {folder}" if folder is not None else f"which its {RUN_YAML} does not tell"
    raise ArtefactError(
        f"{this.path}: holds the run of another session, {recorded_session}: no {noun} file of {session.name!r} in "
        f"{this.settings.session_folder} is in it; name another run folder, or replace that run by "
        f"poolcal {command} --overwrite"
    )


def _digests_in(run: Path, stages: Sequence[str]) -> set[str]:
    """Return the digests of the raw files from which the results in a run folder were made."""
    manifests = [manifest.read_manifest(run / stage) for stage in stages]
    digests = {digest for old in manifests if old is not None for digest in old.key.raw.values()}
    if not digests:  # for example, another version of the program wrote the manifests
        try:
            content = read_json(run / "report" / CALIBRATION_JSON.name)
        except (OSError, ValueError):
            return set()
        inputs = content.get("inputs") if isinstance(content, dict) else None
        digests = {str(digest) for digest in inputs.values()} if isinstance(inputs, dict) else set()
    return digests - {EMPTY}


def _recorded_session(run: Path) -> tuple[str, Path | None]:
    """Return name and folder of the session in run.yaml; the folder is None if it cannot be read."""
    try:
        content = read_yaml(run / RUN_YAML)
    except ConfigError:
        return "", None
    session, folder = content.get("session"), content.get("session_folder")
    name = session.get("name") if isinstance(session, dict) else None
    return str(name or ""), Path(folder) if isinstance(folder, str) else None
