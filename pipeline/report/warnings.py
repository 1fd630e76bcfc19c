"""Warnings: they do not reject a calibration, but should be checked before the boat leaves the pool."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from pipeline.console import plural
from pipeline.gps_time import utc_text
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS
from pipeline.maths.target.model import TargetModel
from pipeline.report.reason_codes import ReasonCode, Statement

MAX_VARIANCE_FACTOR = 2.0  # of a group of observations: above this, or below its inverse, the sigmas are wrong
MAX_INS_VARIANCE_FACTOR = 4.0  # of the INS's white noise; a small one is no warning: the INS is good
MAX_PING_EXCESS = 0.5  # of the variance factor of pings over that of the INS's white noise
CERTAIN = 3.0  # sigmas by which this excess must differ from zero
MAX_OUTLIER_SHARE = 0.01  # of a group of observations
MAX_TARGET_OFFSET_M = 0.1  # from target.origin, along each axis
MAX_TARGET_TILT_DEG = 0.1  # out of plumb

GROUP_WORDS = {
    "laser": "laser points",
    "mbes_vertical": "soundings on vertical faces",
    "mbes_horizontal": "soundings on horizontal faces",
}
INS_NOISE, PING_NOISE = "ins_white", "ping"  # groups of noise common to an epoch's points


def geometry_gaps(geometry: pd.DataFrame, sigmas: Mapping[str, float] | None) -> list[Statement]:
    """Return a warning for each gap in the geometry, with the largest total sigmas.

    ``geometry``: the table; ``sigmas``: total sigmas of the mount by setting, degrees and m, or None.
    """
    suffix = "" if sigmas is None else _sigma_suffix(sigmas)
    gaps = geometry.loc[geometry["kind"] == "gap", "words"]
    return [Statement(ReasonCode.GEOMETRY_GAP, f"{words}{suffix}") for words in gaps]


def _sigma_suffix(sigmas: Mapping[str, float]) -> str:
    """Return in words the largest sigma of the angles, and that of the lever arm."""
    angle, arm = (
        max((sigmas[key], MOUNT_WORDS[place]) for _, place, key, unit in PARAMETERS if unit == kind)
        for kind in ("deg", "m")
    )
    return f"; total sigmas are up to {angle[0]:.3f}° ({angle[1]}) and {1000 * arm[0]:.1f} mm ({arm[1]})"


def unexpected_noise(groups: pd.DataFrame) -> Iterator[Statement]:
    """Yield a warning for each group of observations (table ``groups``) with unexpected noise or many outliers."""
    is_common = groups["group"].isin((INS_NOISE, PING_NOISE)) | groups["group"].str.endswith(f"_{PING_NOISE}")
    yield from _common_noise(groups[is_common].set_index("group").to_dict("index"))
    for row in groups[(groups["family"] == "") & ~is_common].to_dict("records"):
        factor, cut_share = row["variance_factor"], row["cut"] / max(row["count"], 1)
        name = _group_words(row["group"])
        if factor > MAX_VARIANCE_FACTOR or factor < 1 / MAX_VARIANCE_FACTOR:
            yield Statement(
                ReasonCode.NOISE_OFF_SIGMAS,
                f"{name} scatter {np.sqrt(factor):.1f} times as much as the session's sigmas say: "
                f"{'more' if factor > 1 else 'less'} noise, or a target that is not as configured",
            )
        if cut_share > MAX_OUTLIER_SHARE:
            yield Statement(
                ReasonCode.MANY_OUTLIERS,
                f"{100 * cut_share:.1f} % of {name} were cut as outliers: look at the residuals of the faces",
            )


def _group_words(group: str) -> str:
    """Return in words a group of a sensor's observations; a further head of the sonar is named.

    >>> _group_words("mbes_vertical"), _group_words("mbes_2_vertical")
    ('soundings on vertical faces', 'soundings of mbes_2 on vertical faces')
    """
    head, _, kind = group.rpartition("_")
    return GROUP_WORDS.get(group, f"soundings of {head} on {kind} faces")


def _common_noise(rows: Mapping[Any, Mapping[Any, Any]]) -> Iterator[Statement]:
    """Yield a warning for unexpected noise that is common to an epoch's points; ``rows``: by group."""
    ins = rows.get(INS_NOISE, {"variance_factor": 1.0, "sigma": 0.0})
    if ins["variance_factor"] > MAX_INS_VARIANCE_FACTOR:
        words = (
            f"the INS's poses scatter from record to record {np.sqrt(ins['variance_factor']):.1f} times as much as "
            "ins.white says: its filter, or the laser's clock"
        )
        yield Statement(ReasonCode.INS_NOISE_ABOVE_SETTINGS, words)
    for group, ping in rows.items():
        if group == INS_NOISE:
            continue
        excess = ping["variance_factor"] - ins["variance_factor"]
        if excess > max(MAX_PING_EXCESS, CERTAIN * np.hypot(ping["sigma"], ins["sigma"])):
            whole = "whole pings" if group == PING_NOISE else f"whole pings of {group.removesuffix(f'_{PING_NOISE}')}"
            words = (
                f"{whole} scatter {np.sqrt(ping['variance_factor']):.1f} times as much as ins.white says: the "
                "sonar's clock, or stabilised beams; the sigmas allow for it"
            )
            yield Statement(ReasonCode.PING_NOISE_ABOVE_SETTINGS, words)


