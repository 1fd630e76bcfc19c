"""Do the points fall onto the target? If not: with which clock, unit or sign they would."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.clocks import named
from pipeline.checking.file_checks import FAR_ARM_M
from pipeline.checking.findings import Finding
from pipeline.checking.heights import wrong_height
from pipeline.checking.point_samples import NAMES, Sample, put
from pipeline.checking.track import Track
from pipeline.checking.track_checks import heading
from pipeline.config.pool import PoolConfig
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
REACH_M = 0.5  # from a face, beyond which a point counts nothing: coarse mount and origin may be wrong by that
FARTHEST_S, STEP_S, FINE_S = 60.0, 1.0, 0.1
BETTER, AT_LEAST = 2.0, 0.02  # times the score as it is, and above it: what is wrong shows so clearly
NOTHING, FEW = 0.01, 50  # of the points in passes, so few hit; too few points to tell
LEAP_WITHIN_S = 1.5  # an origin half a metre off along the track looks like a second
UNITS = {"millimetres": 0.001, "centimetres": 0.01, "feet": 0.3048}
SIGNS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m")  # of z: heights.py


@dataclass(frozen=True)
class Hit:
    """How well points fall onto the target: the mean of 1 - (d / reach)², none beyond."""

    score: float
    clock_s: float = 0.0
    words: str = ""


def score(closest: ClosestSurface, points: Array) -> float:
    known = np.flatnonzero(np.isfinite(points[:, 0]))
    if not len(known):
        return 0.0
    on, _ = closest(points[known])
    squares = np.sum((points[known] - on) ** 2, axis=1) / REACH_M**2
    return float(np.sum(np.maximum(0.0, 1.0 - squares)) / len(points))


def hypotheses(track: Track, some: Sample, closest: ClosestSurface) -> list[Hit]:
    """As it is, first; then with other units, signs and clocks."""

    def judge(**changed: object) -> float:
        placing: Callable[..., Array] = partial(put, track, some)
        return score(closest, placing(**changed))

    tried = [Hit(judge())]
    if some.georeferenced:
        return tried
    if some.sensor == "laser":
        tried += [
            Hit(judge(scale=scale), words=f"if they are in {unit}: export them in metres")
            for unit, scale in UNITS.items()
        ]
    for key in SIGNS:
        value = getattr(some.mount, key)
        turned = some.mount.model_copy(update={key: -value})
        words = f"with {some.sensor}.mount.{key} = {-value:g} in place of {value:g}: reverse its sign"
        tried.append(Hit(judge(mount=turned), words=words))
    for key in ("x_m", "y_m", "z_m"):
        value = getattr(some.mount, key)
        if abs(value) > FAR_ARM_M:
            words = f"with {some.sensor}.mount.{key} = {value / 100:g} in place of {value:g}: write metres"
            tried.append(Hit(judge(mount=some.mount.model_copy(update={key: value / 100})), words=words))
    coarse = np.arange(-FARTHEST_S, FARTHEST_S + STEP_S / 2, STEP_S)
    best = float(max(coarse, key=lambda ahead_s: judge(ahead_s=ahead_s)))
    fine = best + np.arange(-STEP_S, STEP_S + FINE_S / 2, FINE_S)
    clock_s = float(max(fine, key=lambda ahead_s: judge(ahead_s=ahead_s)))
    return [*tried, Hit(judge(ahead_s=clock_s), clock_s)]


def off_target(
    track: Track, samples: Sequence[Sample], closest: ClosestSurface, pool: PoolConfig
) -> Iterator[Finding]:
    """What is wrong with each sensor, if anything is; a clock that both are off by is the INS's. A height that both are
    off by is the target's, whatever a mount might explain of it."""
    settings, water_m = pool.segment, pool.target.water_level_m
    wrong = list(wrong_height(track, samples, closest, water_m, pool.target.origin.height_m))
    if wrong:
        yield from wrong
        return
    speed = max([0.05, *(leg.speed_m_s for leg in track.legs)])
    least_s = max(2.5, 2 * settings.search_horizontal_m / speed)
    clocks: dict[str, float] = {}
    for some in samples:
        first, *others = hypotheses(track, some, closest)
        best = max(others, key=lambda hit: hit.score, default=first)
        if best.score > max(BETTER * first.score, first.score + AT_LEAST) and (
            best.words or abs(best.clock_s) >= least_s
        ):
            if best.words:
                yield Finding("target", f"{some.sensor}: {NAMES[some.sensor]} miss the target, but hit it {best.words}")
            else:
                clocks[some.sensor] = best.clock_s
        elif _misses(track, some, closest):
            own = f"{some.sensor}.{'frame' if some.georeferenced else 'mount'}"
            tried = "at another height" if some.georeferenced else "with another sign, clock or height"
            check = f"check {own}, target.origin and target.azimuth_deg"
            askew = heading(track, pool.target_place)
            yield Finding(
                "target",
                f"{some.sensor}: hardly any of its {NAMES[some.sensor]} fall onto the target in its passes, nor would "
                f"they {tried}: {f'the boat: {askew}' if askew else check}",
            )
    yield from _clocks(clocks, len(samples))


def _misses(track: Track, some: Sample, closest: ClosestSurface) -> bool:
    near = some.near(track)
    return len(near.t_ns) > FEW and score(closest, put(track, near)) < NOTHING


def _clocks(clocks: Mapping[str, float], sensors: int) -> Iterator[Finding]:
    if len(clocks) == sensors > 1 and np.ptp(list(clocks.values())) < LEAP_WITHIN_S:
        ahead_s = -float(np.mean(list(clocks.values())))
        yield Finding("clock", f"ins: its clock is {_said(ahead_s)} both sensors': check its times, and its time scale")
        return
    for sensor, ahead_s in clocks.items():
        yield Finding(
            "clock",
            f"{sensor}: its points hit the target if its clock is {_said(ahead_s)} the INS's; set its time scale, or "
            f"{sensor}.latency_s",
        )


def _said(ahead_s: float) -> str:
    """
    >>> _said(18.4), _said(-5.0)
    ('18.4 s (likely 18 s: UTC and GPS time are mixed up) ahead of', '5.0 s behind')
    """
    words = named(ahead_s, LEAP_WITHIN_S)
    leap = next((s for s in (18, 37, 19, 17) if abs(abs(ahead_s) - s) <= LEAP_WITHIN_S), 0)
    likely = f" (likely {leap} s: {words})" if leap and words else ""
    return f"{abs(ahead_s):.1f} s{likely} {'ahead of' if ahead_s > 0 else 'behind'}"
