"""Assessment of a plan: sigmas, points on the target, gaps in the geometry, and a better list of passes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.consider import known_parameters, sonar_errors
from pipeline.adjustment.problem import faces_on_surfaces
from pipeline.adjustment.weighted_iteration import estimated_columns
from pipeline.adjustment.wet_errors import outward_of
from pipeline.config.instruments import deep_merge
from pipeline.config.plan import Budget, Pass, Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.verdict import VerdictLimits
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.limits.verdict_limits import largest_sigmas, limits_by_setting, soundings_too_uncertain
from pipeline.maths.adjustment.solution import ConsiderErrors, Solution, solve, weakest_direction
from pipeline.maths.mount_parameters import N_MOUNT, PARAMETERS
from pipeline.mount import mount_of
from pipeline.planning.observability import Coverage, geometry_advice, vague_information
from pipeline.planning.prediction import PredictedPasses, predict
from pipeline.planning.setting import PredictionSetting, setting_of

Array = NDArray[np.float64]
MOST_PASSES = 100


@dataclass(frozen=True)
class Accuracy:
    """Predicted accuracy of a calibration from a list of passes.

    Attributes
    ----------
    passes : tuple[Pass, ...]
        The list of passes.
    predicted : PredictedPasses
        Predicted normal equations, points and times of the passes.
    random, total : ndarray, shape (6, 6)
        Covariances of the mount (rad, m): from noise alone, and with the consider parameters, in the mean over the
        phases of the boat's unrest. They are NaN if the passes leave a direction open.
    solution : Solution
        Solution of the average normal equations; if a phase leaves more directions open, of that phase.
    """

    passes: tuple[Pass, ...]
    predicted: PredictedPasses
    random: Array
    total: Array
    solution: Solution

    @property
    def seconds(self) -> float:
        """Time of all passes (s), without the turns between them."""
        return sum(self.predicted.seconds)

    def each(self) -> Iterator[tuple[Pass, float, dict[str, Array]]]:
        """Return an iterator over the passes: each pass, its time (s), and the points (f,) on the faces by sensor."""
        return zip(self.passes, self.predicted.seconds, self.predicted.points, strict=True)


@dataclass(frozen=True)
class PlanAssessment:
    """Result of the assessment of a plan.

    Attributes
    ----------
    setting : PredictionSetting
        Target and instruments.
    given : Accuracy
        Accuracy of the passes in the plan.
    gaps : list[str]
        Gaps in the geometry of these passes, in words.
    remedy : str
        Further passes that would help, in words.
    better : Accuracy or None
        Accuracy of the better list, if the plan has candidates and a budget.
    """

    setting: PredictionSetting
    given: Accuracy
    gaps: list[str]
    remedy: str
    better: Accuracy | None

    @property
    def weakest(self) -> str:
        """The mount parameters that are hardest to separate, in words; empty if a direction is open."""
        return "" if self.given.solution.deficiency else weakest_direction(self.given.random)


@dataclass(frozen=True)
class _Adjustment:
    """Inputs of an adjustment of predicted passes, apart from the passes.

    ``turn_s``: time of a turn; ``considered``: errors of the fixed parameters; ``free``: numbers of the estimated
    parameters; ``prior`` (u, u): normal matrix of what is known of them beforehand.
    """

    setting: PredictionSetting
    turn_s: float
    considered: ConsiderErrors
    free: list[int]
    prior: Array

    def accuracy(self, passes: Sequence[Pass]) -> Accuracy:
        """Return the predicted accuracy of a calibration from these passes.

        Each phase of the boat's unrest is a session that may come. So their covariances are averaged. (That of the
        average normal matrix is smaller: all phases together tell more of a plane than one. At a pier of sheet piling,
        the sigma of z came out a seventh too small.) A phase that tells nothing of a plane leaves it, and
        what it alone tells, vague; one that leaves the mount open leaves the plan without a result.
        """
        predicted = predict(self.setting, passes, self.turn_s, single_faces=True)
        prior = np.pad(self.prior, (0, len(predicted.normals[0]) - len(self.prior)))
        vague = vague_information(len(prior), self.setting.state.surface_slice)
        average, *phases = (
            solve(normal + prior, np.zeros(len(prior)), self.free, prior)
            for normal in (predicted.normal, *(one + vague for one in predicted.normals))
        )
        solution = max(average, *phases, key=lambda one: one.deficiency)  # the average's, unless a phase tells less
        random = np.mean([one.noise_covariance()[:N_MOUNT, :N_MOUNT] for one in phases], axis=0)
        total = np.mean([one.total_covariance(self.considered)[:N_MOUNT, :N_MOUNT] for one in phases], axis=0)
        if solution.deficiency:
            random, total = np.full((N_MOUNT, N_MOUNT), np.nan), np.full((N_MOUNT, N_MOUNT), np.nan)
        return Accuracy(tuple(passes), predicted, random, total, solution)


def load_plan(path: Path, session: SessionConfig) -> Plan:
    """Return the plan of a YAML file. Rates that it does not set are those of the session's instruments.

    Raises
    ------
    ConfigError
        The file is no plan, or the sonar would be above the water.
    """
    plan = parse(Plan, deep_merge(_rates(session), read_yaml(path)), str(path))
    sonar = plan.ins_height_m + session.sonar.mount.z_m
    if sonar >= 0:
        raise ConfigError(
            f"{path}: ins_height_m = {plan.ins_height_m:g}: with mbes.mount.z_m = {session.sonar.mount.z_m:g} the "
            f"sonar is {sonar:.2f} m above the water; give the height of the INS above the water"
        )
    return plan


def _rates(session: SessionConfig) -> dict[str, Any]:
    """Return the rates of the session's instruments, in the keys of a plan."""
    ins, laser, mbes = (
        block.instrument.model_dump(mode="json")["rates"] if block.instrument else {}
        for block in (session.ins, session.laser, session.sonar)
    )
    return {**ins, "laser": laser, "mbes": mbes}


