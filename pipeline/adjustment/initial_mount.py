"""First steps of the coarse mount, which bring the soundings near the surfaces, where the adjustment is linear."""

import numpy as np

from pipeline.adjustment.accumulation import accumulate
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.artefacts.streams import Stream
from pipeline.maths.adjustment.normal_equations import Linearisation, mount_step
from pipeline.maths.adjustment.parameters import State

NEAR_RAD_M = 1e-3  # rad and m: a smaller step ends the initial steps
INITIAL_STEPS = 10  # largest number of steps to bring the soundings near the surfaces


def initial_mount(soundings: Stream, model: ObservationModel) -> State:
    """Return the state after steps of the coarse mount alone, which bring the soundings near the surfaces."""
    state = model.coarse
    for _ in range(INITIAL_STEPS):
        sums = accumulate({"mbes": soundings}, model, CurrentValues(state)).sums
        step = mount_step(Linearisation(sums, state, model.body))
        state = state.updated(step)
        if np.max(np.abs(step)) < NEAR_RAD_M:
            break
    return state
