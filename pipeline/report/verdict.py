"""Accepted or rejected, and why: each reason names its evidence."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from pipeline.config.pool import Method, Verdict
from pipeline.config.session import Drift
from pipeline.console import plural
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS
from pipeline.report.residual_tests import Tables, off
from pipeline.report.suspected_causes import causes, estimated

WORDS_OF_GROUP = {
    "laser": "laser points",
    "mbes_vertical": "soundings on vertical faces",
    "mbes_horizontal": "soundings on horizontal faces",
}
SHARED = {
    "ins_white": "the INS's poses scatter from record to record {:.1f} times as much as ins.white says: its filter, or "
    "the laser's clock",
    "ping": "whole pings scatter {:.1f} times as much as ins.white says: the sonar's clock, or stabilised beams",
}
ODD_FACTOR = 2.0  # a variance factor above this, or below its inverse, is worth a look
ODD_COMMON = 4.0  # the same of what an epoch's points share: less is a good INS
ODD_CUT = 0.01  # and so is a share of cut observations above this
ODD_OFFSET_M, ODD_TILT_DEG = 0.1, 0.1  # and a target found so far off
NO_DRIFT = "ins.drift concedes the INS no drift at all: give its figures before anything else is looked for"
ODD_DRIFT = 1.2  # drift found, in sigmas of ins.drift
FEWEST = 30  # soundings on a family of faces


@dataclass(frozen=True)
class Evidence:
    """The tables that a verdict looks at."""

    faces: pd.DataFrame
    target_pose: pd.DataFrame
    provisional_mount: pd.DataFrame
    corrections: pd.DataFrame
    summary: pd.DataFrame
    cells: pd.DataFrame
    geometry: pd.DataFrame
    freed: pd.DataFrame
    patterns: pd.DataFrame


@dataclass(frozen=True)
class Settings:
    """What it is judged by: limits of the sigmas, level of the tests and what they tolerate, the method that is the
    result; ``farthest``: angle (degrees) and lever arm (m) beyond which no mount is taken for labelling;
    ``drift_doubt``: what speaks against the session's ins.drift, or nothing; ``shape``: the settings that give the
    target's shape, ``sides``: that which tells its left from its right; ``asked``: what to do about angles of a mount
    far off that were measured right, said where nothing else is in doubt."""

    limits: Verdict
    test_level: float
    tolerated_m: float
    chosen: Method
    farthest: tuple[float, float]
    drift_doubt: str
    shape: str
    calibrated: Literal["mbes", "laser"] = "mbes"
    sides: str = "the target's left and right"
    asked: str = ""


def reasons(evidence: Evidence, methods: Mapping[str, Mapping[str, Any]], settings: Settings) -> list[str]:
    """Why the calibration is rejected; empty: accepted. Where labels are in doubt, nothing else is judged."""
    limits, chosen = settings.limits, settings.chosen
    doubts = _ambiguities(evidence, settings)
    if doubts:
        return doubts
    found = []
    summary, cells = evidence.summary.iloc[0], evidence.cells
    if summary["reason"]:
        return [f"the adjustment has no result: {'; '.join([summary['reason'], *evidence.geometry['words']])}"]
    if not summary["converged"]:
        found.append(f"the adjustment did not converge in {summary['iterations']} steps")
    found += _few(cells)
    names = evidence.faces["name"].tolist()
    tests = off(Tables(evidence.patterns, names, settings.shape, settings.tolerated_m), settings.test_level)
    likely = _causes(evidence.freed, any(one.alone for one in tests))
    found += [one.words for one in tests]
    if (tests or likely) and settings.drift_doubt:
        found.append(settings.drift_doubt)
    found += likely + _away(evidence.freed)
    held = set(evidence.geometry.loc[evidence.geometry["kind"] == "held", "words"])
    if len(held) == len(PARAMETERS):
        found.append("none of the six can be found: this target and these passes cannot give any within its limit")
    found += _wide_sigmas(methods["adjustment"]["sigma_mount_total"], limits, held)
    if chosen != "adjustment":
        found += _patent(chosen, evidence.corrections.set_index("method").loc[chosen], methods, limits)
    return found


def _ambiguities(evidence: Evidence, settings: Settings) -> list[str]:
    found, farthest, shape = [], settings.farthest, settings.shape
    pose, mount = evidence.target_pose.iloc[0], evidence.provisional_mount.iloc[0]
    if pose["ambiguous"]:
        better = pose["rival_agreement_m2"] > pose["agreement_m2"]
        how = "better" if better else "nearly as well"
        remedy = "check" if better else "let the laser see the wall's top edge; check"
        sides = str(pose["rival"]).startswith("left and right exchanged")
        remedy += f" {settings.sides} first, then" if sides and better else ""
        found.append(
            f"the target's pose is ambiguous: '{pose['rival']}' fits the laser points {how} "
            f"({pose['rival_agreement_m2']:.2f} against {pose['agreement_m2']:.2f} m²); {remedy} target.origin (a "
            f"height wrong by e or 2 e, half a period or a whole one, does this), azimuth_deg, and {shape}; poolcal "
            "check tells which"
        )
    if not pose["within"]:
        found.append(
            "no pose of the target within the search limits fits the laser points: target.origin or target.azimuth_deg "
            "is farther off than segment.search_... allow; poolcal check tells by how much"
        )
    if not mount["within"] and settings.calibrated == "laser":
        found.append(
            f"no mount of the laser within {farthest[0]:g}° of the coarse one brings its points onto the "
            f"target{_beyond(mount, farthest)}: laser.mount is farther off than segment.search_laser_deg allows, or "
            f"{shape} are wrong"
        )
    elif not mount["within"]:
        beyond = _beyond(mount, farthest)
        angles_alone = "°" in beyond and " m" not in beyond and not mount["ambiguous"]
        asked = settings.asked if angles_alone and not found else ""
        found.append(
            f"no mount within {farthest[0]:g}° and {farthest[1]:g} m of the coarse one brings the soundings onto the "
            f"target{beyond}: mbes.mount is farther off than segment.search_mount_deg and "
            f"search_mount_m allow (a sign, an axis, a block of 2 e), {shape} are wrong, or the clocks differ (UTC is "
            f"18 s behind GPS time): poolcal check tells which sign, clock or height it is{asked}"
        )
    if mount["ambiguous"]:
        found.append(
            f"the soundings fit two ways (score {mount['rival_score']:.3f} against {mount['score']:.3f}): the coarse "
            "mount may be a block off; measure the coarse lever arm again"
        )
    return found


def _beyond(mount: pd.Series, farthest: tuple[float, float]) -> str:
    """Where the mount that fits best lies outside of what is taken."""
    angles = [(float(mount[f"rotation_{axis}_deg"]), "°", farthest[0]) for axis in "xyz"]
    arms = [(float(mount[f"lever_arm_{axis}_m"]), " m", farthest[1]) for axis in "xyz"]
    named = zip(MOUNT_WORDS, angles + arms, strict=True)
    off = [f"{value:+.2f}{unit} in {name}" for name, (value, unit, limit) in named if abs(value) > limit]
    return f"; best fits {', '.join(off)}" if off else ""


def _few(cells: pd.DataFrame) -> list[str]:
    """Families with so few soundings that their labels cannot be trusted; with none at all they are not used."""
    count = cells[cells["sensor"] == "mbes"].groupby("family")["count"].sum()
    return [
        f"only {number} soundings lie on {family}: too few to trust; sail so that the fan covers it (poolcal check "
        "tells why so few hit it)"
        for family, number in count.items()
        if number < FEWEST
    ]


def _causes(freed: pd.DataFrame, alone: bool) -> list[str]:
    """The parameter that the residuals ask to be another, and how many more they would ask for instead; ``alone``: some
    points have been named that lie off by themselves, and may be all that it is."""
    found = causes(freed)
    if not found:
        return []
    others = f"; {plural(len(found) - 1, 'other parameter')} would explain it less well" if len(found) > 1 else ""
    unless = ", unless the face, step, pass or ping named above is itself the cause" if alone else ""
    return [f"likely cause of residuals{unless} ({found[0][1]:.0f} sigma): {found[0][0]}{others}"]


def _away(freed: pd.DataFrame) -> list[str]:
    """What was free and is not as the session says: the mount is right with that alone, and so is the survey."""
    return [
        f"adjust.free found {one.words}: the mount holds with that alone; correct it, there and in the survey, and run "
        "again"
        for one in estimated(freed)
        if one.far
    ]


def _wide_sigmas(sigma: Mapping[str, float] | None, limits: Verdict, held: Collection[str]) -> list[str]:
    if sigma is None:
        return ["the adjustment has no covariance"]
    bounds = {"deg": (limits.max_sigma_deg, "°"), "m": (limits.max_sigma_m, " m")}
    return [
        f"total sigma of {MOUNT_WORDS[place]} is {sigma[key]:.4g}{bounds[unit][1]}, above the limit of "
        f"{bounds[unit][0]:g}{bounds[unit][1]}"
        for name, place, key, unit in PARAMETERS
        if name not in held and not sigma[key] <= bounds[unit][0]
    ]


def _patent(chosen: str, row: Any, methods: Mapping[str, Mapping[str, Any]], limits: Verdict) -> list[str]:
    """The patent's forms have no sigma: they must have converged and agree with the adjustment to the limits."""
    if row["reason"]:
        return [f"{chosen} has no result: {row['reason']}"]
    if not row["converged"]:
        return [f"{chosen} did not converge in {row['iterations']} turns"]
    ours, theirs = methods[chosen]["correction"], methods["adjustment"]["correction"]
    bounds = {"rotation_vector_deg": (limits.max_sigma_deg, "°", 0), "lever_arm_m": (limits.max_sigma_m, " m", 3)}
    return [
        f"{chosen} differs from the adjustment by {a - b:+.4f}{unit} in {MOUNT_WORDS[first + k]}, "
        f"more than {limit:g}{unit}"
        for part, (limit, unit, first) in bounds.items()
        for k, (a, b) in enumerate(zip(ours[part], theirs[part], strict=True))
        if abs(a - b) > limit
    ]


