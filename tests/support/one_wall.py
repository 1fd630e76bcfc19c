"""Points of the forward model on its wall alone."""

from dataclasses import replace

import numpy as np

from pipeline.adjustment.observation_model import ObservationModel
from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.session import Ins
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State
from tests.support.forward_points import FACES, LEVER_TRUE, QUIET, R_TRUE, made

WALL = next(k for k, (family, *_) in enumerate(FACES) if family == "P2")


def made_of_wall(seed: int, ins: Ins = QUIET, sensors: float = 1.0) -> tuple[dict[str, Stream], ObservationModel]:
    """The points of both sensors on the wall, and a model that knows it alone and starts at the true mount."""
    streams, model = made(seed, ins, sensors)
    kept = {}
    for sensor, stream in streams.items():
        (batch,) = stream.batches()
        on = np.flatnonzero(batch["face"] == WALL)
        columns = {name: column[on] for name, column in batch.items()} | {"face": np.zeros(len(on), dtype=np.int16)}
        kept[sensor] = Stream((MemoryPart(sensor, columns),))
    wall = ObservedSurface.at("P2", np.array(FACES[WALL][1]), np.array(FACES[WALL][2]))
    faces, coarse = Faces(("P2",), np.array([0]), np.ones(1)), State.at(R_TRUE, LEVER_TRUE, [wall])
    return kept, replace(model, coarse=coarse, faces=faces, height_of_face=np.zeros(1))
