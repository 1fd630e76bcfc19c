"""Do the points fall onto the target? If not: with which clock, unit or sign they would."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.clocks import offset_name
from pipeline.checking.file_checks import FAR_ARM_M
from pipeline.checking.findings import Finding
from pipeline.checking.heights import height_findings
from pipeline.checking.point_samples import AS_GIVEN, NAMES, Placing, PointSample, place_points
from pipeline.checking.track import Track
from pipeline.checking.track_checks import azimuth_remedy
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
class Hypothesis:
    """What may be wrong with a sensor, and how well its points fall onto the target if it is.

    Attributes
    ----------
    score : float
        The mean of 1 - (d / reach)², none beyond the reach.
    clock_s : float
        By how much the sensor's clock would be ahead.
    words : str
        What else would be wrong, for the finding.
    """

    score: float
    clock_s: float = 0.0
    words: str = ""


def agreement(closest: ClosestSurface, points: Array) -> float:
    """Return how well points (n, 3) m in the pool frame fall onto the target; those that are NaN do not."""
    known = np.flatnonzero(np.isfinite(points[:, 0]))
    if not len(known):
        return 0.0
    on, _ = closest(points[known])
    squares = np.sum((points[known] - on) ** 2, axis=1) / REACH_M**2
    return float(np.sum(np.maximum(0.0, 1.0 - squares)) / len(points))


def hypotheses(track: Track, sample: PointSample, closest: ClosestSurface) -> list[Hypothesis]:
    """Return how well a sensor's points fit as they are, first; then with other units, signs and clocks.

    Parameters
    ----------
    track : Track
        Of the INS.
    sample : PointSample
        The sensor's points.
    closest : ClosestSurface
        The target's surface.
    """

    def score(placing: Placing = AS_GIVEN) -> float:
        return agreement(closest, place_points(track, sample, placing))

    tried = [Hypothesis(score())]
    if sample.georeferenced:
        return tried
    if sample.sensor == "laser":
        tried += [
            Hypothesis(score(Placing(scale=scale)), words=f"if they are in {unit}: export them in metres")
            for unit, scale in UNITS.items()
        ]
    for key in SIGNS:
        value = getattr(sample.mount, key)
        reversed_mount = sample.mount.model_copy(update={key: -value})
        words = f"with {sample.sensor}.mount.{key} = {-value:g} in place of {value:g}: reverse its sign"
        tried.append(Hypothesis(score(Placing(mount=reversed_mount)), words=words))
    for key in ("x_m", "y_m", "z_m"):
        value = getattr(sample.mount, key)
        if abs(value) > FAR_ARM_M:
            words = f"with {sample.sensor}.mount.{key} = {value / 100:g} in place of {value:g}: write metres"
            in_metres = sample.mount.model_copy(update={key: value / 100})
            tried.append(Hypothesis(score(Placing(mount=in_metres)), words=words))

    def clock_score(ahead_s: float) -> float:
        return score(Placing(clock_ahead_s=ahead_s))

    coarse = np.arange(-FARTHEST_S, FARTHEST_S + STEP_S / 2, STEP_S)
    best = float(max(coarse, key=clock_score))
    fine = best + np.arange(-STEP_S, STEP_S + FINE_S / 2, FINE_S)
    clock_s = float(max(fine, key=clock_score))
    return [*tried, Hypothesis(clock_score(clock_s), clock_s)]


def points_off_target(
    track: Track, samples: Sequence[PointSample], closest: ClosestSurface, pool: PoolConfig
) -> Iterator[Finding]:
    """Yield what is wrong with each sensor whose points miss the target.

    A clock that is off by the same against both sensors is the INS's. A height that both sensors are off by is the
    target's, whatever a mount might explain of it.

    Parameters
    ----------
    track : Track
        Of the INS.
    samples : Sequence[PointSample]
        Points of each sensor.
    closest : ClosestSurface
        The target's surface.
    pool : PoolConfig
        The pool's settings.
    """
    settings, water_m = pool.segment, pool.target.water_level_m
    wrong = list(height_findings(track, samples, closest, water_m, pool.target.origin.height_m))
    if wrong:
        yield from wrong
        return
    speed = max([0.05, *(leg.speed_m_s for leg in track.legs)])
    least_s = max(2.5, 2 * settings.search_horizontal_m / speed)
    clocks: dict[str, float] = {}
    for sample in samples:
        first, *others = hypotheses(track, sample, closest)
        best = max(others, key=lambda hypothesis: hypothesis.score, default=first)
        if best.score > max(BETTER * first.score, first.score + AT_LEAST) and (
            best.words or abs(best.clock_s) >= least_s
        ):
            if best.words:
                words = f"{sample.sensor}: {NAMES[sample.sensor]} miss the target, but hit it {best.words}"
                yield Finding("target", words)
            else:
                clocks[sample.sensor] = best.clock_s
        elif _misses(track, sample, closest):
            own = f"{sample.sensor}.{'frame' if sample.georeferenced else 'mount'}"
            tried = "at another height" if sample.georeferenced else "with another sign, clock or height"
            check = f"check {own}, target.origin and target.azimuth_deg"
            askew = azimuth_remedy(track, pool.target_place)
            yield Finding(
                "target",
                f"{sample.sensor}: hardly any of its {NAMES[sample.sensor]} fall onto the target in its passes, nor "
                f"would they {tried}: {f'the boat: {askew}' if askew else check}",
            )
    yield from _clocks(clocks, len(samples))


def _misses(track: Track, sample: PointSample, closest: ClosestSurface) -> bool:
    near = sample.in_good_legs(track)
    return len(near.t_ns) > FEW and agreement(closest, place_points(track, near)) < NOTHING


def _clocks(clocks: Mapping[str, float], sensors: int) -> Iterator[Finding]:
    if len(clocks) == sensors > 1 and np.ptp(list(clocks.values())) < LEAP_WITHIN_S:
        ahead_s = -float(np.mean(list(clocks.values())))
        words = f"ins: its clock is {_offset(ahead_s)} both sensors': check its times, and its time scale"
        yield Finding("clock", words)
        return
    for sensor, ahead_s in clocks.items():
        yield Finding(
            "clock",
            f"{sensor}: its points hit the target if its clock is {_offset(ahead_s)} the INS's; set its time scale, or "
            f"{sensor}.latency_s",
        )


def _offset(ahead_s: float) -> str:
    """Return the amount and the direction of a clock's offset, and what it is known as.

    >>> _offset(18.4), _offset(-5.0)
    ('18.4 s (likely 18 s: UTC and GPS time are mixed up) ahead of', '5.0 s behind')
    """
    words = offset_name(ahead_s, LEAP_WITHIN_S)
    leap = next((s for s in (18, 37, 19, 17) if abs(abs(ahead_s) - s) <= LEAP_WITHIN_S), 0)
    likely = f" (likely {leap} s: {words})" if leap and words else ""
    return f"{abs(ahead_s):.1f} s{likely} {'ahead of' if ahead_s > 0 else 'behind'}"
