"""Findings from a sample's calibration: another pose of the target, or other signs in the sonar's mount."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.from_tables import rotation_vector_deg, target_frame
from pipeline.checking.findings import Finding
from pipeline.checking.heights import SideOfWater, profile, way
from pipeline.checking.point_samples import PointSample, place_points
from pipeline.checking.track import InsTrack
from pipeline.config.mount import Mount
from pipeline.config.pool import PoolConfig
from pipeline.config.target import Letters, Target
from pipeline.maths.geometry.rotations import log_so3
from pipeline.maths.target.model import TargetModel
from pipeline.mount import corrected_mount, mount_of
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
REACH_M = 0.15  # distance from a face beyond which a point counts 0; small, because the pose's x and y are known
STEP_M = 0.05
SHIFTS_M = np.arange(-5.0, 5.0 + STEP_M / 2, STEP_M)
CLEARLY = 0.95  # a pose with a smaller share of the best agreement is clearly worse
SMALLEST_M = 0.15  # smaller errors of the height do not show
ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")
LEAST_DEG, SMALL_DEG = 1.5, 0.3  # a coarse mount off by less is good; the sign of a smaller angle changes nothing
DIRECTIONS = 0.3  # smallest singular value of normals that span all directions
HALF = 0.5  # largest share of the mount's error that may remain after a sign is reversed


def pose_findings(
    track: InsTrack, laser: PointSample, pose: pd.DataFrame, model: TargetModel, pool: PoolConfig
) -> Iterator[Finding]:
    """Yield a finding if the laser's points fit the target better in another pose than the trial calibration's.

    The target may stand at another height, or with left and right exchanged. There is also a finding if the points fit
    several poses equally well, or if the pose lies beyond the limits of the search.

    Parameters
    ----------
    track : InsTrack
        The INS's track.
    laser : PointSample
        The laser's points.
    pose : pd.DataFrame
        The table ``segment/target_pose`` of the trial calibration.
    model : TargetModel
        The configured target.
    pool : PoolConfig
        The pool's settings.
    """
    found = pose.iloc[0]
    frame = target_frame(pose)
    R, origin = frame.R_target_from_pool, frame.origin_pool_m
    points = place_points(track, laser.in_good_legs(track))
    points = (points[np.isfinite(points[:, 0])] - origin) @ R.T
    if not len(points):
        return
    models = [model, *model.mirror_images]
    side = SideOfWater("laser", model.water_level_m)
    agreed = np.array(
        [profile(points, ClosestSurface(shape), SHIFTS_M, side, REACH_M) for shape in models]
    )
    exchanged, place = map(int, np.unravel_index(int(agreed.argmax()), agreed.shape))
    higher = SHIFTS_M - origin[2]  # shifts upwards from the configured pose
    alike = _peaks(agreed, higher)
    height, shift = pool.target.origin.height_m, float(higher[place])
    how = f"{way(-shift, 'higher', 'lower')} ({height - shift:.1f} in place of {height:g})"
    as_found = agreed[0, np.abs(SHIFTS_M) <= SMALLEST_M + STEP_M / 2].max()
    another = bool(as_found < CLEARLY * agreed.max())
    if found["ambiguous"] and len(alike) > 1:
        ways = ", or ".join(_described(*peak) for peak in alike)
        yield Finding(
            "target",
            f"target: the laser's points fit it as well {ways}: its upper end was not seen clearly enough to tell; let "
            "the laser see it, and check target.origin.height_m",
        )
    elif another and exchanged:
        also = f", and target.origin.height_m {how}" if abs(shift) > SMALLEST_M else ""
        words = "target: the laser's points fit it with left and right exchanged"
        yield Finding("sides", f"{words}{also}: {_sides(pool.target)}")
    elif another:
        yield Finding(
            "height",
            f"target: the laser's points fit it with target.origin.height_m {how}: correct it, or the target's shape",
        )
    elif not found["within"]:
        yield _beyond_search(origin, found["azimuth_correction_deg"])


def _beyond_search(origin_m: Array, turn_deg: float) -> Finding:
    """Return the finding about a target that is farther from its origin, or turned farther, than the search allows."""
    away = ", ".join(f"{value:+.2f}" for value in origin_m)
    return Finding(
        "origin",
        f"target: the laser's points fit it best {away} m (x, y, z) from target.origin, turned by {turn_deg:+.1f}°, "
        "which is more than segment.search_... allow: correct target.origin and target.azimuth_deg, or check "
        "laser.mount",
    )


def _peaks(agreed: Array, shifts: Array) -> list[tuple[bool, float]]:
    """Return each peak that agrees as well as the best: whether left and right are exchanged, and the shift (m)."""
    peaks = []
    for exchanged, row in enumerate(agreed):
        for k in np.flatnonzero(row >= CLEARLY * agreed.max()).tolist():
            around = row[np.abs(shifts - shifts[k]) < 2 * REACH_M]
            if row[k] == around.max():
                peaks.append((bool(exchanged), float(shifts[k])))
    return peaks


def _described(exchanged: bool, shift_m: float) -> str:
    height = f"with target.origin.height_m {way(-shift_m, 'higher', 'lower')}"
    height = "as it is given" if abs(shift_m) <= SMALLEST_M else height
    return f"with left and right exchanged, {height}" if exchanged else height


def _sides(target: Target) -> str:
    if isinstance(target, Letters):
        other = {"south": "north", "north": "south"}[target.low_side]
        return f"write target.low_side: {other}"
    return "reverse the sign of the y of all corners, and the order of each face's corners"


def sign_findings(
    coarse: Mount, provisional: pd.DataFrame, model: TargetModel, within_deg: float
) -> Iterator[Finding]:
    """Yield a finding if reversed signs of angles bring the coarse mount clearly nearer to the provisional mount.

    There is none if the target's faces do not span three directions. With a plain wall some angles are not determined,
    and come out at random.

    Parameters
    ----------
    coarse : Mount
        The sonar's configured coarse mount.
    provisional : pd.DataFrame
        The table ``segment/provisional_mount`` of the trial calibration.
    model : TargetModel
        The target.
    within_deg : float
        Largest error of a coarse mount from which the calibration finds the mount (degrees). A larger one is a fault.
    """
    normals = np.array([face.normal for face in model.faces if face.seen != "dry"])
    if np.linalg.matrix_rank(normals, tol=DIRECTIONS) < 3:
        return
    row = provisional.iloc[0]
    turn_deg = rotation_vector_deg(row)
    if not np.isfinite(turn_deg).all():
        return
    wanted = corrected_mount(coarse, turn_deg)

    def off_deg(mount: Mount) -> float:
        R = mount_of(mount).R_body_from_sensor
        return float(np.degrees(np.linalg.norm(log_so3(wanted.R_body_from_sensor @ R.T))))

    as_configured = off_deg(coarse)
    keys = [key for key in ANGLES if abs(getattr(coarse, key)) > SMALL_DEG]
    choices = [choice for number in (1, 2, 3) for choice in combinations(keys, number)]

    def reversed_at(choice: tuple[str, ...]) -> Mount:
        return coarse.model_copy(update={key: -getattr(coarse, key) for key in choice})

    best, which = min(((off_deg(reversed_at(choice)), choice) for choice in choices), default=(np.inf, ()))
    if as_configured < LEAST_DEG or best > HALF * as_configured:
        return
    settings = wanted.settings()
    values = {key: getattr(coarse, key) for key in which}
    changed = ", ".join(f"mbes.mount.{key} = {-value:g} in place of {value:g}" for key, value in values.items())
    asked = ", ".join(f"{key} {settings[key]:.1f}" for key in ANGLES)
    yield Finding(
        "sign",
        f"mbes: the soundings fit better with {changed} (a sample of them asks for {asked}): reverse the sign; if you "
        "have measured it so, enter those three values and check again",
        "fault" if as_configured > within_deg else "look",
    )
