"""Soundings on the target's wet faces, compared with the number expected of the same pings.

The sonar's beams, at their recorded angles, are cast as rays from the boat's recorded poses at its pings. A sounding is
expected if a ray meets a face and stage segment would label the point. A missing sounding was not detected, or the face
does not lie where the settings place it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Stream
from pipeline.checking.file_survey import Columns, SurveyedFile, Times
from pipeline.checking.findings import Finding
from pipeline.checking.point_samples import PointSample, place_points, sampled_rows
from pipeline.checking.track import InsTrack
from pipeline.config.plan import MbesFigures, Pass, Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.console import plural
from pipeline.gps_time import NS
from pipeline.maths.adjustment.design_matrix import SPEED_M_S
from pipeline.maths.sonar.soundings import points_in_mbes
from pipeline.maths.target.model import TargetModel
from pipeline.planning.planned_rays import Rays, label_rays
from pipeline.planning.setting import setting_of
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
RAN = 0.3  # share of a pass up to which the sonar counts as switched off
POOR, NONE, FEWEST = 0.4, 0.15, 200  # found / expected below it: a look, a fault; fewest expected to judge
SAMPLE_SIGMAS = 2.0
FEWEST_SAMPLED = 20  # soundings expected in the sample, to judge: those of one stretch of a file lie on the same faces
USUAL = "usual: 60 to 120 %"
FEWEST_FAMILIES = 3  # by which a mount can be found
NEAR_M = 0.35  # a sounding placed with the coarse mount counts for the nearest face within this distance
PINGS, BEAMS = 400, 100_000  # pings that are cast as rays, and rows from which the beams' angles are taken
FARTHEST_M = 100.0


@dataclass(frozen=True)
class SoundingCounts:
    """Numbers of soundings on each face (f,), in the order of the model's faces: expected, and found (estimated).

    each: number of soundings for which one of the sample stands.
    """

    expected: Array
    found: Array
    each: float = 1.0

    def enough(self, expected: Array) -> NDArray[np.bool_]:
        """Return whether so many soundings are expected (…) that their absence in the sample tells something."""
        return np.asarray(expected >= max(FEWEST, FEWEST_SAMPLED * self.each))

    def found_at_most(self, faces: NDArray[np.bool_]) -> float:
        """Return the largest number found on these faces (f,) that the sample leaves likely: two of its sigmas more."""
        found = float(self.found[faces].sum())
        return found + SAMPLE_SIGMAS * float(np.sqrt(found * self.each))


@dataclass(frozen=True)
class PingsOnTarget:
    """A session's files and settings, the INS's track, and the target."""

    track: InsTrack
    files: Sequence[SurveyedFile]
    model: TargetModel
    pool: PoolConfig
    session: SessionConfig


def count_soundings(
    pings: PingsOnTarget, sample: PointSample, labelled: Stream, labelled_rows: int
) -> SoundingCounts | None:
    """Count the soundings found on each face, and the soundings expected of the pings in the good passes.

    Parameters
    ----------
    pings : PingsOnTarget
        The session's pings.
    sample : PointSample
        Soundings, used if ``labelled`` is empty. Each counts for the face nearest to it with the coarse mount.
    labelled : Stream
        Soundings of the calibrated sample, with their faces.
    labelled_rows : int
        Number of rows in the calibrated sample.

    Returns
    -------
    SoundingCounts or None
        None if the sonar ran in no good pass, was above the water, or pinged only at times without a pose of the INS.
    """
    track, files, model = pings.track, pings.files, pings.model
    legs = [leg for leg in track.legs if leg.good and leg.distance_m > 0.5 and leg.ran["mbes"] > RAN]
    height_m = float(np.median([leg.height_m for leg in legs])) - model.water_level_m if legs else 0.0
    if not legs or height_m + pings.session.sonar.mount.z_m >= 0:
        return None
    sonar_files = [file for file in files if file.sensor == "mbes" and len(file.epochs_ns)]
    inside = [
        np.concatenate([t_ns[(t_ns >= leg.start_ns) & (t_ns <= leg.end_ns)] for leg in legs])
        for t_ns in (file.epochs_ns for file in sonar_files)
    ]
    epochs_ns = np.sort(np.concatenate(inside))
    number = sum(len(t_ns) / file.share for t_ns, file in zip(inside, sonar_files, strict=True))
    epochs_ns = epochs_ns[track.trajectory.covers(epochs_ns, NS)]
    if not len(epochs_ns):
        return None
    cast_ns = epochs_ns[np.unique(np.linspace(0, len(epochs_ns) - 1, PINGS).astype(int))]
    expected = _beams_that_meet(pings, cast_ns) * (number / len(cast_ns))
    faces = [batch["face"] for batch in labelled.batches()]
    face = np.concatenate(faces) if faces else _nearest_faces(track, sample, model)
    rows_read = labelled_rows if faces else len(sample.t_ns)
    rows = sum(file.records for file in files if file.sensor == "mbes")
    each = rows / max(1, rows_read)
    found = np.bincount(face[face >= 0], minlength=len(model.faces)) * each
    return SoundingCounts(expected, np.asarray(found, dtype=np.float64), each)


def _beams_that_meet(pings: PingsOnTarget, t_ns: Times) -> Array:
    """Return, for each face (f,), the number of beams that would be labelled with the face, of pings at these times."""
    model, session = pings.model, pings.session
    rows = sampled_rows(pings.files, "mbes", BEAMS)
    fan = _fan(rows)
    reach = float(np.quantile(rows["two_way_time_s"], 0.99)) * SPEED_M_S / 2
    plan = Plan(
        mbes=MbesFigures(max_range_m=float(np.clip(reach, MbesFigures().max_range_m, FARTHEST_M))),
        passes=(Pass(distance_m=1.0),),  # a plan needs one; the boat's recorded track replaces it
    )
    setting = setting_of(plan, pings.pool, session)
    rays = Rays("mbes", np.repeat(t_ns, len(fan)), np.tile(fan, (len(t_ns), 1)))
    met = label_rays(setting, ClosestSurface(model), pings.track.trajectory, rays)
    return np.bincount(met["face"].astype(np.int64), minlength=len(model.faces)).astype(np.float64)


def _fan(rows: Columns) -> Array:
    """Return unit vectors (b, 3) of a sonar's beams in the mbes frame, each at the median of its recorded angles."""
    order = np.argsort(rows["beam"], kind="stable")
    _, first = np.unique(rows["beam"][order], return_index=True)
    angle, tilt = (
        np.array([np.median(angles) for angles in np.split(rows[name][order], first[1:])])
        for name in ("angle_rad", "transmit_tilt_rad")
    )
    speed = np.full(len(angle), SPEED_M_S)
    return points_in_mbes(2 / speed, angle, tilt, speed)[0]


