"""What passes will tell before they are sailed, by the sums and equations of a session, from points without noise.

Passes that are only candidates need not be computed together: their normal equations add up, but for the drift that
goes on from one pass to the next. Rays are thinned, and weighted with how many they stand for. The records of the INS
are not thinned, for its white noise is a record's own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.iteration import noise_of
from pipeline.adjustment.observation_model import Scene, by_design
from pipeline.config.plan import Pass, Plan
from pipeline.config.pool import PoolConfig, Segment
from pipeline.config.session import Ins, Laser, Mbes, SessionConfig
from pipeline.config.stage_settings import SonarBeams, narrow
from pipeline.maths.adjustment.interval_sums import EpochSums, epoch_sums, merged
from pipeline.maths.adjustment.normal_equations import Body, normal_equations
from pipeline.maths.adjustment.observations import SPEED_M_S
from pipeline.maths.adjustment.parameters import SIX, State
from pipeline.maths.adjustment.pose_errors import Drift, knots_of
from pipeline.maths.geometry.rotations import rotation_from_attitude
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.sonar.soundings import points_in_mbes
from pipeline.maths.target.beams import Beams
from pipeline.maths.target.labelling import LabelSettings, label_points
from pipeline.maths.target.model import TargetModel
from pipeline.mount import mount_of
from pipeline.target.design import target_of
from pipeline.target.sonar_beams import beams_in_target
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
NS = 1_000_000_000
RAYS = 24  # of the laser between two records of the INS: stand for all
PHASES, APART = 4, 1000  # of the boat's unrest, over which a prediction is averaged; numbers of passes in between
PAUSE_S = 5.0  # without points, from which on nothing is interpolated
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


@dataclass(frozen=True)
class PassSums:
    """What both sensors see in one pass: sums by interval, the body's track, points by sensor on each face (f,)."""

    sums: dict[str, EpochSums]
    trajectory: Trajectory
    points: dict[str, Array]
    seconds: float


@dataclass(frozen=True)
class PredictedPasses:
    """What passes give: normal equations of all parameters (u, u); for each pass points by sensor and face, time."""

    normal: Array
    points: list[dict[str, Array]]
    seconds: list[float]


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
    surfaces = [
        by_design(family, np.concatenate([model.faces[number].vertices_m for number in family.faces]))
        for family in model.families
    ]
    mount = mount_of(mbes.mount)
    return State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, surfaces)


def predict(
    setting: PredictionSetting, passes: Sequence[Pass], turn_s: float = 0.0, phases: int = PHASES
) -> PredictedPasses:
    """Predict what passes will tell, sailed one after the other.

    The prediction is the average over several phases of the boat's unrest: how the boat heads while the fan passes a
    block is chance.

    Parameters
    ----------
    setting : PredictionSetting
        Target and instruments.
    passes : Sequence[Pass]
        The passes, in their order.
    turn_s : float
        Time between two passes.
    phases : int
        Number of phases.
    """
    averaged = []
    for phase in range(phases):
        sums = [_pass_sums(setting, planned, phase * APART + number) for number, planned in enumerate(passes)]
        averaged.append((_normal(setting, sums, turn_s), sums))
    _, first = averaged[0]
    points = [
        {sensor: np.mean([sums[k].points[sensor] for _, sums in averaged], axis=0) for sensor in first[k].points}
        for k in range(len(passes))
    ]
    normal = np.asarray(np.mean([normal for normal, _ in averaged], axis=0))
    return PredictedPasses(normal, points, [sums.seconds for sums in first])


def _pass_sums(setting: PredictionSetting, planned: Pass, number: int) -> PassSums:
    """Return the sums of one pass; ``number`` sets the phases of the boat's unrest."""
    seconds = planned.seconds(setting.half_length_m)
    trajectory = _trajectory(setting, planned, seconds, number)
    families = {surface.family: k for k, surface in enumerate(setting.state.surfaces)}
    faces = setting.model.faces
    scene = Scene(
        _body(setting, trajectory),
        np.array([families[face.family] for face in faces]),
        np.array([face.offset_m for face in faces]),
        setting.state,
        setting.ins.white.position_m,
        setting.laser,
        setting.mbes,
    )
    caster = ClosestSurface(setting.model)
    sums: dict[str, EpochSums] = {}
    counts: dict[str, Array] = {}
    for sensor, (t_ns, rays, each) in {
        "laser": _laser_rays(setting, seconds),
        "mbes": _beams(setting, seconds),
    }.items():
        batch = label_rays(setting, caster, trajectory, Rays(sensor, t_ns, rays))
        seen = scene.observe(sensor, batch, setting.state)
        weight, v = each / seen.sigma_m**2, np.zeros(len(seen.v_m))
        sums[sensor] = epoch_sums(seen.record, seen.share, seen.surface, seen.features, weight, v)
        on_face = np.bincount(batch["face"].astype(np.int64), minlength=len(faces))
        counts[sensor] = each * on_face.astype(np.float64)
    return PassSums(sums, trajectory, counts, seconds)


