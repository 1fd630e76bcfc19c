"""Random mounts to export: 200, with tilts up to ±80°, and the vessel's frames in which they are written."""

from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.exports.mounting import Mounting, Origin, VesselFrame
from pipeline.mount import Mounted
from tests.support.programs import sfu_rotation

ORIGIN = Origin("2026-05-12_水池", "r", "calibrated mount", start_utc="2026-05-12T08:00:03Z")
FRAMES = (
    VesselFrame(),
    VesselFrame((0.4, -3.25, 1.75), (0.0, 0.0, 0.0)),
    VesselFrame((-1.5, 12.125, 0.5), (2.5, -1.25, 163.0)),
    VesselFrame((0.0, 0.0, 0.0), (180.0, 0.0, -90.0)),
)


def mounted(roll: float, pitch: float, yaw: float, *lever_arm: float) -> Mounted:
    return Mounted(sfu_rotation("YPR", roll, pitch, yaw), np.array(lever_arm or (0.0, 0.0, 0.0)))


def mounting(body: Mounted, **more: Any) -> Mounting:
    return replace(Mounting("mbes", body, None, ORIGIN), **more)


def random_mounts(number: int = 200) -> list[Mounted]:
    random = np.random.default_rng(20260512)
    rows = random.uniform([-80, -80, -180, -3, -3, -3], [80, 80, 180, 3, 3, 3], (number, 6))
    rows[0], rows[1], rows[2] = (-48.8, 1.2, -2.0, 0.3, 0.2, -2.01), (80, -80, 180, 0, 0, 0), (0, 0, 0, 0, 0, 0)
    return [mounted(*row) for row in rows]


def in_vessel(body: Mounted, frame: VesselFrame) -> Mounted:
    """The mount in the vessel's frame, by the rotations of tests/support/programs.py."""
    turn = sfu_rotation("YPR", *frame.ins_turn_deg)
    return Mounted(turn @ body.R_body_from_sensor, np.array(frame.ins_point_m) + turn @ body.lever_arm_body_m)
