"""Cells of faces: which of them a sounding's ray meets, and the soundings that lie in none of some cells."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.residual_places import places_on_surface
from pipeline.artefacts.streams import Batch
from pipeline.maths.adjustment.parameters import State

Integers = NDArray[np.int64]
CELL_M = 0.125  # side of a cell
REACH = 1 << 15  # cells along a face: within ± this many, 4 km


def codes_of(batch: Batch, model: ObservationModel, head: str, state: State) -> Integers:
    """Return a number (n,) for the face of each sounding and the cell of it that its ray meets.

    Faces are cut along the tangents of their surfaces, from the surfaces' centres on. Soundings are placed by the mount
    of the state, without the drift.
    """
    surface, face = model.faces.surface[batch["face"]], batch["face"].astype(np.int64)
    tangents = np.array([each.tangents for each in state.surfaces])
    centres = np.array([each.centre_m for each in state.surfaces])
    from_centre_m = places_on_surface(model, head, batch, state) - centres[surface]
    place = np.floor(np.einsum("nki,ni->nk", tangents[surface], from_centre_m) / CELL_M)
    column, row = np.clip(place, -REACH, REACH - 1).astype(np.int64).T + REACH
    return np.asarray((face * 2 * REACH + column) * 2 * REACH + row)


def faces_of(codes: Integers) -> Integers:
    """Return the numbers (c,) of the faces of cells."""
    return codes // (2 * REACH) ** 2


def places_of(codes: Integers) -> Integers:
    """Return column and row (c, 2) of cells on their faces."""
    return np.asarray(np.stack([codes // (2 * REACH) % (2 * REACH), codes % (2 * REACH)], axis=1) - REACH)


@dataclass(frozen=True)
class OutsideCells:
    """Leaves those of a head's soundings that do not lie in cells (c,); they are placed by the mount of a state."""

    model: ObservationModel
    state: State
    head: str
    codes: Integers

    def __call__(self, batch: Batch) -> Batch:
        """Return the rows that are left."""
        kept = np.ones(len(batch["face"]), dtype=bool)
        rows = np.flatnonzero(np.isin(batch["face"], faces_of(self.codes)))
        some = {name: column[rows] for name, column in batch.items()}
        kept[rows] = ~np.isin(codes_of(some, self.model, self.head, self.state), self.codes)
        return {name: column[kept] for name, column in batch.items()}
