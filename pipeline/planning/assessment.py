"""A plan judged: predicted sigmas, usable points, what is lacking; and within a budget the better list of passes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.consider import considered_of, correlated
from pipeline.adjustment.iteration import free_unknowns
from pipeline.config.instruments import deep_merge
from pipeline.config.plan import Budget, Pass, Plan
from pipeline.config.pool import PoolConfig, Verdict
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.maths.adjustment.parameters import SIX
from pipeline.maths.adjustment.solution import Solution, solve, weakest_direction
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import mount_of
from pipeline.planning.observability import VAGUE, Seen, geometry_of
from pipeline.planning.prediction import Predicted, Setting, predict, state_by_design
from pipeline.target.design import target_of

Array = NDArray[np.float64]
MOST_PASSES = 100


@dataclass(frozen=True)
class Outlook:
    """What a list of passes will give; covariances (6, 6), NaN where a direction is left open."""

    passes: tuple[Pass, ...]
    predicted: Predicted
    random: Array
    total: Array
    solution: Solution

    @property
    def seconds(self) -> float:
        return sum(self.predicted.seconds)

    def each(self) -> Iterator[tuple[Pass, float, dict[str, Array]]]:
        """Passes with their time (s) and the points of each sensor by face."""
        return zip(self.passes, self.predicted.seconds, self.predicted.points, strict=True)


@dataclass(frozen=True)
class Answer:
    """The list as given; gaps and remedy; and the better list, where candidates and a budget are given."""

    setting: Setting
    given: Outlook
    gaps: list[str]
    remedy: str
    better: Outlook | None

    @property
    def weakest(self) -> str:
        """Which of the six are hardest to tell apart, in words; empty where there is no result."""
        return "" if self.given.solution.deficiency else weakest_direction(self.given.random)


def setting_of(plan: Plan, pool: PoolConfig, session: SessionConfig) -> Setting:
    model = target_of(pool.target)
    state = state_by_design(model, session.sonar)
    return Setting(model, state, plan, pool.segment, session.ins, session.laser, session.sonar)


def load_plan(path: Path, session: SessionConfig) -> Plan:
    """A plan that can be sailed, with the sonar under water; rates that it leaves out are those of the instruments."""
    plan = parse(Plan, deep_merge(_rates(session), read_yaml(path)), str(path))
    sonar = plan.ins_height_m + session.sonar.mount.z_m
    if sonar >= 0:
        raise ConfigError(
            f"{path}: ins_height_m = {plan.ins_height_m:g}: with mbes.mount.z_m = {session.sonar.mount.z_m:g} the "
            f"sonar is {sonar:.2f} m above the water; give the height of the INS above the water"
        )
    return plan


def _rates(session: SessionConfig) -> dict[str, Any]:
    """What the session's instruments can do, as a plan says it."""
    ins, laser, mbes = (
        one.instrument.model_dump(mode="json")["rates"] if one.instrument else {}
        for one in (session.ins, session.laser, session.sonar)
    )
    return {**ins, "laser": laser, "mbes": mbes}


def judge(plan: Plan, pool: PoolConfig, session: SessionConfig) -> Answer:
    setting = setting_of(plan, pool, session)
    depth = setting.model.depth_m
    considered = considered_of(setting.state.names, session.laser, session.sonar, pool.as_built, depth)
    turn_s = plan.budget.turn_s if plan.budget is not None else Budget.model_fields["turn_s"].default
    free = free_unknowns(setting.state, pool.adjust.free)
    given = _outlook(setting, plan.passes, turn_s, considered, free)
    speeds, swings = (np.median([getattr(p, name) for p in plan.passes]) for name in ("speed_m_s", "heading_swing_deg"))
    distances = [one.distance_m for one, _, points in given.each() if points["mbes"].any()]
    level = {family.name for family in setting.model.families if family.level}
    seen = Seen(distances, soundings(setting, given), level, float(speeds), float(swings))
    geometry = geometry_of(setting, seen, given.predicted.normal, given.solution)
    better = None
    if plan.candidates and plan.budget is not None:
        better = _better(setting, plan.candidates, plan.budget.seconds, plan.budget.turn_s, considered, free)
    return Answer(setting, given, [*_blind(given), *geometry.gaps], geometry.remedy, better)


def _outlook(
    setting: Setting, passes: Sequence[Pass], turn_s: float, considered: Array, free: list[int]
) -> Outlook:
    predicted = predict(setting, passes, turn_s)
    normal = predicted.normal
    solution = solve(normal, np.zeros(len(normal)), free)
    together = correlated(setting.state.names, setting.laser)
    random, total = solution.covariance[:SIX, :SIX], solution.total(considered, *together)[:SIX, :SIX]
    if solution.deficiency:
        random, total = np.full((SIX, SIX), np.nan), np.full((SIX, SIX), np.nan)
    return Outlook(tuple(passes), predicted, random, total, solution)


