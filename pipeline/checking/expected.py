"""Soundings on the target's wet faces against what the passes sailed should have given."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline import config
from pipeline.checking.finding import Finding
from pipeline.checking.placed import Sample, put
from pipeline.checking.survey import Seen
from pipeline.checking.track import Leg, Track
from pipeline.clouds import ClosestSurface
from pipeline.maths.targets import TargetModel
from pipeline.plan_settings import MbesFigures, Pass, Plan
from pipeline.planning import Setting, predict, state_by_design
from pipeline.streams import Stream

Array = NDArray[np.float64]
RAN = 0.3  # of a pass; in less of it the sonar was not on
SHARE, FEWEST = 0.12, 200  # of what is expected: echoes and beams spaced otherwise cost two thirds; too few to tell
NEAR_M = 0.35  # a sounding with the coarse mount belongs to the face it is nearest to
MOST_PASSES = 40  # predicted; more are taken for their like
THIN_HZ, INS_HZ = 2.0, 20.0  # of the prediction, which is scaled up


@dataclass(frozen=True)
class Soundings:
    """On the faces of a target, in their order: how many these passes should give, and about how many there are."""

    expected: Array
    found: Array


def soundings(
    track: Track,
    some: Sample,
    labelled: Stream,
    sampled: int,
    files: Sequence[Seen],
    model: TargetModel,
    pool: config.PoolConfig,
    session: config.SessionConfig,
) -> Soundings | None:
    """``labelled``: of a calibrated sample of ``sampled`` rows; without it a sounding belongs to the face that it is
    nearest to with the coarse mount. None without a pass in which the sonar ran below the water.
    """
    legs = [leg for leg in track.legs if leg.good and leg.distance_m > 0.5 and leg.ran["mbes"] > RAN]
    rates = [seen.rate_hz for seen in files if seen.sensor == "mbes" and np.isfinite(seen.rate_hz)]
    height_m = float(np.median([leg.height_m for leg in legs])) - model.water_level_m if legs else 0.0
    if not legs or not rates or height_m + session.sonar.mount.z_m >= 0:
        return None
    wanted = _predicted(legs, height_m, model, pool, session) * float(np.median(rates)) / THIN_HZ
    faces = [batch["face"] for batch in labelled.batches()]
    face, share = (np.concatenate(faces), sampled) if faces else (_nearest(track, some, model), len(some.t_ns))
    rows = sum(seen.records for seen in files if seen.sensor == "mbes")
    found = np.bincount(face[face >= 0], minlength=len(model.faces)) * (rows / max(1, share))
    return Soundings(wanted, np.asarray(found, dtype=np.float64))


def _nearest(track: Track, some: Sample, model: TargetModel) -> NDArray[np.int64]:
    """The nearest faces of soundings that are near one."""
    points = put(track, some.near(track))
    points = points[np.isfinite(points[:, 0])]
    on, face = ClosestSurface(model)(points)
    return np.asarray(face[np.linalg.norm(points - on, axis=1) < NEAR_M])


def missed(model: TargetModel, counted: Soundings) -> Iterator[Finding]:
    """Faces in the upper and the lower half of the water of which far too little was found."""
    middle = [(one.vertices_m[:, 2].min() + one.vertices_m[:, 2].max()) / 2 for one in model.faces]
    deep = np.array(middle) < (model.water_level_m + model.bounds()[0][2]) / 2
    for words, half in (("lower", deep), ("upper", ~deep)):
        expected, there = float(counted.expected[half].sum()), float(counted.found[half].sum())
        if expected >= FEWEST and there < SHARE * expected:
            yield Finding(
                "faces",
                f"mbes: about {there:.0f} soundings on the faces in the {words} half of the water, where these passes "
                f"should give about {expected:.0f}: the fan does not reach them, or sees little there; turn the head, "
                "widen its sector, or check its range and gates",
            )


def _predicted(
    legs: Sequence[Leg], height_m: float, model: TargetModel, pool: config.PoolConfig, session: config.SessionConfig
) -> Array:
    """Soundings by face of these passes together, of a sonar as usual."""
    passes = tuple(
        Pass(distance_m=min(leg.distance_m, 100.0), speed_m_s=float(np.clip(leg.speed_m_s, 0.01, 10)))
        for leg in legs[:MOST_PASSES]
    )
    plan = Plan(ins_height_m=height_m, ins_rate_hz=INS_HZ, mbes=MbesFigures(ping_rate_hz=THIN_HZ), passes=passes)
    state = state_by_design(model, session.sonar)
    setting = Setting(model, state, plan, pool.segment, session.ins, session.laser, session.sonar)
    points = predict(setting, plan.passes, phases=1).points
    return np.asarray(sum(one["mbes"] for one in points)) * (len(legs) / len(passes))
