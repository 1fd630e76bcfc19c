"""From the configuration's degrees to what the mathematics takes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipeline.config.mount import Mount
from pipeline.config.target import Faces, Letters, Target
from pipeline.maths.geometry.rotations import exp_so3, mount_from_rotation, mount_partials, rotation_from_mount
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.outlines import Outline, Relation, build_target
from pipeline.maths.target.patent_target import lettered

Array = NDArray[np.float64]
PARAMETERS = (  # as people list them: name, place among the six (rotation about body x, y, z, lever arm), setting, unit
    ("roll", 1, "roll_deg", "deg"),
    ("pitch", 0, "pitch_deg", "deg"),
    ("yaw", 2, "yaw_deg", "deg"),
    ("x", 3, "x_m", "m"),
    ("y", 4, "y_m", "m"),
    ("z", 5, "z_m", "m"),
)

SETTINGS = tuple(key for *_, key, _ in PARAMETERS)
WITHIN_95 = 1.959964  # sigmas on either side


@dataclass(frozen=True)
class Mounted:
    """A sensor on the body: R_body_from_sensor (3, 3), lever_arm_body_m (3,)."""

    R_body_from_sensor: Array
    lever_arm_body_m: Array

    def settings(self) -> dict[str, float]:
        """The contract's six numbers: pitch within ±90°, roll and yaw within ±180°, whatever way they were written."""
        names = ("roll_deg", "pitch_deg", "yaw_deg")
        angles = (round(float(np.degrees(angle)), 12) for angle in mount_from_rotation(self.R_body_from_sensor))
        lever = (float(value) for value in self.lever_arm_body_m)
        return dict(zip(names, angles, strict=True)) | dict(zip(("x_m", "y_m", "z_m"), lever, strict=True))

    def sigmas(self, covariance: Array) -> dict[str, float]:
        """Standard deviations of the six settings, from the covariance (6, 6) of (ε about body x, y, z; lever arm)."""
        partials = mount_partials(self.R_body_from_sensor)
        angles = np.degrees(np.sqrt(np.diag(partials @ covariance[:3, :3] @ partials.T)))
        six = [*angles, *np.sqrt(np.diag(covariance)[3:])]
        return {key: float(six[place]) for _, place, key, _ in PARAMETERS}


def turned(mount: Mount, turn_deg: Sequence[float]) -> Mounted:
    """A mount after a correction by a rotation vector about the body's x, y, z, its lever arm as it is."""
    as_given = mount_of(mount)
    return Mounted(exp_so3(np.radians(turn_deg)) @ as_given.R_body_from_sensor, as_given.lever_arm_body_m)


def mount_of(mount: Mount) -> Mounted:
    """Radians and matrices from a mount's settings."""
    angles = np.radians([mount.roll_deg, mount.pitch_deg, mount.yaw_deg])
    return Mounted(rotation_from_mount(*map(float, angles)), np.array([mount.x_m, mount.y_m, mount.z_m]))


def six_of(block: Mapping[str, Sequence[float] | None] | None) -> list[float]:
    """Correction or sigma of calibration.json in one list: rotation about body x, y, z (degrees), lever arm (m).

    Not numbers where it has none.
    """
    parts = [] if block is None else [block["rotation_vector_deg"], block["lever_arm_m"]]
    return [float(value) for part in parts if part is not None for value in part] or [float("nan")] * 6


def change_of(total: Mapping[str, float], coarse: Mapping[str, float], key: str) -> float:
    """Calibrated minus coarse; of angles the way that is shorter, never a whole turn."""
    change = total[key] - coarse[key]
    return change - 360.0 * round(change / 360.0) if key.endswith("_deg") else change


def target_of(target: Target) -> TargetModel:
    """The target's faces; nobody changes them, for they are kept: many ask, and it takes a twentieth of a second."""
    return _built(type(target), target.model_dump_json())


@lru_cache(maxsize=16)
def _built(kind: type[Letters] | type[Faces], text: str) -> TargetModel:
    target = kind.model_validate_json(text)
    if isinstance(target, Faces):
        outlines = [Outline(name, one.corners, one.role or "", one.seen) for name, one in target.faces.items()]
        relations = [
            Relation(kind, faces, one.name or "") for one in target.relations for kind, faces in one.given.items()
        ]
        return build_target(outlines, relations, target.water_level_m, target.repeats_m)
    outlines, relations, repeats_m = lettered(
        target.a,
        target.b,
        target.c,
        target.e,
        target.low_side,
        target.blocks_per_side,
        target.first_base_m,
        target.stagger_m,
    )
    return build_target(outlines, relations, target.water_level_m, repeats_m)
