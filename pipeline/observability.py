"""What the passes can tell and what not, in words, and which passes would cure it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.solution import WORDS, Solution, solve
from pipeline.maths.unknowns import SIX
from pipeline.plan_settings import Pass
from pipeline.planning import Setting, predict

Array = NDArray[np.float64]
STRONG = 0.95  # a correlation above this leaves two unknowns hardly apart
NEAR_M = 1.5  # passes whose distances differ by less are at one distance
WANTED_DEG, WANTED_M = 0.025, 0.0025  # larger random sigmas are worth another pass
TRIED_M = (3.0, 4.0, 5.0, 6.0, 8.0, 10.0)  # distances of passes that might help
TWICE = 2  # passes there
SIDES = {"P1": "the faces on the -y side (P1)", "P3": "the faces on the +y side (P3)", "P2": "the wall (P2)"}


@dataclass(frozen=True)
class Seen:
    """What a session had: distances of its passes, number of soundings and of laser points by family."""

    distances_m: Sequence[float]
    soundings: Mapping[str, int]
    speed_m_s: float
    heading_swing_deg: float


@dataclass(frozen=True)
class Geometry:
    """``gaps``: what the passes lack, each in words; ``remedy``: what to sail, with what it would bring."""

    gaps: list[str]
    remedy: str


def geometry_of(setting: Setting, seen: Seen, normal: Array, solution: Solution) -> Geometry:
    """``normal`` (u, u): the session's."""
    bounds = np.repeat([np.radians(WANTED_DEG), WANTED_M], 3)
    gaps = _gaps(seen)
    covariance = solution.covariance[:SIX, :SIX]
    sigma = np.sqrt(np.diag(covariance))
    pair = _strongest(covariance) if not solution.deficiency else None
    weak = bool(solution.deficiency) or bool(np.any(sigma > bounds)) or pair is not None
    if not (gaps or weak):
        return Geometry([], "")
    target = _worst(sigma, bounds, pair, bool(solution.deficiency))
    return Geometry(gaps, _remedy(setting, seen, normal, solution, target, bounds, pair))


def _gaps(seen: Seen) -> list[str]:
    there = {family for family, count in seen.soundings.items() if count}
    if there == {"P2"}:
        return ["the sonar sees the wall alone: nothing tells where it is along the wall, or how high"]
    found = []
    missing = [words for family, words in SIDES.items() if family not in there]
    if missing:
        found.append(f"the sonar sees nothing of {' and '.join(missing)}")
    if "H" not in there:
        found.append(
            "the sonar sees no horizontal face: only the boat's rolling and pitching tell its height, and a still boat "
            "tells nothing"
        )
    low, high = min(seen.distances_m, default=0.0), max(seen.distances_m, default=0.0)
    if len(seen.distances_m) == 1:
        found.append(f"one pass alone has soundings, at {low:.1f} m: nothing shows whether another would agree")
    elif seen.distances_m and high - low < NEAR_M:
        found.append(
            f"all passes lie at {low:.1f} to {high:.1f} m, where yaw and lever arm y are hard to tell apart"
        )
    return found


def _strongest(covariance: Array) -> tuple[int, int, float] | None:
    """The two of the six with the strongest correlation, if that is above :data:`STRONG`."""
    sigma = np.sqrt(np.diag(covariance))
    above = np.triu(covariance / np.outer(sigma, sigma), 1)
    row, column = divmod(int(np.argmax(np.abs(above))), SIX)
    return (row, column, float(above[row, column])) if abs(above[row, column]) > STRONG else None


def _worst(sigma: Array, bounds: Array, pair: tuple[int, int, float] | None, open_: bool) -> int:
    """Which of the six to bring down: the one that is farthest beyond its bound, of a pair if there is one."""
    if open_:
        return int(np.argmax(sigma / bounds))
    if pair is not None:
        return max(pair[:2], key=lambda k: sigma[k] / bounds[k])
    return int(np.argmax(sigma / bounds))


def _remedy(
    setting: Setting,
    seen: Seen,
    normal: Array,
    solution: Solution,
    target: int,
    bounds: Array,
    pair: tuple[int, int, float] | None,
) -> str:
    """The distance at which two more passes would help most, and by how much; empty if none halves the sigma."""
    before = np.sqrt(solution.covariance[target, target]) if not solution.deficiency else np.inf
    best: tuple[float, float, float] | None = None
    for distance in TRIED_M:
        one = Pass(distance_m=distance, speed_m_s=seen.speed_m_s, heading_swing_deg=seen.heading_swing_deg)
        further = predict(setting, [one], phases=1).normal
        after = solve(normal + TWICE * further, np.zeros(len(normal)), solution.free.tolist())
        if after.deficiency:
            continue
        sigma = np.sqrt(np.diag(after.covariance))[:SIX]
        worst = float(np.max(sigma / bounds))
        if best is None or worst < best[0]:
            best = worst, distance, float(sigma[target])
    apart = "" if pair is None else (
        f"{WORDS[pair[0]]} and {WORDS[pair[1]]} cannot be told apart (correlation {pair[2]:+.3f}): "
    )
    if best is None or best[2] > before / 2:
        return apart.removesuffix(": ")
    was = "open" if not np.isfinite(before) else _sized(before, target)
    return (
        f"{apart}two more passes at {best[1]:.0f} m would bring sigma {WORDS[target]} from {was} to "
        f"{_sized(best[2], target)}"
    )


def _sized(sigma: float, which: int) -> str:
    return f"{np.degrees(sigma):.3f}°" if which < 3 else f"{1000 * sigma:.1f} mm"