def _body(setting: PredictionSetting, trajectory: Trajectory) -> Body:
    return Body.of(trajectory, mount_of(setting.laser.mount).lever_arm_body_m)


def _normal(setting: PredictionSetting, passes: Sequence[PassSums], turn_s: float) -> Array:
    """Return normal equations (u, u) of passes sailed one after the other: the drift goes on between them."""
    starts = np.cumsum([0.0, *(sailed.seconds + turn_s for sailed in passes[:-1])])
    lengths = [len(sailed.trajectory.t_ns) for sailed in passes]
    firsts = np.cumsum([0, *lengths[:-1]])
    t_ns = [sailed.trajectory.t_ns + round(start * NS) for sailed, start in zip(passes, starts, strict=True)]
    names = ("positions_m", "R_frame_from_body")
    positions, R = (np.concatenate([getattr(sailed.trajectory, name) for sailed in passes]) for name in names)
    body = _body(setting, Trajectory.build(np.concatenate(t_ns), positions, R))
    sums = {
        sensor: merged(
            replace(sailed.sums[sensor], record=sailed.sums[sensor].record + first)
            for sailed, first in zip(passes, firsts, strict=True)
        )
        for sensor in passes[0].sums
    }
    record = np.unique(np.concatenate([of_sensor.record for of_sensor in sums.values()]))
    if not len(record):
        return np.zeros((setting.state.size, setting.state.size))
    noise = noise_of(setting.ins)
    knots = knots_of(record, body.seconds, noise.spacing_s, PAUSE_S)
    drift = Drift(knots, np.zeros((len(knots.record), SIX)))
    return normal_equations(sums, setting.state, body, noise, drift).normal


def planned_track(setting: PredictionSetting, planned: Pass, number: int) -> Array:
    """Return where the INS will be, (n, 3) m in the target frame; ``number`` sets the phases of the boat's unrest."""
    return _trajectory(setting, planned, planned.seconds(setting.half_length_m), number).positions_m


def _trajectory(setting: PredictionSetting, planned: Pass, seconds: float, number: int) -> Trajectory:
    """Return poses along +y past the target, x = -distance, with waves of golden-ratio phases on every coordinate."""
    plan, unrest = setting.plan, setting.plan.unrest
    t = np.arange(0.0, seconds + 1 / plan.ins_rate_hz, 1 / plan.ins_rate_hz)
    half = planned.half_length_m or setting.half_length_m

    def wave(amplitude: float, period_s: float, which: int) -> Array:
        phase = 2 * np.pi * ((number * 5 + which) * 0.618034 % 1.0)
        return np.asarray(amplitude * np.sin(2 * np.pi * t / period_s + phase))

    period = unrest.period_s
    x = wave(unrest.sway_m, 2 * period, 0) - planned.distance_m
    y = planned.speed_m_s * t - half
    z = wave(unrest.heave_m, 0.9 * period, 1) + setting.model.water_level_m + plan.ins_height_m
    roll = wave(np.radians(unrest.roll_deg), period, 2)
    pitch = wave(np.radians(unrest.pitch_deg), 0.85 * period, 3)
    heading = wave(np.radians(planned.heading_swing_deg), 2.7 * period, 4)
    attitude = rotation_from_attitude(roll, pitch, heading)
    return Trajectory.build(np.round(t * NS).astype(np.int64), np.column_stack([x, y, z]), attitude)


