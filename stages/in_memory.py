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
    """Every artefact of the stages up to ``until``, by "owner/name"; ``raw``: canonical columns of ins, laser, mbes;
    ``changed`` gives what the stages that follow get in an artefact's place."""
    found: dict[str, Any] = {}

    def given(marker: Any) -> Any:
        if isinstance(marker, Raw):
            there = getattr(session, marker.sensor) is not None
            return Stream((MemoryPart(marker.sensor, raw[marker.sensor]),)) if there else EMPTY
        if isinstance(marker, (Artefact, Document)):
            return found[f"{marker.owner}/{marker.name}"]
        return {"inputs": {}, "software": {}}

    settings = settings_by_name(pool, session)
    for stage in load(session.calibrated):
        inputs = stage.Inputs(**{name: given(marker) for name, marker in declared(stage.Inputs).items()})
        outputs = run_in_memory(stage, inputs, stage_config(stage.Config, settings))
        for name, marker in declared(stage.Outputs).items():
            if isinstance(marker, (Artefact, Document)):
                key = f"{marker.owner}/{marker.name}"
                found[key] = changed(key, getattr(outputs, name))
        if name_of(stage) == until:
            break
    return found
