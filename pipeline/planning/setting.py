"""The setting of a prediction: target and instruments."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.problem import designed_surfaces
from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig, Segment
from pipeline.config.session import Ins, Laser, Mbes, SessionConfig
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.target.masks import along_face, outside_masks
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.target.design import target_of

BEYOND_M = 2.0  # from the last block to the end of a pass
CELL_M = 0.1  # side of the cells by which a face's area is found
Array = NDArray[np.float64]


@dataclass(frozen=True)
class PredictionSetting:
    """Target and instruments, which are the same for all passes of a plan.

    roughness_m: RMS of the wet faces about their planes, dry_roughness_m: of the dry ones; roughness_length_m: the
    length over which they are alike.
    """

    model: TargetModel
    state: State
    plan: Plan
    segment: Segment
    ins: Ins
    laser: Laser
    mbes: Mbes
    roughness_m: float = 0.0
    dry_roughness_m: float = 0.0
    roughness_length_m: float = 0.0

    @property
    def middle_m(self) -> float:
        """The target's middle along its y axis, by which the passes go: the origin may stand at its end."""
        low, high = self.model.bounds()
        return float(low[1] + high[1]) / 2

    @property
    def half_length_m(self) -> float:
        """Length of a pass on either side of the target's middle."""
        low, high = self.model.bounds()
        return float(high[1] - low[1]) / 2 + BEYOND_M

    def areas_m2(self, *, wet: bool) -> Array:
        """Return the area (s,) of each surface's faces under water, or above it."""
        areas, number = np.zeros(len(self.state.surfaces)), {s.family: k for k, s in enumerate(self.state.surfaces)}
        for face in self.model.faces:
            centres_m, cell_m2 = face.cells(CELL_M)
            counts = (centres_m[:, 2] < self.model.water_level_m) == wet
            nothing = np.zeros(len(centres_m))
            counts &= outside_masks(face, along_face(face, centres_m), centres_m[:, 2], (nothing, nothing)) > 0
            areas[number[face.family]] += cell_m2 * np.sum(counts)
        return areas


def setting_of(plan: Plan, pool: PoolConfig, session: SessionConfig) -> PredictionSetting:
    """Return the setting of a plan's prediction: target and instruments by the settings of pool and session."""
    model, mbes = target_of(pool.target), session.sonar
    return PredictionSetting(
        model=model,
        state=state_by_design(model, mbes),
        plan=plan,
        segment=pool.segment,
        ins=session.ins,
        laser=session.laser,
        mbes=mbes,
        roughness_m=pool.as_built.roughness_m,
        dry_roughness_m=pool.as_built.dry_roughness_m,
        roughness_length_m=pool.as_built.roughness_length_m,
    )


def state_by_design(model: TargetModel, mbes: Mbes) -> State:
    """Return the state with the configured mount and the designed surfaces."""
    mount = mount_of(mbes.mount)
    return State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, designed_surfaces(model))