def _nearest_faces(track: InsTrack, sample: PointSample, model: TargetModel) -> NDArray[np.int64]:
    """Return the numbers (m,) of the nearest faces, for the soundings within NEAR_M of a face."""
    points = place_points(track, sample.in_good_legs(track))
    points = points[np.isfinite(points[:, 0])]
    on, face = ClosestSurface(model)(points)
    return np.asarray(face[np.linalg.norm(points - on, axis=1) < NEAR_M])


def faces_missed(model: TargetModel, counts: SoundingCounts) -> Iterator[Finding]:
    """Yield a finding for each half of the water, lower and upper, with far too few soundings on its faces.

    If neither half has too few, yield one finding for all faces with almost no soundings. There is none if the sample
    should have soundings on one or two families alone: a mount that is found by these may be wrong by degrees.
    """
    families = np.array([face.family for face in model.faces])
    seen = [bool(counts.enough(counts.expected[families == family].sum())) for family in sorted(set(families))]
    if sum(seen) < min(FEWEST_FAMILIES, len(seen)):
        return
    middle = [(face.vertices_m[:, 2].min() + face.vertices_m[:, 2].max()) / 2 for face in model.faces]
    deep = np.array(middle) < (model.water_level_m + model.bounds()[0][2]) / 2
    remedy = "turn the head, widen its sector, or check its range and gates"
    half_told = False
    for words, half in (("lower", deep), ("upper", ~deep)):
        expected, found = float(counts.expected[half].sum()), float(counts.found[half].sum())
        if counts.enough(np.array(expected)) and counts.found_at_most(half) < POOR * expected:
            half_told = True
            yield Finding(
                "faces",
                f"mbes: about {found:.0f} soundings on the faces in the {words} half of the water, where these pings "
                f"should give about {expected:.0f} ({found / expected:.0%}; {USUAL}): the fan does not reach them, or "
                f"sees little there; {remedy}",
                "fault" if counts.found_at_most(half) < NONE * expected else "look",
            )
    at_most = np.array([counts.found_at_most(face) for face in np.eye(len(model.faces), dtype=bool)])
    bare = counts.enough(counts.expected) & (at_most < NONE * counts.expected)
    if bare.any() and not half_told:
        barest = int(np.argmax(np.where(bare, counts.expected, 0.0)))
        others = f", and {plural(int(bare.sum()) - 1, 'other face')} likewise" if bare.sum() > 1 else ""
        yield Finding(
            "faces",
            f"mbes: about {counts.found[barest]:.0f} soundings on the face {model.faces[barest].name}, where these "
            f"pings should give about {counts.expected[barest]:.0f}{others}: is something before it, or does it lie "
            "elsewhere?",
            "look",
        )