def warnings(
    groups: pd.DataFrame, target: Mapping[str, Any], geometry: pd.DataFrame, sigma: Mapping[str, float] | None
) -> list[str]:
    """What does not reject a session, and still wants to be looked at before anyone leaves."""
    found = []
    for words in geometry.loc[geometry["kind"] == "gap", "words"]:
        found.append(f"{words}{_so(sigma)}")
    for row in groups.to_dict("records"):
        factor, cut = row["variance_factor"], row["cut"] / max(row["count"], 1)
        if row["group"] in SHARED:
            if factor > ODD_COMMON:
                found.append(SHARED[row["group"]].format(np.sqrt(factor)))
            continue
        name = WORDS_OF_GROUP[row["group"]]
        if (factor > ODD_FACTOR or factor < 1 / ODD_FACTOR):
            how = "more" if factor > 1 else "less"
            found.append(
                f"{name} scatter {np.sqrt(factor):.1f} times as much as the session's sigmas say: {how} noise, or a "
                "target that is not as configured"
            )
        if cut > ODD_CUT:
            found.append(f"{100 * cut:.1f} % of {name} were cut as outliers: look at the residuals of the faces")
    x, y, z = target["offset_m"]
    tilts = target["tilt_deg"]
    if max(abs(x), abs(y), abs(z)) > ODD_OFFSET_M or max(map(abs, tilts)) > ODD_TILT_DEG:
        found.append(
            f"the target was found {x:+.2f}, {y:+.2f}, {z:+.2f} m (x, y, z) from target.origin, out of plumb by "
            f"{tilts[0]:+.2f}° and {tilts[1]:+.2f}°: if it was set up and surveyed better than this, check laser.mount"
        )
    return found


