"""The setting of a prediction: target and instruments."""

from dataclasses import dataclass

from pipeline.adjustment.problem import designed_surfaces
from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig, Segment
from pipeline.config.session import Ins, Laser, Mbes, SessionConfig
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.target.design import target_of

BEYOND_M = 2.0  # from the last block to the end of a pass


@dataclass(frozen=True)
class PredictionSetting:
    """Target and instruments, which are the same for all passes of a plan."""

    model: TargetModel
    state: State
    plan: Plan
    segment: Segment
    ins: Ins
    laser: Laser
    mbes: Mbes

    @property
    def half_length_m(self) -> float:
        """Length of a pass on either side of the target's centre."""
        low, high = self.model.bounds()
        return float(max(-low[1], high[1])) + BEYOND_M


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
    )


def state_by_design(model: TargetModel, mbes: Mbes) -> State:
    """Return the state with the configured mount and the designed surfaces."""
    mount = mount_of(mbes.mount)
    return State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, designed_surfaces(model))
