"""Soundings on the target's wet faces against what the passes sailed should have given."""

from collections.abc import Iterator, Sequence

import numpy as np

from pipeline import config
from pipeline.checking.finding import Finding
from pipeline.checking.placed import Sample, put
from pipeline.checking.survey import Seen
from pipeline.checking.track import Leg, Track
from pipeline.clouds import ClosestSurface
from pipeline.maths.targets import TargetModel
from pipeline.plan_settings import MbesFigures, Pass, Plan
from pipeline.planning import Setting, predict, state_by_design

SHARE, FEWEST = 0.3, 200  # of what is expected; faces of which less is expected tell nothing
NEAR_M = 0.35  # a sounding with the coarse mount belongs to the face it is nearest to
THIN_HZ, INS_HZ = 2.0, 20.0  # of the prediction, which is scaled up


def faces(
    track: Track,
    some: Sample,
    rows: int,
    files: Sequence[Seen],
    model: TargetModel,
    pool: config.PoolConfig,
    session: config.SessionConfig,
) -> Iterator[Finding]:
    """Faces in the upper and the lower half of the water of which far too little was found; ``rows``: that the sample
    stands for."""
    legs = [leg for leg in track.legs if leg.good and leg.distance_m > 0.5 and leg.ran["mbes"] > SHARE]
    rates = [seen.rate_hz for seen in files if seen.sensor == "mbes" and np.isfinite(seen.rate_hz)]
    height_m = float(np.median([leg.height_m for leg in legs])) - model.water_level_m if legs else 0.0
    if not legs or not rates or height_m + session.sonar.mount.z_m >= 0:
        return
    wanted = _predicted(legs, height_m, model, pool, session) * float(np.median(rates)) / THIN_HZ
    near = some.near(track)
    points = put(track, near)
    points = points[np.isfinite(points[:, 0])]
    on, face = ClosestSurface(model)(points)
    hit = np.linalg.norm(points - on, axis=1) < NEAR_M
    found = np.bincount(face[hit], minlength=len(model.faces)) * (rows / max(1, len(some.t_ns)))
    middle = [(one.vertices_m[:, 2].min() + one.vertices_m[:, 2].max()) / 2 for one in model.faces]
    deep = np.array(middle) < (model.water_level_m + model.bounds()[0][2]) / 2
    for words, half in (("lower", deep), ("upper", ~deep)):
        expected, there = float(wanted[half].sum()), float(found[half].sum())
        if expected >= FEWEST and there < SHARE * expected:
            yield Finding(
                "faces",
                f"mbes: about {there:.0f} soundings on the faces in the {words} half of the water, where these passes "
                f"should give about {expected:.0f}: the fan does not reach them, or sees little there; turn the head, "
                "widen its sector, or check its range and gates",
            )


def _predicted(
    legs: Sequence[Leg], height_m: float, model: TargetModel, pool: config.PoolConfig, session: config.SessionConfig
) -> np.ndarray:
    """Soundings by face of these passes together, of a sonar as usual."""
    passes = tuple(
        Pass(distance_m=min(leg.distance_m, 100.0), speed_m_s=float(np.clip(leg.speed_m_s, 0.01, 10))) for leg in legs
    )
    plan = Plan(ins_height_m=height_m, ins_rate_hz=INS_HZ, mbes=MbesFigures(ping_rate_hz=THIN_HZ), passes=passes)
    state = state_by_design(model, session.sonar)
    setting = Setting(model, state, plan, pool.segment, session.ins, session.laser, session.sonar)
    points = predict(setting, plan.passes, phases=1).points
    return np.asarray(sum(one["mbes"] for one in points))