def drift_doubt(drift: pd.DataFrame, conceded: Drift, stated: str = "ins.drift says") -> str:
    """What the drift found (table ``drift``, at its knots) says of the figures conceded: empty, if nothing.

    Root mean square of values ÷ conceded sigmas. What is found is drawn towards zero by those same sigmas: 0.6 to 0.7
    where they are right, at least 1.6 where the INS drifts three times as far.
    """
    angles, arm = (conceded.roll_pitch_deg, conceded.roll_pitch_deg, conceded.heading_deg), conceded.horizontal_m
    sigmas = np.array([arm, arm, conceded.vertical_m, *angles])
    if not sigmas.any():
        return NO_DRIFT
    names = [f"{axis}_target_m" for axis in "xyz"] + [f"turn_{axis}_target_deg" for axis in "xyz"]
    some = drift[names].to_numpy(np.float64)[:, sigmas > 0] / sigmas[sigmas > 0]
    ratio = float(np.sqrt(np.mean(some**2))) if some.size else 0.0
    if not ratio > ODD_DRIFT:
        return ""
    return (
        f"the INS drifts at least {ratio:.1f} times as far as {stated}: give its figures before anything else is "
        "looked for"
    )


def one_eyed(passes: Sequence[Mapping[str, Any]]) -> list[str]:
    """Passes in which one sensor alone saw the target."""
    found = []
    for seen, missing, words in (
        ("laser_points", "soundings", "the laser saw the target, and there are no soundings on it"),
        ("soundings", "laser_points", "the sonar saw the target, and there are no laser points on it"),
    ):
        numbers = [str(one["pass"]) for one in passes if one[seen] and not one[missing]]
        if numbers:
            which = plural(len(numbers), "pass").partition(" ")[2]
            found.append(f"{which} {', '.join(numbers)}: {words}; was it recording?")
    return found


def _so(sigma: Mapping[str, float] | None) -> str:
    """What a gap in the geometry comes to."""
    if sigma is None:
        return ""
    angle, arm = (
        max((sigma[key], MOUNT_WORDS[place]) for _, place, key, unit in PARAMETERS if unit == wanted)
        for wanted in ("deg", "m")
    )
    return f"; total sigmas are up to {angle[0]:.3f}° ({angle[1]}) and {1000 * arm[0]:.1f} mm ({arm[1]})"
