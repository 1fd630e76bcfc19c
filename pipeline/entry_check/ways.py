"""Ways in which the software may have placed the soundings, each with the mount that explains the pairs best by it.

As all software should; with the heights of another surface; with all positions shifted (another datum); with ranges by
another sound speed; with poses of other times; with a lever arm that is turned by the heading alone. A way with free
values always contains the plain one: it counts only if its values are significant.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.console import signed
from pipeline.entry_check.identification import Pairs
from pipeline.entry_check.mount_fit import NAMES, FittedMount, fit_delay, fit_mount, freed
from pipeline.entry_check.run_soundings import EntrySource, RunSoundings
from pipeline.maths.geometry.rotations import rotation_z

Array = NDArray[np.float64]
PLAIN = "plain"
LEAST_DELAY_S, LEAST_SHIFT_M = 1e-4, 0.005
SIGNIFICANT = 4.0  # sigmas
OWN, EACH_VALUE = 1.0, 0.1  # cost of a way: one mistake, and more for each free value, for these fit anything
Z = "shift_z"


@dataclass(frozen=True)
class Way:
    """One way in which the software may have placed the soundings, and the mount by it.

    Attributes
    ----------
    key
        Its code; "plain": nothing is wrong with it.
    words
        What is wrong with it, one sentence each.
    fitted
        The mount that explains the pairs best.
    cost
        0 for the plain one; about 1 for each thing that is wrong.
    any_height
        Whether a common shift of the heights is free: z and it differ only by the boat's roll and pitch.
    """

    key: str
    words: tuple[str, ...]
    fitted: FittedMount
    cost: float
    any_height: bool


def ways_of(pairs: Pairs, source: EntrySource, heights_differ: bool) -> Iterator[Way]:
    """Yield the ways, the plain one first.

    Parameters
    ----------
    pairs
        Soundings and where the file has them.
    source
        What may have been entered.
    heights_differ
        Whether the heights are above another surface for sure: then their shift is free in each way, at no cost.
    """
    yield from _ways(pairs, source, (), 0.0, heights_differ)
    if heights_differ:
        return
    lifted = fit_mount(pairs.soundings, pairs.points_pool_m, freed(Z))
    if abs(lifted.shift_m[2]) > LEAST_SHIFT_M and _is_significant(lifted, Z):
        lift_m = _shift_at(pairs, lifted, source)[2]
        words = (
            f"all heights are {lift_m:+.3f} m off: they are above another surface "
            "(a geoid, the sea, the water of the pool)"
        )
        yield from _ways(pairs, source, (words,), OWN + EACH_VALUE, True)


def _ways(pairs: Pairs, source: EntrySource, words: tuple[str, ...], cost: float, any_height: bool) -> Iterator[Way]:
    soundings, points, base = pairs.soundings, pairs.points_pool_m, (Z,) * any_height
    prefix = "heights" if words else ""

    def way(key: str, said: str, fitted: FittedMount, more: float) -> Way:
        whole = f"{prefix}_{key}" if prefix and key != PLAIN else prefix or key
        return Way(whole, (*words, *((said,) if said else ())), fitted, cost + more, any_height)

    yield way(PLAIN, "", fit_mount(soundings, points, freed(*base)), 0.0)
    for key, said, delay_s in _delays(source):
        if abs(delay_s) >= LEAST_DELAY_S:
            yield way(key, said, fit_mount(soundings.later(delay_s), points, freed(*base)), OWN)
    level = points - level_lever_error(soundings, source.total.lever_arm_body_m)
    said = "the software adds the lever arm without roll and pitch (Kluster does)"
    yield way("level_lever_arm", said, fit_mount(soundings, level, freed(*base)), OWN)
    longer = fit_mount(soundings, points, freed(*base, "k"))
    if _is_significant(longer, "k"):
        percent = 100 * (longer.range_factor - 1)
        said = f"the software's ranges are {percent:+.2f} % longer than the run's: it works with another sound speed"
        yield way("sound_speed", said, longer, OWN + EACH_VALUE)
    late = fit_delay(soundings, points, base, pairs.delay_s)
    if abs(late.delay_s) >= LEAST_DELAY_S and _is_significant(late, "delay"):
        said = f"the software's poses are {late.delay_s:+.4f} s late: it has another time base, or a latency"
        yield way("delay", said, late, OWN + EACH_VALUE)
    moved = fit_mount(soundings, points, freed("shift_x", "shift_y", Z))
    said, values = _shift_words(_shift_at(pairs, moved, source), source, any_height)
    if values:
        yield way("shift", said, moved, OWN + EACH_VALUE * values)


def _is_significant(fitted: FittedMount, name: str) -> bool:
    place = NAMES.index(name)
    value = [*fitted.shift_m, np.log(fitted.range_factor), fitted.delay_s][place - 6]
    return bool(abs(value) > SIGNIFICANT * np.sqrt(fitted.covariance[place, place]))


def _shift_at(pairs: Pairs, fitted: FittedMount, source: EntrySource) -> Array:
    """Return the shift (3,) m, pool frame, if the lever arm is the calibrated one.

    On one heading the fit cannot tell them apart, and leaves the shift in the lever arm.
    """
    placed = pairs.soundings.placed(fitted.range_factor * fitted.R_body_from_mbes, source.total.lever_arm_body_m)
    return np.asarray(fitted.weight @ (pairs.points_pool_m - placed) / fitted.weight.sum())


def _shift_words(shift_m: Array, source: EntrySource, any_height: bool) -> tuple[str, int]:
    """Return the sentence, and how many of the shift's values are more than rounding; 0: none of the level ones is."""
    counted = shift_m[:2] if any_height else shift_m
    east, north, up = (signed(value, 3) for value in rotation_z(-source.azimuth_rad) @ shift_m)
    parts = [f"{east} m east, {north} m north"] + [f"{up} m up"] * (not any_height)
    values = int((np.abs(counted) > LEAST_SHIFT_M).sum())
    words = f"all soundings are shifted by {', '.join(parts)}: another datum or epoch, grid offsets, or other positions"
    return words, values if np.abs(shift_m[:2]).max() > LEAST_SHIFT_M else 0


