"""Angles near enough for an adjustment.

While they may be wrong by degrees, passes differ by decimetres where they cross. So pieces of the bottom serve whatever
their passes differ by; the lever arm is taken as known, and poses as true. With each step the pieces are found anew.
"""

from collections.abc import Iterator

import numpy as np

from pipeline.errors import RawDataError
from pipeline.maths.geometry.rotations import exp_so3, log_so3
from pipeline.maths.survey.patch_step import PieceSoundings, patch_step
from pipeline.mount import Mounted
from pipeline.patch_test.bottom_seen import LOOSE, BottomSeen, bottom_seen
from pipeline.patch_test.passes import PatchPasses

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
        soundings = _soundings(passes, mount, bottom_seen(passes, mount, LOOSE))
        step = patch_step(soundings, NOISE_M, np.radians(COARSE_DEG), turned)
        mount = Mounted(exp_so3(step) @ mount.R_body_from_sensor, mount.lever_arm_body_m)
        turned = log_so3(mount.R_body_from_sensor @ coarse.R_body_from_sensor.T)
        turned_deg = float(np.degrees(np.linalg.norm(turned)))
        if turned_deg > FARTHEST_DEG:
            raise RawDataError(
                f"mbes: passes over the bottom would turn mbes.mount by {turned_deg:.0f}°: its angles are wrong by "
                f"more than {COARSE_DEG:g}°, or have another sign; or the clocks differ: poolcal check looks into them"
            )
        if np.linalg.norm(step) < NEAR_RAD:
            break
    return mount


def _soundings(passes: PatchPasses, mount: Mounted, seen: BottomSeen) -> Iterator[PieceSoundings]:
    t_ns = np.asarray(passes.columns["t_ns"])
    for number in range(len(seen.pieces)):
        on = np.flatnonzero(seen.piece == number)
        _, R = passes.context.trajectory.poses_at(t_ns[seen.rows[on]])
        from_head = np.einsum("nij,nj->ni", R, seen.own_m[on] @ mount.R_body_from_sensor.T)
        yield PieceSoundings(seen.level_m[on], from_head, R)
