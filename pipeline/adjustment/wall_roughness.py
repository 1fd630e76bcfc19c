"""The roughness of walls that nobody has surveyed, taken into the sums of the intervals."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from pipeline.adjustment.iterate import Iterate
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.parameters import kind_of
from pipeline.maths.adjustment.ping_noise import DesignEffects, with_design_effects
from pipeline.maths.adjustment.roughness import Roughness, roughness


def with_roughness(
    last: Iterate, before: Mapping[str, Roughness], body: BodyMotion, gap_s: float
) -> tuple[Iterate, dict[str, Roughness]]:
    """Return the values with sums in which roughness counts, and the roughness by sensor.

    The sums may have some already, ``before``. Their weights are then smaller by d = 1 + added, and so is what
    :func:`~pipeline.maths.adjustment.roughness.roughness` finds. Roughness never becomes less: where the first solution
    follows it by the drift, a later one shows more.

    Parameters
    ----------
    last : Iterate
        The current values.
    before : mapping of Roughness
        Roughness by sensor that the sums have, or none of a place that a test has found rough before.
    body : BodyMotion
        The motion of the body.
    gap_s : float
        A longer time (s) without observations separates passes.
    """
    linearisation, found = last.linearisation, dict[str, Roughness]()
    surfaces = linearisation.state.surfaces
    for sensor, sums in last.linearisation.sums.items():
        had = before.get(sensor, Roughness.none(len(surfaces)))
        seen = roughness(sums, surfaces, body, last.drift, gap_s, kind_of(sensor) == "mbes", had.shown)
        added = np.maximum(had.added, seen.added * (1 + had.added))
        found[sensor] = Roughness(added, np.maximum(had.patch_m, seen.patch_m), seen.shown)
        times = (1 + added) / (1 + had.added)
        if np.any(times > 1):
            rougher = sums.stored(partial(with_design_effects, effects=DesignEffects(times, times)))
            linearisation = linearisation.with_sums(sensor, rougher)
    return replace(last, linearisation=linearisation), found
