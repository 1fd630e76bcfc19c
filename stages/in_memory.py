"""Simulated sessions through the stages in memory: for tests and ``make montecarlo``, without any file."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pipeline.artefacts.schema import Artefact, Document, RawFiles
from pipeline.artefacts.streams import EMPTY_STREAM, MemoryPart, Stream
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.stage_settings import settings_by_name, stage_config
from pipeline.run.stage_protocol import declared, name_of, run_in_memory
from stages import load


def calibrate_in_memory(
    session: SessionConfig,
    pool: PoolConfig,
    raw: Mapping[str, Mapping[str, np.ndarray]],
    until: str = "report",
    changed: Callable[[str, Any], Any] = lambda _, value: value,
) -> dict[str, Any]:
    """Run the stages on columns in memory.

    Parameters
    ----------
    session, pool
        Settings.
    raw : mapping
        Canonical columns of ins, laser and mbes.
    until : str
        The last stage to run.
    changed : callable
        Function of an artefact's key and value: what the following stages get in its place.

    Returns
    -------
    dict
        Every artefact of these stages, by "owner/name".
    """
    artefacts: dict[str, Any] = {}

    def input_of(marker: Any) -> Any:
        if isinstance(marker, RawFiles):
            present = getattr(session, marker.sensor) is not None
            return Stream((MemoryPart(marker.sensor, raw[marker.sensor]),)) if present else EMPTY_STREAM
        if isinstance(marker, (Artefact, Document)):
            return artefacts[f"{marker.owner}/{marker.name}"]
        return {"inputs": {}, "software": {}}

    settings = settings_by_name(pool, session)
    for stage in load(session.calibrated):
        inputs = stage.Inputs(**{name: input_of(marker) for name, marker in declared(stage.Inputs).items()})
        outputs = run_in_memory(stage, inputs, stage_config(stage.Config, settings))
        for name, marker in declared(stage.Outputs).items():
            if isinstance(marker, (Artefact, Document)):
                key = f"{marker.owner}/{marker.name}"
                artefacts[key] = changed(key, getattr(outputs, name))
        if name_of(stage) == until:
            break
    return artefacts