def assess_plan(plan: Plan, pool: PoolConfig, session: SessionConfig) -> PlanAssessment:
    """Return the assessment of a plan.

    Parameters
    ----------
    plan : Plan
        The passes, and, if set, candidates and a budget.
    pool : PoolConfig
        The pool's settings.
    session : SessionConfig
        The session's settings: mounts and sigmas.
    """
    setting = setting_of(plan, pool, session)
    depth = setting.model.depth_m
    faces = faces_on_surfaces(setting.model.faces, setting.state)
    names = (*setting.state.names, *faces.parameters)
    outward = outward_of(faces, setting.state)
    considered = sonar_errors(names, session.laser, {"mbes": session.sonar}, pool.as_built, outward, depth)
    turn_s = plan.budget.turn_s if plan.budget is not None else Budget.model_fields["turn_s"].default
    free, prior = estimated_columns(setting.state, pool.adjust.free), np.zeros((setting.state.size, setting.state.size))
    known = known_parameters(setting.state, considered, pool.adjust.free)
    if known is not None:
        free, prior = sorted({*free, *known.numbers.tolist()}), known.pseudo_observations(setting.state).normal
    adjustment = _Adjustment(setting, turn_s, considered, free, prior)
    given = adjustment.accuracy(plan.passes)
    speeds, swings = (np.median([getattr(p, name) for p in plan.passes]) for name in ("speed_m_s", "heading_swing_deg"))
    coverage = Coverage(
        distances_m=[planned.distance_m for planned, _, points in given.each() if points["mbes"].any()],
        soundings={
            family: count
            for family, count in soundings_by_family(setting, given).items()
            if family in setting.model.tied_families
        },
        level={family.name for family in setting.model.families if family.level},
        sloping={family.name for family in setting.model.families if family.sloping},
        speed_m_s=float(speeds),
        heading_swing_deg=float(swings),
    )
    size = setting.state.size
    normals = [normal[:size, :size] + prior for normal in given.predicted.normals]
    advice = geometry_advice(setting, coverage, normals, given.solution)
    better = None
    if plan.candidates and plan.budget is not None:
        better = _best_within_budget(adjustment, plan.candidates, plan.budget.seconds, pool.verdict)
    return PlanAssessment(setting, given, [*_blind_passes(given), *advice.gaps], advice.remedy, better)