def _laser_rays(setting: PredictionSetting, seconds: float) -> tuple[Integers, Array, float]:
    """Return times (n,), unit rays (n, 3) in the scanner's frame, and how many points each stands for."""
    figures = setting.plan.laser
    each = max(1, int(figures.point_rate_hz / (setting.plan.ins_rate_hz * RAYS)))
    number = np.arange(0, int(seconds * figures.point_rate_hz), each)
    low, high = np.radians(figures.field_deg)
    angle = low + (high - low) * (number * figures.line_rate_hz / figures.point_rate_hz % 1.0)
    rays = np.column_stack([np.sin(angle), np.zeros(len(angle)), np.cos(angle)])
    return np.round(number / figures.point_rate_hz * NS).astype(np.int64), rays, float(each)


def _beams(setting: PredictionSetting, seconds: float) -> tuple[Integers, Array, float]:
    """Return the same of the sonar: every beam of every ping."""
    figures = setting.plan.mbes
    half = np.radians(figures.sector_deg) / 2
    angle = np.linspace(-half, half, figures.beams)
    pings = np.arange(0.5 / figures.ping_rate_hz, seconds, 1 / figures.ping_rate_hz)
    edges_deg, tilts_deg = np.array([(sector.to_deg, sector.tilt_deg) for sector in figures.sectors] or [(90.0, 0.0)]).T
    tilt = np.radians(tilts_deg[np.searchsorted(edges_deg, np.degrees(angle))])
    speed = np.full(len(angle), SPEED_M_S)
    fan, there = points_in_mbes(2 / speed, angle, tilt, speed)
    fan = fan[there]
    return np.repeat(np.round(pings * NS).astype(np.int64), len(fan)), np.tile(fan, (len(pings), 1)), 1.0


@dataclass(frozen=True)
class Rays:
    """Rays of a sensor: times (n,), and unit directions (n, 3) in the sensor's frame."""

    sensor: str
    t_ns: Integers
    directions: Array


def label_rays(
    setting: PredictionSetting, caster: ClosestSurface, trajectory: Trajectory, sensor_rays: Rays
) -> dict[str, Array]:
    """Return where rays meet the target, with the labels that stage segment would give.

    Parameters
    ----------
    setting : PredictionSetting
        Target and instruments.
    caster : ClosestSurface
        The target's surface.
    trajectory : Trajectory
        Poses of the body in the target frame.
    sensor_rays : Rays
        The rays.

    Returns
    -------
    dict[str, Array]
        Columns as of a labelled stream.
    """
    sensor, t_ns, rays = sensor_rays.sensor, sensor_rays.t_ns, sensor_rays.directions
    mount = mount_of(setting.laser.mount) if sensor == "laser" else None
    R = setting.state.R_body_from_sensor if mount is None else mount.R_body_from_sensor
    lever = setting.state.lever_arm_m if mount is None else mount.lever_arm_body_m
    figures = setting.plan.laser if sensor == "laser" else setting.plan.mbes
    origins = trajectory.points_from_body(t_ns, np.broadcast_to(lever, rays.shape))
    directions = trajectory.points_from_body(t_ns, rays @ R.T + lever) - origins
    range_m = caster.ranges(origins, directions)
    met = np.flatnonzero(range_m < figures.max_range_m)
    own, range_m, directions = rays[met] * range_m[met, None], range_m[met], directions[met]
    points = origins[met] + directions * range_m[:, None]
    segment, level = setting.segment, setting.model.water_level_m
    if sensor == "mbes":
        _, R_target_from_body = trajectory.poses_at(t_ns[met])
        beams = beams_in_target(R_target_from_body, R, own, narrow(SonarBeams, setting.mbes))
        heights = (-np.inf, level - segment.water_margin_m)
    else:
        beams, heights = Beams(directions, range_m), (level + segment.water_margin_m, np.inf)
    limits = LabelSettings(
        gate_m=segment.gate_m,
        margin_m=segment.margin_m,
        min_grazing_rad=float(np.radians(segment.min_grazing_deg)),
        lowest_m=heights[0],
        highest_m=heights[1],
        seen="wet" if sensor == "mbes" else "dry",
    )
    labels = label_points(setting.model, points, beams, limits)
    on = np.flatnonzero(labels.face >= 0)
    columns = {f"{axis}_{sensor}_m": own[on, k] for k, axis in enumerate("xyz")}
    columns |= {f"{axis}_target_m": points[on, k] for k, axis in enumerate("xyz")}
    return columns | {"t_ns": t_ns[met][on], "face": labels.face[on]}
