"""Gaps in the geometry of passes, in words, and the further passes that would help most."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.plan import Pass
from pipeline.maths.adjustment.solution import Solution, correlated_pair, solve
from pipeline.maths.mount_parameters import MOUNT_WORDS, N_MOUNT
from pipeline.planning.prediction import predict
from pipeline.planning.setting import PredictionSetting

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
NEAR_M = 1.5  # distances that differ by less count as one
WANTED_DEG, WANTED_M = 0.025, 0.004  # a larger random sigma is worth another pass
WANTED = np.repeat([np.radians(WANTED_DEG), WANTED_M], 3)
TRIED_M = (3.0, 4.0, 5.0, 6.0, 8.0, 10.0)  # distances of passes that might help
STRAIGHT_DEG = 5.0  # largest swing of the heading on a straight pass; a boat that turns swings by more
TWICE = 2  # number of further passes at such a distance
VAGUE = 1.0  # rad or m: prior sigma of every parameter
SIDES = {"P1": "the faces on the -y side (P1)", "P3": "the faces on the +y side (P3)", "P2": "the wall (P2)"}
ONE_WALL = (
    "both sensors see one wall alone: pitch, yaw and lever arm y rest on the boat's unrest; pass a corner, a recess or "
    "stairs, too, turned from it by 30° to 60°, or go to a place that has one"
)
HORIZONTAL = (
    "no horizontal face is seen by both sensors: only the boat's rolling and pitching determine the sonar's height, "
    "and a still boat leaves it open"
)


def vague_information(size: int, numbers: Integers | Sequence[int] | slice) -> Array:
    """Return a normal matrix (u, u) that knows these of u parameters to :data:`VAGUE`."""
    weight = np.zeros(size)
    weight[numbers] = VAGUE**-2
    return np.diag(weight)


@dataclass(frozen=True)
class Coverage:
    """Coverage of the target by the passes of a session or of a plan.

    Attributes
    ----------
    distances_m : Sequence[float]
        Distances of the passes with soundings.
    soundings : Mapping[str, int]
        Number of soundings by family of faces, of those that both sensors see: others tie the sonar to nothing.
    level, sloping : Collection[str]
        Names of the horizontal families, and of those that lean so far that they tell a height, too.
    speed_m_s, heading_swing_deg : float
        Speed of a typical pass, and amplitude of its heading.
    """

    distances_m: Sequence[float]
    soundings: Mapping[str, int]
    level: Collection[str]
    sloping: Collection[str]
    speed_m_s: float
    heading_swing_deg: float


@dataclass(frozen=True)
class GeometryAdvice:
    """Advice in words: ``gaps`` in the geometry, and a ``remedy``, which names further passes and their effect."""

    gaps: list[str]
    remedy: str


def geometry_advice(
    setting: PredictionSetting, coverage: Coverage, normals: Sequence[Array], solution: Solution
) -> GeometryAdvice:
    """Return the gaps in the geometry of the passes, and the further passes that would help.

    Parameters
    ----------
    setting : PredictionSetting
        Target and instruments.
    coverage : Coverage
        Coverage of the target by the passes.
    normals : Sequence[ndarray], each of shape (u, u)
        Normal matrix of the passes (rad, m), by phase of the boat's unrest; of a session there is one.
    solution : Solution
        Solution of these normal equations: of their mean, or of a phase that tells less.
    """
    determined = _Determined(normals, solution, setting.state.surface_slice)
    gaps, sigma = _gaps(coverage), determined.sigmas()
    pair = None if solution.deficiency else correlated_pair(solution.covariance[:N_MOUNT, :N_MOUNT])
    if not (gaps or np.any(sigma > WANTED)):
        return GeometryAdvice([], "")  # with small sigmas a high correlation does no harm
    choice = range(N_MOUNT) if pair is None else pair[:2]
    parameter = max(choice, key=lambda k: sigma[k] / WANTED[k])
    return GeometryAdvice(gaps, _remedy(setting, coverage, determined, parameter))


@dataclass(frozen=True)
class _Determined:
    """Information from the passes: normal matrices (u, u) by phase, with prior information, and their solution.

    The solution is their mean's, or that of a phase that tells less. ``surfaces``: the numbers of the planes'
    parameters. A phase that does not show a plane leaves it vague.
    """

    normals: Sequence[Array]
    solution: Solution
    surfaces: slice

    def sigmas(self) -> Array:
        """Return the sigmas of the mount parameters (6,) from noise alone, rad and m, in the mean over the phases.

        Every parameter has the prior sigma :data:`VAGUE`, so the sigmas are finite even if a direction is open.
        """
        vague = vague_information(len(self.normals[0]), self.solution.estimated)
        return _noise_sigmas([self._solved(normal + vague) for normal in self.normals])

    def with_passes(self, further: Array) -> Array | None:
        """Return the same with the normal matrix (u, u) of further passes added; None if a direction remains open."""
        vague = vague_information(len(further), self.surfaces)
        phases = [self._solved(normal + vague + further) for normal in self.normals]
        average = self._solved(np.mean(self.normals, axis=0) + further)
        return None if any(one.deficiency for one in (average, *phases)) else _noise_sigmas(phases)

    def _solved(self, normal: Array) -> Solution:
        estimated, size = self.solution.estimated, len(normal)
        prior = np.zeros((size, size))
        prior[np.ix_(estimated, estimated)] = self.solution.prior
        return solve(normal, np.zeros(size), estimated.tolist(), prior)


def _noise_sigmas(phases: Sequence[Solution]) -> Array:
    """Return the sigmas (6,) of the mount parameters from noise alone, rad and m, by their mean variances."""
    variances = [np.diag(one.noise_covariance())[:N_MOUNT] for one in phases]
    return np.asarray(np.sqrt(np.maximum(np.mean(variances, axis=0), 0.0)))


def _gaps(coverage: Coverage) -> list[str]:
    """Return the gaps in the geometry, each in words."""
    there = {family for family, count in coverage.soundings.items() if count}
    upright = [family for family in coverage.soundings if family not in coverage.level]
    if len(there) == 1 and len(upright) > 1 and there <= set(upright):
        (family,) = there
        side = SIDES.get(family, family).removesuffix(f" ({family})")
        return [f"the sonar sees {side} alone: its place along it and its height are undetermined"]
    gaps = [ONE_WALL] if len(upright) == 1 and there == set(upright) else []
    missing = [SIDES.get(family, family) for family in upright if family not in there]
    if missing:
        gaps.append(f"the sonar sees nothing of {' and '.join(missing)}")
    if not there & {*coverage.level, *coverage.sloping}:
        gaps.append(HORIZONTAL)
    low, high = min(coverage.distances_m, default=0.0), max(coverage.distances_m, default=0.0)
    if len(coverage.distances_m) == 1:
        gaps.append(f"one pass alone has soundings, at {low:.1f} m: nothing shows whether another would agree")
    elif coverage.distances_m and high - low < NEAR_M:
        gaps.append(f"all passes lie at {low:.1f} to {high:.1f} m, where yaw and lever arm y are strongly correlated")
    return gaps


def _remedy(setting: PredictionSetting, coverage: Coverage, determined: _Determined, parameter: int) -> str:
    """Return a sentence with the distance at which two more passes would help most.

    It names the sigma of one mount ``parameter`` without and with them. It is empty if they do not halve this sigma.
    """
    before = float(determined.sigmas()[parameter])
    swing_deg = min(coverage.heading_swing_deg, STRAIGHT_DEG)  # what is advised is a straight pass
    best: tuple[float, float, float] | None = None
    for distance in TRIED_M:
        planned = Pass(distance_m=distance, speed_m_s=coverage.speed_m_s, heading_swing_deg=swing_deg)
        sigma = determined.with_passes(TWICE * predict(setting, [planned], phases=1).normal)
        if sigma is None:
            continue
        worst = float(np.max(sigma / WANTED))
        if best is None or worst < best[0]:
            best = worst, distance, float(sigma[parameter])
    if best is None or best[2] > before / 2:
        return ""
    one_open = VAGUE / 2 / np.sqrt(len(determined.normals))  # if one phase alone leaves it open
    was = "open" if before > one_open else _sized(before, parameter)
    now = _sized(best[2], parameter)
    return f"two more passes at {best[1]:.0f} m would bring sigma {MOUNT_WORDS[parameter]} from {was} to {now}"


def _sized(sigma: float, which: int) -> str:
    return f"{np.degrees(sigma):.3f}°" if which < 3 else f"{1000 * sigma:.1f} mm"
