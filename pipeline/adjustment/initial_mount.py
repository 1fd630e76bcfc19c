"""First steps of the coarse mounts, which bring the soundings near the surfaces, where the adjustment is linear."""

from collections.abc import Mapping

import numpy as np

from pipeline.adjustment.accumulation import accumulate
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.artefacts.streams import Stream
from pipeline.maths.adjustment.normal_equations import Linearisation, mount_step
from pipeline.maths.adjustment.parameters import State, kind_of

NEAR_RAD_M = 1e-3  # rad and m: a smaller step ends the initial steps
INITIAL_STEPS = 10  # largest number of steps to bring the soundings near the surfaces


def initial_mounts(streams: Mapping[str, Stream], model: ObservationModel) -> State:
    """Return the state after steps of the sonar's coarse mounts alone, which bring the soundings near the surfaces.

    A session without a sonar has no such steps.
    """
    state = model.coarse
    for sensor, soundings in streams.items():
        if kind_of(sensor) == "mbes":
            state = _initial_mount(sensor, soundings, model, state)
    return state


def _initial_mount(sensor: str, soundings: Stream, model: ObservationModel, state: State) -> State:
    for _ in range(INITIAL_STEPS):
        sums = accumulate({sensor: soundings}, model, CurrentValues(state)).sums
        step = mount_step(Linearisation(sums, state, model.body), sensor)
        state = state.updated(step)
        if np.max(np.abs(step)) < NEAR_RAD_M:
            break
    return state
