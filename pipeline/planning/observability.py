"""What the passes can tell and what not, in words, and which passes would help."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.plan import Pass
from pipeline.maths.adjustment.estimability import correlated_pair
from pipeline.maths.adjustment.solution import Solution, solve
from pipeline.maths.mount_parameters import MOUNT_WORDS, N_MOUNT
from pipeline.planning.prediction import Setting, predict

Array = NDArray[np.float64]
NEAR_M = 1.5  # passes whose distances differ by less are at one distance
WANTED_DEG, WANTED_M = 0.025, 0.0025  # larger random sigmas are worth another pass
TRIED_M = (3.0, 4.0, 5.0, 6.0, 8.0, 10.0)  # distances of passes that might help
TWICE = 2  # passes there
VAGUE = 1.0  # rad or m, of every unknown
SIDES = {"P1": "the faces on the -y side (P1)", "P3": "the faces on the +y side (P3)", "P2": "the wall (P2)"}
HORIZONTAL = (
    "the sonar sees no horizontal face: only the boat's rolling and pitching tell its height, and a still boat tells "
    "nothing"
)


@dataclass(frozen=True)
class Seen:
    """What a session had: distances of its passes, number of soundings by family; the families that are horizontal."""

    distances_m: Sequence[float]
    soundings: Mapping[str, int]
    level: Collection[str]
    speed_m_s: float
    heading_swing_deg: float


@dataclass(frozen=True)
class Geometry:
    """``gaps``: what the passes lack, each in words; ``remedy``: what to sail, with what it would bring."""

    gaps: list[str]
    remedy: str


def geometry_of(setting: Setting, seen: Seen, normal: Array, solution: Solution) -> Geometry:
    """``normal`` (u, u): the session's."""
    bounds, gaps = np.repeat([np.radians(WANTED_DEG), WANTED_M], 3), _gaps(seen)
    sigma = _sigmas(normal, solution)
    pair = None if solution.deficiency else correlated_pair(solution.covariance[:N_MOUNT, :N_MOUNT])
    if not (gaps or np.any(sigma > bounds)):
        return Geometry([], "")  # where all are sure enough, two that move together do no harm
    among = range(N_MOUNT) if pair is None else pair[:2]
    target = max(among, key=lambda k: sigma[k] / bounds[k])
    return Geometry(gaps, _remedy(setting, seen, normal, solution, target, bounds))


def _sigmas(normal: Array, solution: Solution) -> Array:
    """Of the six (6,), with :data:`VAGUE` for what is known before any pass: finite where the data leave all open."""
    prior = np.zeros(len(normal))
    prior[solution.estimated] = VAGUE**-2
    known = solve(normal + np.diag(prior), np.zeros(len(normal)), solution.estimated.tolist())
    return np.asarray(np.sqrt(np.diag(known.covariance))[:N_MOUNT])


def _gaps(seen: Seen) -> list[str]:
    there = {family for family, count in seen.soundings.items() if count}
    upright = [family for family in seen.soundings if family not in seen.level]
    if len(there) == 1 and len(upright) > 1 and there <= set(upright):
        (family,) = there
        one = SIDES.get(family, family).removesuffix(f" ({family})")
        return [f"the sonar sees {one} alone: nothing tells where it is along it, or how high"]
    found = []
    missing = [SIDES.get(family, family) for family in upright if family not in there]
    if missing:
        found.append(f"the sonar sees nothing of {' and '.join(missing)}")
    if not there & set(seen.level):
        found.append(HORIZONTAL)
    low, high = min(seen.distances_m, default=0.0), max(seen.distances_m, default=0.0)
    if len(seen.distances_m) == 1:
        found.append(f"one pass alone has soundings, at {low:.1f} m: nothing shows whether another would agree")
    elif seen.distances_m and high - low < NEAR_M:
        found.append(
            f"all passes lie at {low:.1f} to {high:.1f} m, where yaw and lever arm y are hard to tell apart"
        )
    return found


def _remedy(
    setting: Setting,
    seen: Seen,
    normal: Array,
    solution: Solution,
    target: int,
    bounds: Array,
) -> str:
    """The distance at which two more passes would help most, and by how much; empty if none halves the sigma."""
    before = float(_sigmas(normal, solution)[target])
    best: tuple[float, float, float] | None = None
    for distance in TRIED_M:
        one = Pass(distance_m=distance, speed_m_s=seen.speed_m_s, heading_swing_deg=seen.heading_swing_deg)
        further = predict(setting, [one], phases=1).normal
        after = solve(normal + TWICE * further, np.zeros(len(normal)), solution.estimated.tolist())
        if after.deficiency:
            continue
        sigma = np.sqrt(np.diag(after.covariance))[:N_MOUNT]
        worst = float(np.max(sigma / bounds))
        if best is None or worst < best[0]:
            best = worst, distance, float(sigma[target])
    if best is None or best[2] > before / 2:
        return ""
    was = "open" if before > VAGUE / 2 else _sized(before, target)
    now = _sized(best[2], target)
    return f"two more passes at {best[1]:.0f} m would bring sigma {MOUNT_WORDS[target]} from {was} to {now}"


def _sized(sigma: float, which: int) -> str:
    return f"{np.degrees(sigma):.3f}°" if which < 3 else f"{1000 * sigma:.1f} mm"