def _blind(outlook: Outlook) -> list[str]:
    """Passes from which a sensor does not see the target."""
    found = []
    for sensor, name in (("laser", "laser"), ("mbes", "sonar")):
        far = [f"{one.distance_m:g} m" for one, _, points in outlook.each() if not points[sensor].any()]
        if far:
            found.append(f"the {name} sees nothing of the target from {', '.join(dict.fromkeys(far))}")
    return found


def soundings(setting: Setting, outlook: Outlook) -> dict[str, int]:
    """By family, over all passes."""
    families = [face.family for face in setting.model.faces]
    total = dict.fromkeys(families, 0.0)
    for points in outlook.predicted.points:
        for family, count in zip(families, points["mbes"], strict=True):
            total[family] += float(count)
    return {family: round(count) for family, count in total.items()}


def _better(
    setting: Setting, candidates: Sequence[Pass], seconds: float, turn_s: float, considered: Array, free: list[int]
) -> Outlook | None:
    """Pass after pass the candidate that brings most for its time, as long as there is time; None: not even for one.

    A candidate may be taken more than once. What is brought down is the mean square of the six sigmas, angles against
    lengths as the verdict's usual limits.
    """
    predicted = [predict(setting, [one], phases=1) for one in candidates]
    usual = Verdict()
    bounds = np.repeat([np.radians(usual.max_sigma_deg), usual.max_sigma_m], 3)
    vague = np.zeros((setting.state.size, setting.state.size))
    vague[free, free] = VAGUE**-2

    def cost(normal: Array) -> float:
        covariance = solve(vague + normal, np.zeros(len(normal)), free).covariance[:SIX, :SIX]
        return float(np.mean(np.diag(covariance) / bounds**2))

    chosen: list[int] = []
    normal, left = np.zeros_like(vague), seconds
    while True:
        now = cost(normal)
        gains = []
        for number, one in enumerate(predicted):
            needed = one.seconds[0] + (turn_s if chosen else 0.0)
            if needed <= left:
                gains.append((np.log(now / cost(normal + one.normal)) / needed, -number))
        if not gains or max(gains)[0] <= 0 or len(chosen) == MOST_PASSES:
            break
        number = -max(gains)[1]
        left -= predicted[number].seconds[0] + (turn_s if chosen else 0.0)
        normal = normal + predicted[number].normal
        chosen.append(number)
    if not chosen:
        return None
    return _outlook(setting, [candidates[k] for k in chosen], turn_s, considered, free)


def as_plain(answer: Answer) -> dict[str, Any]:
    """All of it as plain values, for YAML."""
    found: dict[str, Any] = {"given": _plain_outlook(answer.setting, answer.given)}
    found |= {"gaps": answer.gaps, "weakest": answer.weakest, "remedy": answer.remedy}
    if answer.better is not None:
        found["better"] = _plain_outlook(answer.setting, answer.better)
    return found


def _plain_outlook(setting: Setting, outlook: Outlook) -> dict[str, Any]:
    mounted = mount_of(setting.mbes.mount)
    known = not outlook.solution.deficiency
    sigma = np.sqrt(np.diag(outlook.random))
    return {
        "passes": [
            one.model_dump(mode="json", exclude_none=True)
            | {"seconds": round(seconds, 1), "points": _faces(setting, points)}
            for one, seconds, points in outlook.each()
        ],
        "sigma_mount": mounted.sigmas(outlook.random) if known else None,
        "sigma_mount_total": mounted.sigmas(outlook.total) if known else None,
        "correlation": (outlook.random / np.outer(sigma, sigma)).tolist() if known else None,
        "condition": outlook.solution.condition if known else None,
    }


def _faces(setting: Setting, points: dict[str, Array]) -> dict[str, dict[str, int]]:
    """Points by sensor and name of face, those with any."""
    return {
        sensor: {face.name: round(float(n)) for face, n in zip(setting.model.faces, count, strict=True) if n}
        for sensor, count in points.items()
    }


def shares_of_limits(setting: Setting, outlook: Outlook, limits: Verdict) -> dict[str, float]:
    """Total sigma ÷ the verdict's limit, by parameter; NaN where a direction stays open."""
    sigma = mount_of(setting.mbes.mount).sigmas(outlook.total)
    bounds = {"deg": limits.max_sigma_deg, "m": limits.max_sigma_m}
    return {name: sigma[key] / bounds[unit] for name, _, key, unit in PARAMETERS}


def is_enough(answer: Answer, limits: Verdict) -> bool:
    """Whether the list as given will keep the total sigmas below the verdict's limits."""
    if answer.given.solution.deficiency:
        return False
    return all(share <= 1 for share in shares_of_limits(answer.setting, answer.given, limits).values())
