"""Soundings on the target's wet faces against what these very pings should have given.

Expected is what the sonar's own beams (angles as recorded) meet from where the boat truly was at its own pings, by the
labels' own rules: what is then missing was not detected, or does not lie where the target is said to be.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Stream
from pipeline.checking.file_survey import Columns, Seen, Times
from pipeline.checking.findings import Finding
from pipeline.checking.point_samples import Sample, put, rows_of
from pipeline.checking.track import Track
from pipeline.config.plan import MbesFigures, Pass, Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.console import plural
from pipeline.gps_time import NS
from pipeline.maths.adjustment.observations import SPEED_M_S
from pipeline.maths.sonar.soundings import points_in_mbes
from pipeline.maths.target.model import TargetModel
from pipeline.planning.prediction import Setting, labelled, state_by_design
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
RAN = 0.3  # of a pass; in less of it the sonar was not on
POOR, NONE, FEWEST = 0.4, 0.15, 200  # of what is expected: worth a look, a fault; too few to tell
USUAL = "usual: 60 to 120 %"
NEAR_M = 0.35  # a sounding with the coarse mount belongs to the face it is nearest to
PINGS, BEAMS = 400, 100_000  # cast as rays, and rows from which the beams' angles are taken
FARTHEST_M = 100.0


@dataclass(frozen=True)
class Soundings:
    """On the faces of a target, in their order: how many these passes should give, and about how many there are."""

    expected: Array
    found: Array


def soundings(
    track: Track,
    some: Sample,
    on_faces: Stream,
    sampled: int,
    files: Sequence[Seen],
    model: TargetModel,
    pool: PoolConfig,
    session: SessionConfig,
) -> Soundings | None:
    """``on_faces``: of a calibrated sample of ``sampled`` rows; without it a sounding belongs to the face that it is
    nearest to with the coarse mount. None without a pass in which the sonar ran below the water.
    """
    legs = [leg for leg in track.legs if leg.good and leg.distance_m > 0.5 and leg.ran["mbes"] > RAN]
    height_m = float(np.median([leg.height_m for leg in legs])) - model.water_level_m if legs else 0.0
    if not legs or height_m + session.sonar.mount.z_m >= 0:
        return None
    of_sonar = [seen for seen in files if seen.sensor == "mbes" and len(seen.epochs_ns)]
    inside = [
        np.concatenate([t_ns[(t_ns >= leg.start_ns) & (t_ns <= leg.end_ns)] for leg in legs])
        for t_ns in (seen.epochs_ns for seen in of_sonar)
    ]
    pings = np.sort(np.concatenate(inside))
    many = sum(len(t_ns) / seen.share for t_ns, seen in zip(inside, of_sonar, strict=True))
    pings = pings[track.trajectory.covers(pings, NS)]
    if not len(pings):
        return None
    cast = pings[np.unique(np.linspace(0, len(pings) - 1, PINGS).astype(int))]
    wanted = _met(track, cast, rows_of(files, "mbes", BEAMS), model, pool, session) * (many / len(cast))
    faces = [batch["face"] for batch in on_faces.batches()]
    face, share = (np.concatenate(faces), sampled) if faces else (_nearest(track, some, model), len(some.t_ns))
    rows = sum(seen.records for seen in files if seen.sensor == "mbes")
    found = np.bincount(face[face >= 0], minlength=len(model.faces)) * (rows / max(1, share))
    return Soundings(wanted, np.asarray(found, dtype=np.float64))


def _met(
    track: Track, t_ns: Times, rows: Columns, model: TargetModel, pool: PoolConfig, session: SessionConfig
) -> Array:
    """How many beams of these pings meet each face so that they would be used."""
    fan = _fan(rows)
    reach = float(np.quantile(rows["two_way_time_s"], 0.99)) * SPEED_M_S / 2
    plan = Plan(
        mbes=MbesFigures(max_range_m=float(np.clip(reach, MbesFigures().max_range_m, FARTHEST_M))),
        passes=(Pass(distance_m=1.0),),  # none is sailed: the boat's own track stands in its place
    )
    state = state_by_design(model, session.sonar)
    setting = Setting(model, state, plan, pool.segment, session.ins, session.laser, session.sonar)
    rays = np.tile(fan, (len(t_ns), 1))
    met = labelled(setting, ClosestSurface(model), track.trajectory, "mbes", np.repeat(t_ns, len(fan)), rays)
    return np.bincount(met["face"].astype(np.int64), minlength=len(model.faces)).astype(np.float64)


def _fan(rows: Columns) -> Array:
    """Unit rays (b, 3) of the beams that a sonar has, each in the middle of where it pointed."""
    order = np.argsort(rows["beam"], kind="stable")
    _, first = np.unique(rows["beam"][order], return_index=True)
    angle, tilt = (
        np.array([np.median(one) for one in np.split(rows[name][order], first[1:])])
        for name in ("angle_rad", "transmit_tilt_rad")
    )
    speed = np.full(len(angle), SPEED_M_S)
    return points_in_mbes(2 / speed, angle, tilt, speed)[0]


def _nearest(track: Track, some: Sample, model: TargetModel) -> NDArray[np.int64]:
    """The nearest faces of soundings that are near one."""
    points = put(track, some.near(track))
    points = points[np.isfinite(points[:, 0])]
    on, face = ClosestSurface(model)(points)
    return np.asarray(face[np.linalg.norm(points - on, axis=1) < NEAR_M])


def missed(model: TargetModel, counted: Soundings) -> Iterator[Finding]:
    """Faces of which far too little was found: in the upper and the lower half of the water; else one by one."""
    middle = [(one.vertices_m[:, 2].min() + one.vertices_m[:, 2].max()) / 2 for one in model.faces]
    deep = np.array(middle) < (model.water_level_m + model.bounds()[0][2]) / 2
    remedy = "turn the head, widen its sector, or check its range and gates"
    told = False
    for words, half in (("lower", deep), ("upper", ~deep)):
        expected, there = float(counted.expected[half].sum()), float(counted.found[half].sum())
        if expected >= FEWEST and there < POOR * expected:
            told = True
            yield Finding(
                "faces",
                f"mbes: about {there:.0f} soundings on the faces in the {words} half of the water, where these pings "
                f"should give about {expected:.0f} ({there / expected:.0%}; {USUAL}): the fan does not reach them, or "
                f"sees little there; {remedy}",
                "fault" if there < NONE * expected else "look",
            )
    bare = (counted.expected >= FEWEST) & (counted.found < NONE * counted.expected)
    if bare.any() and not told:
        one = int(np.argmax(np.where(bare, counted.expected, 0.0)))
        others = f", and {plural(int(bare.sum()) - 1, 'other face')} likewise" if bare.sum() > 1 else ""
        yield Finding(
            "faces",
            f"mbes: about {counted.found[one]:.0f} soundings on the face {model.faces[one].name}, where these pings "
            f"should give about {counted.expected[one]:.0f}{others}: is something before it, or does it lie elsewhere?",
            "look",
        )
