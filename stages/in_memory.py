"""Run the stages in memory, without any file: for tests, campaigns, and the trial calibration of ``poolcal check``."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pipeline.artefacts.schema import Artefact, Document, OfFurtherHeads, RawFiles
from pipeline.artefacts.streams import EMPTY_STREAM, MemoryPart, Stream
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.stage_settings import settings_by_name, stage_config
from pipeline.run.stage_protocol import declared, inputs_in, name_of, of_each_head, run_in_memory
from stages import load

NO_PROVENANCE: dict[str, Any] = {"inputs": {}, "software": {}}


def calibrate_in_memory(
    session: SessionConfig,
    pool: PoolConfig,
    raw: Mapping[str, Mapping[str, np.ndarray]],
    until: str = "report",
    changed: Callable[[str, Any], Any] = lambda _, value: value,
    known: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Run the stages on columns in memory.

    Parameters
    ----------
    session, pool
        The settings of the session and of the pool.
    raw : mapping
        The columns that the readers return, by sensor: ins, laser, mbes, and further heads.
    until : str
        The last stage to run.
    changed : callable
        Function of an artefact's key and value. Its result replaces the value for the following stages.
    known : mapping, optional
        Artefacts, as returned by a call with the same columns and settings of their stages: these are not run again.

    Returns
    -------
    dict
        All artefacts of these stages, by "owner/name".
    """
    artefacts: dict[str, Any] = {}

    stages = load(session.calibrated)
    further = {
        head: calibrate_in_memory(
            session.alone(head), pool, {**raw, "mbes": raw[head]}, name_of(of_each_head(stages)[-1]), changed
        )
        for head in list(session.heads)[1:]
    }

    def input_of(marker: Any) -> Any:
        if isinstance(marker, OfFurtherHeads):
            return {head: found[_key(marker.artefact)] for head, found in further.items()}
        if isinstance(marker, RawFiles):
            present = getattr(session, marker.sensor) is not None
            return Stream((MemoryPart(marker.sensor, raw[marker.sensor]),)) if present else EMPTY_STREAM
        return artefacts.get(_key(marker)) if isinstance(marker, (Artefact, Document)) else NO_PROVENANCE

    settings = settings_by_name(pool, session)
    names = [name_of(stage) for stage in stages]
    for stage in stages:
        made = {key: value for key, value in (known or {}).items() if key.startswith(f"{name_of(stage)}/")}
        if not made:
            inputs = stage.Inputs(**{name: input_of(marker) for name, marker in inputs_in(names, stage).items()})
            outputs = run_in_memory(stage, inputs, stage_config(stage.Config, settings))
            for name, marker in declared(stage.Outputs).items():
                if isinstance(marker, (Artefact, Document)) and getattr(outputs, name) is not None:
                    made[_key(marker)] = getattr(outputs, name)
        artefacts |= {key: changed(key, value) for key, value in made.items()}
        if name_of(stage) == until:
            break
    return artefacts


def _key(marker: Artefact | Document) -> str:
    return f"{marker.owner}/{marker.name}"
