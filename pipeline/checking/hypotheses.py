"""Errors that may explain why a sensor's points miss the target: of its clock, of a unit, of a sign in its mount."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_checks import FAR_ARM_M
from pipeline.checking.point_samples import AS_GIVEN, PointSample, TrialPlacement, place_points
from pipeline.checking.track import InsTrack
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
REACH_M = 0.5  # distance from a face beyond which a point counts 0: coarse mount and origin may be wrong by as much
FARTHEST_S, STEP_S, FINE_S = 60.0, 1.0, 0.1  # clock offsets that are tried: the largest, coarse and fine steps
UNITS = {"millimetres": 0.001, "centimetres": 0.01, "feet": 0.3048}
SIGNS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m")  # heights.py tries the sign of z


@dataclass(frozen=True)
class Hypothesis:
    """A possible error of a sensor, and the agreement of its points with the target once the error is removed.

    Attributes
    ----------
    score : float
        Agreement: the mean of 1 - (d / reach)², with the distance d from the target. Points beyond the reach count 0.
    clock_s : float
        How far the sensor's clock would be ahead of the INS's.
    words : str
        Another error than of the clock, and its remedy, in the words of the finding.
    """

    score: float
    clock_s: float = 0.0
    words: str = ""


def agreement(closest: ClosestSurface, points: Array) -> float:
    """Return the agreement, 0 to 1, of points (n, 3) m in the pool frame with the target; NaN points count 0."""
    known = np.flatnonzero(np.isfinite(points[:, 0]))
    if not len(known):
        return 0.0
    on, _ = closest(points[known])
    squares = np.sum((points[known] - on) ** 2, axis=1) / REACH_M**2
    return float(np.sum(np.maximum(0.0, 1.0 - squares)) / len(points))


def hypotheses(track: InsTrack, sample: PointSample, closest: ClosestSurface) -> list[Hypothesis]:
    """Return the hypotheses about a sensor's points: first that there is no error, then other units, signs and clocks.

    For georeferenced points there is only the first.

    Parameters
    ----------
    track : InsTrack
        The INS's track.
    sample : PointSample
        The sensor's points.
    closest : ClosestSurface
        The target's surface.
    """

    def score(placing: TrialPlacement = AS_GIVEN) -> float:
        return agreement(closest, place_points(track, sample, placing))

    tried = [Hypothesis(score())]
    if sample.georeferenced:
        return tried
    if sample.sensor == "laser":
        tried += [
            Hypothesis(score(TrialPlacement(scale=scale)), words=f"if they are in {unit}: export them in metres")
            for unit, scale in UNITS.items()
        ]
    for key in SIGNS:
        value = getattr(sample.mount, key)
        reversed_mount = sample.mount.model_copy(update={key: -value})
        words = f"with {sample.sensor}.mount.{key} = {-value:g} in place of {value:g}: reverse its sign"
        tried.append(Hypothesis(score(TrialPlacement(mount=reversed_mount)), words=words))
    angles = {key: getattr(sample.mount, key) for key in SIGNS[:3]}
    if 0 < max(map(abs, angles.values())) <= math.pi:
        degrees = {key: math.degrees(value) for key, value in angles.items()}
        in_degrees = sample.mount.model_copy(update=degrees)
        words = (
            f"if the angles of {sample.sensor}.mount are in radians: write degrees, such as "
            f"{SIGNS[0]}: {degrees[SIGNS[0]]:.4g}"
        )
        tried.append(Hypothesis(score(TrialPlacement(mount=in_degrees)), words=words))
    for key in ("x_m", "y_m", "z_m"):
        value = getattr(sample.mount, key)
        if abs(value) > FAR_ARM_M:
            words = f"with {sample.sensor}.mount.{key} = {value / 100:g} in place of {value:g}: write metres"
            in_metres = sample.mount.model_copy(update={key: value / 100})
            tried.append(Hypothesis(score(TrialPlacement(mount=in_metres)), words=words))

    def clock_score(ahead_s: float) -> float:
        return score(TrialPlacement(clock_ahead_s=ahead_s))

    coarse = np.arange(-FARTHEST_S, FARTHEST_S + STEP_S / 2, STEP_S)
    best = float(max(coarse, key=clock_score))
    fine = best + np.arange(-STEP_S, STEP_S + FINE_S / 2, FINE_S)
    clock_s = float(max(fine, key=clock_score))
    return [*tried, Hypothesis(clock_score(clock_s), clock_s)]
