"""The check that the points hit the target, and, if they do not, the search for a wrong height, clock, unit or sign."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.clocks import offset_name
from pipeline.checking.findings import Finding
from pipeline.checking.heights import height_findings
from pipeline.checking.hypotheses import agreement, hypotheses
from pipeline.checking.point_samples import NAMES, PointSample, place_points
from pipeline.checking.track import InsTrack
from pipeline.checking.track_checks import azimuth_remedy
from pipeline.config.pool import PoolConfig
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
BETTER, AT_LEAST = 2.0, 0.02  # an error is accepted if its score is this many times the present one, and this much more
NOTHING, FEW = 0.01, 50  # agreement in good passes below which points miss the target; too few points to judge
LEAP_WITHIN_S = 1.5  # an origin half a metre off along the track looks like a clock that is a second off


def points_off_target(
    track: InsTrack, samples: Sequence[PointSample], closest: ClosestSurface, pool: PoolConfig
) -> Iterator[Finding]:
    """Yield a finding about the likely error of each sensor whose points miss the target.

    Heights are checked first. If both sensors are off by the same height, the target's height is wrong, even if a mount
    could explain part of it. If both sensors' clocks are off by about the same amount, the INS's clock is wrong.

    Parameters
    ----------
    track : InsTrack
        The INS's track.
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


def _misses(track: InsTrack, sample: PointSample, closest: ClosestSurface) -> bool:
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
    """Return the amount, the known cause (if any) and the direction of a clock's offset as text.

    >>> _offset(18.4), _offset(-5.0)
    ('18.4 s (likely 18 s: UTC and GPS time are mixed up) ahead of', '5.0 s behind')
    """
    words = offset_name(ahead_s, LEAP_WITHIN_S)
    leap = next((s for s in (18, 37, 19, 17) if abs(abs(ahead_s) - s) <= LEAP_WITHIN_S), 0)
    likely = f" (likely {leap} s: {words})" if leap and words else ""
    return f"{abs(ahead_s):.1f} s{likely} {'ahead of' if ahead_s > 0 else 'behind'}"
