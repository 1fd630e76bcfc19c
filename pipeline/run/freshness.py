"""Which stages of a run folder are out of date, and why. This is decided by content, never by times."""

import dataclasses
import hashlib
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from pipeline.artefacts.schema import Artefact, Document, OfFurtherHeads, Provenance, RawFiles
from pipeline.config.heads import HEADS
from pipeline.config.stage_settings import plain_settings, stage_config
from pipeline.errors import ArtefactError, RawDataError
from pipeline.readers import dispatch
from pipeline.run import manifest, provenance
from pipeline.run.digests import Digests
from pipeline.run.progress import Progress
from pipeline.run.settings import Settings
from pipeline.run.stage_protocol import Marker, inputs_in, name_of
from pipeline.run.workers import SERIAL, Workers

SENSORS = ("ins", "laser", *HEADS)
OF_HEADS = "heads"  # folder in a run folder with the runs of the sonar's further heads
EMPTY = hashlib.sha256().hexdigest()  # the digest of every empty file; the readers report empty files


@dataclass(frozen=True)
class Run:
    """One run folder in use, with its settings, digests and workers."""

    path: Path
    settings: Settings
    digests: Digests
    stages: tuple[str, ...]  # names, in the order in which they run
    workers: Workers = SERIAL
    progress: Progress = dataclasses.field(default_factory=lambda: Progress(quiet=True))
    raw: dict[str, dict[str, str]] = dataclasses.field(default_factory=dict)  # first digests, by sensor
    heads: dict[str, "Run"] = dataclasses.field(default_factory=dict)  # the runs of the sonar's further heads, by name

    def folder(self, stage: str) -> Path:
        """Return the stage's folder."""
        return self.path / stage


def out_of_date(this: Run, stage: ModuleType) -> list[str]:
    """Return the reasons why the stage has to be run; an empty list if its result is current."""
    old = manifest.read_manifest(this.folder(name_of(stage)))
    if old is None:
        return ["has no result yet"]
    present = digests_now(this, this.folder(name_of(stage)), old)
    return manifest.reasons_out_of_date(old, key_of(this, stage), present)


def digests_now(this: Run, place: Path, old: manifest.Manifest) -> dict[str, str | None]:
    """Return the present digests of a stage's files by name; None for a missing file.

    Parameters
    ----------
    this
        The run.
    place
        The stage's folder.
    old
        The manifest that names the files.
    """
    present = [name for name in old.outputs if (place / name).is_file()]
    digests = dict(zip(present, this.digests.of(place / name for name in present), strict=True))
    return {name: digests.get(name) for name in old.outputs}


def key_of(this: Run, stage: ModuleType) -> manifest.Key:
    """Return the key (everything on which the result depends) that the stage would have if it ran now."""
    raw: dict[str, str] = {}
    inputs: dict[str, str] = {}
    for marker in inputs_of(this, stage).values():
        if isinstance(marker, RawFiles):
            raw |= raw_of(this, marker.sensor)
        elif isinstance(marker, Provenance):
            raw |= all_raw(this)
        elif isinstance(marker, OfFurtherHeads):
            for head, run in this.heads.items():
                name = f"{OF_HEADS}/{head}/{marker.artefact.owner}/{marker.artefact.name}"
                inputs[name] = _artefact_digest(run, marker.artefact)
        else:
            inputs[f"{marker.owner}/{marker.name}"] = _artefact_digest(this, marker)
    config = plain_settings(vars(stage_config(stage.Config, this.settings.resolved())))
    if "svp" in (config.get("mbes") or {}):
        raw |= cast_digest(this)
    return manifest.Key(config, raw, inputs, provenance.source_digests(stage), provenance.library_versions())


def inputs_of(this: Run, stage: ModuleType) -> dict[str, Marker]:
    """Return the artefacts that a stage reads in this run, by field.

    An optional table is left out if its stage has not written it; the stage then gets None.
    """
    optional = {field.name for field in dataclasses.fields(stage.Inputs) if field.default is None}
    return {
        name: marker
        for name, marker in inputs_in(this.stages, stage).items()
        if name not in optional or not isinstance(marker, Artefact) or _is_written(this, marker)
    }


def _is_written(this: Run, marker: Artefact) -> bool:
    """Return whether a stage's result has an artefact; also true as long as the stage has no result."""
    owner = manifest.read_manifest(this.folder(marker.owner))
    return owner is None or file_name(marker) in manifest.artefact_digests(owner.outputs)


def raw_of(this: Run, sensor: str) -> dict[str, str]:
    """Return the digests of one sensor's files by name, as this run first computed them.

    Later stages depend on these digests and the report names them, even if a file changes during the run.
    """
    if sensor not in this.raw:
        this.raw[sensor] = raw_digests_now(this, sensor)
    return this.raw[sensor]


def all_raw(this: Run) -> dict[str, str]:
    """Return the digests by name of all raw files of the session and of the cast's file."""
    return {name: digest for sensor in SENSORS for name, digest in raw_of(this, sensor).items()} | cast_digest(this)


def raw_digests_now(this: Run, sensor: str) -> dict[str, str]:
    """Return the present digests of one sensor's files by name; none if the session has not this sensor."""
    settings = getattr(this.settings.session, sensor)
    return {} if settings is None else raw_digests(this.digests, this.settings.session_folder, sensor, settings)


def raw_digests(digests: Digests, root: Path, sensor: str, settings: Any) -> dict[str, str]:
    """Return the digests of one sensor's files. Their names are paths relative to the session folder ``root``."""
    paths = dispatch.raw_files(settings, root)
    names = [path.relative_to(root).as_posix() for path in paths]
    for name in names:
        if any("\udc80" <= letter <= "\udcff" for letter in name):  # stands for a byte that is not UTF-8
            raise RawDataError(f"{name!a}: the file's name is not UTF-8; rename it")
    of_name = dict(zip(names, digests.of(paths), strict=True))
    first: dict[str, str] = {}
    for name, digest in of_name.items():
        if first.setdefault(digest, name) != name and digest != EMPTY:
            raise RawDataError(f"{name}: is the same as {first[digest]}; list one of the two under {sensor}.files")
    return of_name


def cast_digest(this: Run) -> dict[str, str]:
    """Return the digest of the cast's file by name; empty without a file. The cast itself is in the settings.

    The heads of a sonar may name different files, if these have the same cast.
    """
    digests = {}
    for head in this.settings.session.heads.values():
        if (used := head.svp_from) is not None:
            (digests[used.file],) = this.digests.of([this.settings.session_folder / used.file])
            if digests[used.file] != used.sha256:
                raise RawDataError(f"{used.file}: is not the cast that this run was made with; run poolcal run again")
    return digests


def _artefact_digest(this: Run, marker: Artefact | Document) -> str:
    owner = manifest.read_manifest(this.folder(marker.owner))
    digests = manifest.artefact_digests(owner.outputs) if owner is not None else {}
    name = file_name(marker)
    if name not in digests:
        raise ArtefactError(f"{this.folder(marker.owner)}: has no complete {name}; run stage {marker.owner} first")
    return digests[name]


def file_name(marker: Artefact | Document) -> str:
    """Return the name of an artefact's file, or of a stream's folder, in its stage's folder."""
    return f"{marker.name}.parquet" if isinstance(marker, Artefact) and marker.kind == "table" else marker.name