def _delays(source: EntrySource) -> Iterator[tuple[str, str, float]]:
    """Yield codes, words, and by how much later the software's poses are than the run's (true = recorded - latency).

    Without the sonar's latency L a sounding has its recorded time, which is later by L; with the opposite sign by 2 L.
    Without the INS's latency a pose has a time that is later by L than the true one, so that at each time the software
    takes an earlier pose.
    """
    for sensor, latency_s, sign in (("sonar", source.mbes_latency_s, 1.0), ("INS", source.ins_latency_s, -1.0)):
        code = sensor.lower()
        yield f"{code}_latency_missing", f"the {sensor}'s latency was not entered", sign * latency_s
        yield f"{code}_latency_sign", f"the {sensor}'s latency has the opposite sign", 2 * sign * latency_s


def level_lever_error(soundings: RunSoundings, lever_arm_m: Array) -> Array:
    """Return the error (n, 3) of a lever arm whose horizontal part is turned by the heading alone: R_heading t - R t.

    The height of R t is kept (exports: Kluster). R_heading turns about the vertical so that forward keeps its azimuth.
    """
    R = soundings.R_pool_from_body
    full = R @ lever_arm_m
    forward = R[:, :2, 1] / np.linalg.norm(R[:, :2, 1], axis=1)[:, None]
    starboard = np.stack([forward[:, 1], -forward[:, 0]], axis=1)
    flat = lever_arm_m[0] * starboard + lever_arm_m[1] * forward
    return np.column_stack([flat - full[:, :2], np.zeros(len(full))])
