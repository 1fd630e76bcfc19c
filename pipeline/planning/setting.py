"""What passes are predicted for: target and instruments."""

from dataclasses import dataclass

from pipeline.adjustment.problem import design_surface
from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig, Segment
from pipeline.config.session import Ins, Laser, Mbes, SessionConfig
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.target.design import target_of

BEYOND_M = 2.0  # a pass runs on beyond the last block


@dataclass(frozen=True)
class PredictionSetting:
    """Target and instruments: the same for all passes of a plan."""

    model: TargetModel
    state: State
    plan: Plan
    segment: Segment
    ins: Ins
    laser: Laser
    mbes: Mbes

    @property
    def half_length_m(self) -> float:
        """How far a pass runs to either side of the target's centre."""
        low, high = self.model.bounds()
        return float(max(-low[1], high[1])) + BEYOND_M


def setting_of(plan: Plan, pool: PoolConfig, session: SessionConfig) -> PredictionSetting:
    """Return what a plan is predicted for: target and instruments of these settings."""
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
    """Return the mount as configured, and the surfaces as designed, their centres among the faces' corners."""
    surfaces = [design_surface(model, family) for family in model.families]
    mount = mount_of(mbes.mount)
    return State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, surfaces)