def _blind_passes(accuracy: Accuracy) -> list[str]:
    """Return sentences that name the passes in which a sensor does not see the target."""
    sentences = []
    for sensor, name in (("laser", "laser"), ("mbes", "sonar")):
        far = [planned.where for planned, _, points in accuracy.each() if not points[sensor].any()]
        if far:
            sentences.append(f"the {name} sees nothing of the target from {', '.join(dict.fromkeys(far))}")
    return sentences


def soundings_by_family(setting: PredictionSetting, accuracy: Accuracy) -> dict[str, int]:
    """Return the number of soundings on each family of faces, over all passes."""
    families = [face.family for face in setting.model.faces]
    total = dict.fromkeys(families, 0.0)
    for points in accuracy.predicted.points:
        for family, count in zip(families, points["mbes"], strict=True):
            total[family] += float(count)
    return {family: round(count) for family, count in total.items()}


def _best_within_budget(
    adjustment: _Adjustment, candidates: Sequence[Pass], seconds: float, limits: VerdictLimits
) -> Accuracy | None:
    """Return the accuracy of the list of candidates that helps most; None if there is no time for any.

    The list grows by one candidate at a time: the one that reduces the mean square of the six sigmas most for its time.
    Each sigma is divided by its limit of the verdict. A candidate may be chosen more than once.
    """
    setting, free, turn_s = adjustment.setting, adjustment.free, adjustment.turn_s
    predicted = [predict(setting, [candidate], phases=1) for candidate in candidates]
    bounds = largest_sigmas(limits)
    vague = vague_information(setting.state.size, free) + adjustment.prior

    def cost(normal: Array) -> float:
        covariance = solve(vague + normal, np.zeros(len(normal)), free).covariance[:N_MOUNT, :N_MOUNT]
        return float(np.mean(np.diag(covariance) / bounds**2))

    chosen: list[int] = []
    normal, left = np.zeros_like(vague), seconds
    while True:
        now = cost(normal)
        gains = []
        for number, candidate in enumerate(predicted):
            needed = candidate.seconds[0] + (turn_s if chosen else 0.0)
            if needed <= left:
                gains.append((np.log(now / cost(normal + candidate.normal)) / needed, -number))
        if not gains or max(gains)[0] <= 0 or len(chosen) == MOST_PASSES:
            break
        number = -max(gains)[1]
        left -= predicted[number].seconds[0] + (turn_s if chosen else 0.0)
        normal = normal + predicted[number].normal
        chosen.append(number)
    return adjustment.accuracy([candidates[k] for k in chosen]) if chosen else None


def shares_of_limits(setting: PredictionSetting, accuracy: Accuracy, limits: VerdictLimits) -> dict[str, float]:
    """Return each parameter's total sigma, divided by the verdict's limit; NaN if a direction is open.

    Parameters
    ----------
    setting : PredictionSetting
        Target and instruments.
    accuracy : Accuracy
        Accuracy of a list of passes.
    limits : VerdictLimits
        Limits of the verdict.
    """
    sigma = mount_of(setting.mbes.mount).sigmas(accuracy.total)
    largest = limits_by_setting(limits)
    return {name: sigma[key] / largest[key] for name, _, key, _ in PARAMETERS}


def is_enough(assessment: PlanAssessment, limits: VerdictLimits) -> bool:
    """Return whether the plan's passes will keep all total sigmas, and soundings, within the verdict's limits."""
    if assessment.given.solution.deficiency or soundings_too_uncertain(limits, assessment.given.total):
        return False
    return all(share <= 1 for share in shares_of_limits(assessment.setting, assessment.given, limits).values())
