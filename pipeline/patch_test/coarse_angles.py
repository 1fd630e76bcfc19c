"""Angles near enough for an adjustment.

While they may be wrong by degrees, passes differ by decimetres where they cross. So a square of the bottom serves if it
is flat in each of two passes, whatever they differ by; the lever arm is taken as known, and poses as true. With each
step the squares are found anew.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.finding.bottom import bottom_pieces
from pipeline.maths.geometry.rotations import exp_so3, log_so3
from pipeline.maths.survey.patch_step import PieceSoundings, patch_step
from pipeline.mount import Mounted
from pipeline.patch_test.bottom_seen import rows_on, square_of, squares_of
from pipeline.patch_test.passes import PatchPasses

Array = NDArray[np.float64]
COARSE_DEG = 3.0  # standard deviation of each coarse angle
FARTHEST_DEG = 3 * COARSE_DEG  # the passes must not turn the mount by more
NOISE_M = 0.03  # by which passes may differ whatever the angles
NEAR_RAD, STEPS = 1e-3, 10  # a smaller step is near enough; the most steps


def angles_near(passes: PatchPasses, coarse: Mounted) -> Mounted:
    """Return the coarse mount, its angles brought so near that the passes agree.

    Raises
    ------
    RawDataError
        No piece of the bottom serves, or the passes would turn the mount too far.
    """
    mount, turned = coarse, np.zeros(3)
    for _ in range(STEPS):
        soundings = _soundings(passes, mount)
        step = patch_step(soundings, NOISE_M, np.radians(COARSE_DEG), turned)
        mount = Mounted(exp_so3(step) @ mount.R_body_from_sensor, mount.lever_arm_body_m)
        turned = log_so3(mount.R_body_from_sensor @ coarse.R_body_from_sensor.T)
        turned_deg = float(np.degrees(np.linalg.norm(turned)))
        if turned_deg > FARTHEST_DEG:
            raise RawDataError(
                f"mbes: passes over the bottom would turn mbes.mount by {turned_deg:.0f}°: its angles are wrong by "
                f"more than {COARSE_DEG:g}°, or have another sign; or the clocks differ, or the sound speed is wrong: "
                "poolcal check looks into them"
            )
        if np.linalg.norm(step) < NEAR_RAD:
            break
    return mount


def _soundings(passes: PatchPasses, mount: Mounted) -> list[PieceSoundings]:
    """Return the soundings on each square that is flat in two passes or more."""
    own, level = passes.placed(mount)
    squares = replace(squares_of(passes, level), passes=1)
    rows: dict[tuple[float, ...], list[NDArray[np.int64]]] = {}
    for number in np.unique(passes.number_of_pass).tolist():
        of_pass = np.flatnonzero(passes.number_of_pass == number)
        for piece in bottom_pieces(level[of_pass], passes.number_of_pass[of_pass], passes.level_m, squares):
            if not piece.refused:
                rows.setdefault(square_of(piece), []).append(rows_on(piece, level, of_pass))
    shared = [np.concatenate(found) for found in rows.values() if len(found) > 1]
    if not shared:
        raise RawDataError(
            f"mbes: no square of {squares.side_m:.0f} m of the bottom was heard in two passes, flat and dense enough: "
            "sail both ways over the same bottom, slowly; or mbes.mount.roll_deg has the wrong sign"
        )
    return [_placed(passes, mount, own, level, on) for on in shared]


def _placed(
    passes: PatchPasses, mount: Mounted, own_m: Array, level_m: Array, rows: NDArray[np.int64]
) -> PieceSoundings:
    _, R = passes.context.trajectory.poses_at(np.asarray(passes.columns["t_ns"])[rows])
    from_head = np.einsum("nij,nj->ni", R, own_m[rows] @ mount.R_body_from_sensor.T)
    return PieceSoundings(level_m[rows], from_head, R)
