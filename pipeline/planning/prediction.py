"""Prediction of the normal equations of passes before they are sailed, from points without noise.

It forms the same sums and equations as a session does. Candidates for a pass are computed one by one, and their normal
equations are added. This is exact except for the drift, which goes on from one pass to the next, and for the edge
shares, which are each candidate's own and differ by some per cent. The laser's rays are thinned, and each has the
weight of all rays that it represents. The INS records are not thinned, because each record has its own white noise.
Roughness of the wet faces that is stated beforehand counts among the passes that are predicted together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.ins_drift import pose_noise
from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.adjustment.problem import faces_on_surfaces, sensor_sigmas
from pipeline.config.plan import WAVE_PERIODS, WAVE_SHARES, Pass
from pipeline.gps_time import NS
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.face_shifts import equations_with_faces
from pipeline.maths.adjustment.interval_sums import IntervalSums, merged
from pipeline.maths.adjustment.normal_equations import Linearisation, normal_equations
from pipeline.maths.adjustment.ping_noise import DesignEffects, with_design_effects
from pipeline.maths.adjustment.roughness import expected_roughness
from pipeline.maths.adjustment.weighting import edge_shares, rescaled
from pipeline.maths.geometry.rotations import rotation_from_attitude
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import mount_of
from pipeline.planning.planned_rays import label_rays, laser_rays, sonar_rays
from pipeline.planning.setting import PredictionSetting
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
PHASE_STEPS = np.array([0.618034, 0.414214])  # of the two waves, in turns; irrational, so that all phases come
PHASES, APART = 4, 1000  # number of phases of the boat's unrest in a prediction; step of the pass number between them
PAUSE_S = 5.0  # a longer time without points interrupts the knots of the drift


@dataclass(frozen=True)
class PassSums:
    """Predicted data of one pass: trajectory, points (f,) on the faces by sensor, time (s).

    sums: by sensor, those of each interval and face.
    """

    sums: dict[str, IntervalSums]
    trajectory: Trajectory
    points: dict[str, Array]
    seconds: float


@dataclass(frozen=True)
class PredictedPasses:
    """Prediction for passes: normal matrices of all parameters; points by sensor and face, and time, by pass.

    normals: by phase of the boat's unrest, (u, u), or (u + f, u + f) with the shifts of single faces after all others.
    Points are means over the phases.
    """

    normals: tuple[Array, ...]
    points: list[dict[str, Array]]
    seconds: list[float]

    @cached_property
    def normal(self) -> Array:
        """Mean of the normal matrices over the phases."""
        return np.asarray(np.mean(self.normals, axis=0))


def predict(
    setting: PredictionSetting,
    passes: Sequence[Pass],
    turn_s: float = 0.0,
    phases: int = PHASES,
    single_faces: bool = False,
) -> PredictedPasses:
    """Return the prediction for passes that are sailed one after the other.

    Several phases of the boat's unrest are predicted, because the heading at the moment when the fan passes a block is
    random.

    Parameters
    ----------
    setting : PredictionSetting
        Target and instruments.
    passes : Sequence[Pass]
        The passes, in their order.
    turn_s : float
        Time between two passes (s).
    phases : int
        Number of phases of the unrest.
    single_faces : bool
        Whether the shifts of single faces are parameters, too.
    """
    normals, averaged = [], []
    for phase in range(phases):
        sums = [_pass_sums(setting, planned, phase * APART + number) for number, planned in enumerate(passes)]
        normals.append(_normal(setting, sums, turn_s, single_faces))
        averaged.append(sums)
    first = averaged[0]
    points = [
        {sensor: np.mean([sums[k].points[sensor] for sums in averaged], axis=0) for sensor in first[k].points}
        for k in range(len(passes))
    ]
    return PredictedPasses(tuple(normals), points, [sums.seconds for sums in first])


def _pass_sums(setting: PredictionSetting, planned: Pass, number: int) -> PassSums:
    """Return the sums of one pass; ``number`` sets the phases of the boat's unrest."""
    seconds = planned.seconds(setting.half_length_m)
    trajectory = _trajectory(setting, planned, seconds, number)
    faces = setting.model.faces
    observation_model = ObservationModel(
        body=_body(setting, trajectory),
        faces=faces_on_surfaces(faces, setting.state),
        height_of_face=np.array([face.offset_m for face in faces]),
        coarse=setting.state,
        sigmas={"laser": sensor_sigmas(setting.laser), "mbes": sensor_sigmas(setting.mbes)},
        wet_heights_m=setting.model.wet_heights_m,
    )
    caster = ClosestSurface(setting.model)
    sums: dict[str, IntervalSums] = {}
    counts: dict[str, Array] = {}
    for rays, each in (laser_rays(setting, seconds), sonar_rays(setting, seconds)):
        batch = label_rays(setting, caster, trajectory, rays)
        observations = observation_model.linearise(rays.sensor, batch, CurrentValues(setting.state))
        true = replace(observations, v_m=np.zeros_like(observations.v_m))  # as if the points were free from errors
        sums[rays.sensor] = true.sums(each * observations.edge_weight / observations.sigma_m**2, by_face=True)
        on_face = np.bincount(batch["face"].astype(np.int64), minlength=len(faces))
        counts[rays.sensor] = each * on_face.astype(np.float64)
    return PassSums(sums, trajectory, counts, seconds)


