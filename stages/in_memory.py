"""Simulated sessions through the stages in memory: for tests and ``make montecarlo``, without any file."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pipeline.artefacts.schema import Artefact, Document, Raw
from pipeline.artefacts.streams import EMPTY, MemoryPart, Stream
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
    """Run the stages up to ``until``; return every artefact by "owner/name".

    Parameters
    ----------
    session, pool
        The settings.
    raw
        Canonical columns by sensor: ins, laser, mbes.
    until
        The last stage that is run.
    changed
        Returns what the following stages get in place of an artefact, from its key and value.
    """
    artefacts: dict[str, Any] = {}

    def input_for(marker: Any) -> Any:
        if isinstance(marker, Raw):
            there = getattr(session, marker.sensor) is not None
            return Stream((MemoryPart(marker.sensor, raw[marker.sensor]),)) if there else EMPTY
        if isinstance(marker, (Artefact, Document)):
            return artefacts[f"{marker.owner}/{marker.name}"]
        return {"inputs": {}, "software": {}}

    settings = settings_by_name(pool, session)
    for stage in load(session.calibrated):
        inputs = stage.Inputs(**{name: input_for(marker) for name, marker in declared(stage.Inputs).items()})
        outputs = run_in_memory(stage, inputs, stage_config(stage.Config, settings))
        for name, marker in declared(stage.Outputs).items():
            if isinstance(marker, (Artefact, Document)):
                key = f"{marker.owner}/{marker.name}"
                artefacts[key] = changed(key, getattr(outputs, name))
        if name_of(stage) == until:
            break
    return artefacts