def target_off_origin(target: Mapping[str, Any]) -> list[Statement]:
    """Return a warning if the target (block of calibration.json) is far from its configured origin, or out of plumb."""
    x, y, z = target["offset_m"]
    tilts = target["tilt_deg"]
    if not (max(abs(x), abs(y), abs(z)) > MAX_TARGET_OFFSET_M or max(map(abs, tilts)) > MAX_TARGET_TILT_DEG):
        return []
    words = (
        f"the target was found {x:+.2f}, {y:+.2f}, {z:+.2f} m (x, y, z) from target.origin, out of plumb by "
        f"{tilts[0]:+.2f}° and {tilts[1]:+.2f}°: if it was set up and surveyed better than this, check laser.mount"
    )
    return [Statement(ReasonCode.TARGET_OFF_ORIGIN, words)]


def target_found(model: TargetModel) -> list[Statement]:
    """Return a warning if the target is one that was found in laser points."""
    if not model.found:
        return []
    found = [face for face in model.faces if face.seen != "wet"]
    depth_m = model.water_level_m - min(float(face.vertices_m[:, 2].min()) for face in found)
    words = (
        f"the target was found in laser points ({', '.join(face.name for face in found)}): that its faces go straight "
        f"on to {depth_m:.1f} m below the water is an assumption; look at the residuals by height"
    )
    return [Statement(ReasonCode.TARGET_FOUND, words)]


def passes_without_files(unsounded: pd.DataFrame) -> list[Statement]:
    """Return a warning if the boat passed the target while the laser ran and the sonar did not (``unsounded``: table).

    No pass of the run shows this, because passes are made of soundings.
    """
    if unsounded.empty:
        return []
    rows = zip(unsounded["start_ns"], unsounded["distance_m"], strict=True)
    times = ", ".join(f"{utc_text(int(t_ns))} ({distance_m:.1f} m)" for t_ns, distance_m in rows)
    words = (
        "the boat also passed the target with the laser running and without any soundings, which the result lacks: "
        f"{times}; is a file of the sonar missing?"
    )
    return [Statement(ReasonCode.PASS_WITHOUT_SOUNDINGS, words)]


def passes_with_one_sensor(passes: Sequence[Mapping[str, Any]]) -> Iterator[Statement]:
    """Yield a warning for each sensor that did not see the target in passes in which the other one did.

    ``passes``: rows of the key ``passes`` of calibration.json.
    """
    laser_alone = "the laser saw the target, and there are no soundings on it"
    sonar_alone = "the sonar saw the target, and there are no laser points on it"
    for present, missing, code, words in (
        ("laser_points", "soundings", ReasonCode.PASS_WITHOUT_SOUNDINGS, laser_alone),
        ("soundings", "laser_points", ReasonCode.PASS_WITHOUT_LASER, sonar_alone),
    ):
        numbers = [str(row["pass"]) for row in passes if row[present] and not row[missing]]
        if numbers:
            noun = plural(len(numbers), "pass").partition(" ")[2]
            yield Statement(code, f"{noun} {', '.join(numbers)}: {words}; was it recording?")