def _body(setting: PredictionSetting, trajectory: Trajectory) -> BodyMotion:
    return BodyMotion.of(trajectory, mount_of(setting.laser.mount).lever_arm_body_m)


def _normal(setting: PredictionSetting, passes: Sequence[PassSums], turn_s: float, single_faces: bool) -> Array:
    """Return the normal matrix (u, u) of passes sailed one after the other. The drift goes on between them.

    ``single_faces``: with the shifts of single faces after all others.
    """
    faces = faces_on_surfaces(setting.model.faces, setting.state)
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
    size = setting.state.size + (len(faces.names) if single_faces else 0)
    record = np.unique(np.concatenate([of_sensor.record for of_sensor in sums.values()]))
    if not len(record):
        return np.zeros((size, size))
    noise = pose_noise(setting.ins.drift, setting.ins.white)
    drift = body.zero_drift(record, noise, PAUSE_S)
    by_surface = {
        sensor: merged([replace(of_sensor, surface=faces.surface[of_sensor.surface])])
        for sensor, of_sensor in sums.items()
    }
    shares = {sensor: edge_shares(one, len(setting.state.surfaces)) for sensor, one in by_surface.items()}
    scaled = {sensor: rescaled(one, shares[sensor]) for sensor, one in by_surface.items()}
    effects = {sensor: 1 + _roughness(setting, sensor, one) for sensor, one in scaled.items()}
    if single_faces:
        by_face = {
            sensor: with_design_effects(
                rescaled(one, shares[sensor][faces.surface]), DesignEffects(*[effects[sensor][faces.surface]] * 2)
            )
            for sensor, one in sums.items()
        }
        return equations_with_faces(Linearisation(by_face, setting.state, body, drift), faces, drift, noise).normal
    by_surface = {
        sensor: with_design_effects(one, DesignEffects(effects[sensor], effects[sensor]))
        for sensor, one in scaled.items()
    }
    return normal_equations(Linearisation(by_surface, setting.state, body, drift), drift, noise).normal


def _roughness(setting: PredictionSetting, sensor: str, sums: IntervalSums) -> Array:
    """Return what the faces' roughness adds to the design effects (s,) of a sensor's points in these passes."""
    weight = np.zeros(len(setting.state.surfaces))
    np.add.at(weight, sums.surface, sums.normal[:, 0, 0])
    rms_m = setting.roughness_m if sensor == "mbes" else setting.dry_roughness_m
    return expected_roughness(weight, setting.areas_m2(wet=sensor == "mbes"), rms_m, setting.roughness_length_m)


def planned_track(setting: PredictionSetting, planned: Pass, number: int) -> Array:
    """Return the INS's positions (n, 3) m in the target frame; ``number`` sets the phases of the boat's unrest."""
    return _trajectory(setting, planned, planned.seconds(setting.half_length_m), number).positions_m


def _trajectory(setting: PredictionSetting, planned: Pass, seconds: float, number: int) -> Trajectory:
    """Return poses along ±y past the target at x = -distance, with two waves on all except y."""
    plan, unrest = setting.plan, setting.plan.unrest
    t = np.arange(0.0, seconds + 1 / plan.ins_rate_hz, 1 / plan.ins_rate_hz)
    half = planned.half_length_m or setting.half_length_m
    middle = setting.middle_m if planned.middle_m is None else planned.middle_m

    def wave(amplitude: float, period_s: float, which: int) -> Array:
        phases = 2 * np.pi * np.modf((number * 5 + which) * PHASE_STEPS)[0]
        angles = 2 * np.pi * np.divide.outer(t, np.multiply(WAVE_PERIODS, period_s)) + phases
        return np.asarray(amplitude * (np.sin(angles) @ WAVE_SHARES))

    period = unrest.period_s
    x = wave(unrest.sway_m, 2 * period, 0) - planned.distance_m
    sense = 1.0 if planned.course == "along" else -1.0
    y = middle + sense * (planned.speed_m_s * t - half)
    z = wave(unrest.heave_m, 0.9 * period, 1) + setting.model.water_level_m + plan.ins_height_m
    roll = wave(np.radians(unrest.roll_deg), period, 2)
    pitch = wave(np.radians(unrest.pitch_deg), 0.85 * period, 3)
    heading = wave(np.radians(planned.heading_swing_deg), 2.7 * period, 4) + (0.0 if sense > 0 else np.pi)
    attitude = rotation_from_attitude(roll, pitch, heading)
    return Trajectory.build(np.round(t * NS).astype(np.int64), np.column_stack([x, y, z]), attitude)


