"""Points of the laser and of one or two heads by a forward model of its own, their errors, and their adjustment."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from pipeline.adjustment.ins_drift import pose_noise
from pipeline.adjustment.iteration import MountAdjustment, adjust_mount
from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.problem import CalibrationProblem, PriorInformation, sensor_sigmas
from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.mount import Mount
from pipeline.config.pool import Adjust
from pipeline.config.session import Drift, Ins, Laser, Mbes, White
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import FurtherHead, State
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.geometry.trajectory import Trajectory
from tests.support.mount_errors import rotation_error

R_TRUE = Rotation.from_euler("ZXY", np.radians([-2.0, 1.2, -48.8])).as_matrix()
LEVER_TRUE = np.array([0.3, 0.2, -2.0])
R_SECOND = Rotation.from_euler("ZXY", np.radians([3.0, -0.7, -35.0])).as_matrix()  # of a second head
LEVER_SECOND = np.array([-0.4, 0.1, -1.9])
R_LASER = Rotation.from_euler("ZXY", np.radians([0.4, -0.2, 0.3])).as_matrix()
LASER_LEVER = np.array([0.2, 0.5, 1.1])
ROOT = np.sqrt(0.5)
FACES = (  # family, normal, a point on it, height above the family's plane
    ("P1", (-ROOT, -ROOT, 0.0), (0.5, -2.0, 0.0), 0.0),
    ("P2", (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0),
    ("P3", (-ROOT, ROOT, 0.0), (0.5, 2.0, 0.0), 0.0),
    ("H", (0.0, 0.0, 1.0), (0.5, 1.8, -1.5), -1.5),
    ("H", (0.0, 0.0, 1.0), (0.5, -1.8, 1.0), 1.0),
)
MBES_ONLY = 3  # number of the face that the sonar alone sees
MOUNT = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": 0.0}
LASER = Laser(files=["x"], format="las", mount=Mount(**MOUNT), angle_sigma_deg=0.003)
MBES = Mbes(files=["x"], format="r2sonic", mount=Mount(**MOUNT))
QUIET = Ins(
    files=["x"],
    format="table",
    drift=Drift(horizontal_m=0, vertical_m=0, roll_pitch_deg=0, heading_deg=0),
    white=White(position_m=0, attitude_deg=0),
)
NOISY = Ins(files=["x"], format="table")
RATE, SECONDS, GAP = 50, 8.0, 60.0
NS = 1_000_000_000


def motion(t: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """True poses: a pass at 4 m, and after a minute one at 8 m, rolling and swinging."""
    second = t > SECONDS + GAP / 2
    along = np.where(second, t - SECONDS - GAP, t) * 0.6 - 2.4
    p = np.column_stack([np.where(second, -8.0, -4.0) + 0.1 * np.sin(t), along, 1.3 + 0.05 * np.cos(0.9 * t)])
    angles = np.radians([2.0, 1.0, 1.5]) * np.sin(np.outer(t, [0.5, 1.1, 1.4]) + np.arange(3))
    return p, Rotation.from_euler("ZXY", angles)


def drift_of(rng: np.random.Generator, t: np.ndarray, drift: Drift) -> np.ndarray:
    """Gauss-Markov, step by step; (n, 6)."""
    angles = np.radians([drift.roll_pitch_deg, drift.roll_pitch_deg, drift.heading_deg])
    sigma = np.r_[drift.horizontal_m, drift.horizontal_m, drift.vertical_m, angles]
    found = [sigma * rng.normal(size=6)]
    for step in np.diff(t):
        phi = np.exp(-step / drift.time_constant_s)
        found.append(phi * found[-1] + np.sqrt(1 - phi**2) * sigma * rng.normal(size=6))
    return np.array(found)


def made(
    seed: int,
    ins: Ins = QUIET,
    sensors: float = 1.0,
    latency_s: float = 0.0,
    faster: float = 0.0,
    shifted: Mapping[int, float] = {},
    heads: int = 1,
) -> tuple[dict[str, Stream], ObservationModel]:
    """Points of all sensors; the sonar's clock late by ``latency_s``, the sound faster than recorded by a share.

    ``shifted``: distances (m) by which faces stand off their place, along the normal.
    """
    stands_off = np.array([shifted.get(k, 0.0) for k in range(len(FACES))])
    rng = np.random.default_rng(seed)
    t = np.r_[np.arange(0, SECONDS, 1 / RATE), SECONDS + GAP + np.arange(0, SECONDS, 1 / RATE)]
    p, T = motion(t)
    error = drift_of(rng, t, ins.drift)
    error[:, :3] += ins.white.position_m * rng.normal(size=(len(t), 3))
    error[:, 3:] += np.radians(ins.white.attitude_deg) * rng.normal(size=(len(t), 3))
    recorded = Rotation.from_rotvec(-error[:, 3:]) * T
    trajectory = Trajectory.build((t * NS).round().astype(np.int64), p - error[:, :3], recorded.as_matrix())
    place = Slerp(t, T)

    def moments(each: int, epochs: int) -> np.ndarray:
        moment = rng.uniform(0, SECONDS - 2 / RATE, epochs) + rng.integers(0, 2, epochs) * (SECONDS + GAP)
        return np.repeat(np.sort(moment), each)

    def met(moment: np.ndarray, face: np.ndarray, rays: np.ndarray, lever: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Where rays (unit, sensor frame) meet these faces' planes, in the sensor's frame; NaN: beyond, or grazed."""
        T = place(moment)
        origin = np.array([np.interp(moment, t, column) for column in p.T]).T + T.apply(lever)
        normal = np.array([one[1] for one in FACES])[face]
        distance = np.sum(normal * (np.array([one[2] for one in FACES])[face] - origin), axis=1) + stands_off[face]
        slant = np.sum(normal * T.apply(rays @ R.T), axis=1)
        ranges = distance / slant
        return rays * np.where((ranges > 1.5) & (ranges < 14) & (np.abs(slant) > 0.09), ranges, np.nan)[:, None]

    moment = moments(25, 400)
    face = np.repeat(rng.choice([0, 1, 2, 4], 400, p=[0.2, 0.5, 0.2, 0.1]), 25)
    away, up = np.radians([rng.uniform(-25, 25, len(moment)), rng.uniform(-25, 25, len(moment))])
    x = met(moment, face, Rotation.from_euler("ZY", np.column_stack([away, up])).apply([1, 0, 0]), LASER_LEVER, R_LASER)
    moment, face, x = (values[np.isfinite(x[:, 0])] for values in (moment, face, x))
    ray = x / np.linalg.norm(x, axis=1, keepdims=True)
    x = x + sensors * 0.005 * ray * rng.normal(size=(len(x), 1))
    length = np.linalg.norm(x, axis=1, keepdims=True)
    x = x + sensors * np.radians(0.003) * length * np.cross(ray, rng.normal(size=x.shape))
    t_ns = (moment * NS).round().astype(np.int64)
    target = trajectory.points_from_body(t_ns, x @ R_LASER.T + LASER_LEVER)
    laser = columns(t_ns, face, x, "laser_m") | {f"{axis}_target_m": target[:, k] for k, axis in enumerate("xyz")}

    def soundings(lever: np.ndarray, R: np.ndarray) -> dict[str, np.ndarray]:
        moment = moments(30, 160)
        face = np.repeat(rng.choice([0, 1, 2, 3], 160, p=[0.2, 0.5, 0.2, 0.1]), 30)
        angle = rng.uniform(np.radians(-45), np.radians(40), len(moment))
        rays = np.column_stack([np.sin(angle), 0 * angle, -np.cos(angle)])
        strayed = angle + sensors * np.radians(0.06) * rng.normal(size=len(angle))
        x = met(moment, face, np.column_stack([np.sin(strayed), 0 * angle, -np.cos(strayed)]), lever, R)
        x = rays * np.linalg.norm(x, axis=1, keepdims=True)  # recorded at the angle that was meant
        moment, face, x = (values[np.isfinite(x[:, 0])] for values in (moment, face, x))
        x = x + sensors * 0.008 * x / np.linalg.norm(x, axis=1, keepdims=True) * rng.normal(size=(len(x), 1))
        down = -x[:, 2]
        x = x - faster * np.column_stack([2 * x[:, 0], 0 * down, -down + x[:, 0] ** 2 / down])
        return columns(((moment + latency_s) * NS).round().astype(np.int64), face, x, "mbes_m")

    mounts = {"mbes": (LEVER_TRUE, R_TRUE), "mbes_2": (LEVER_SECOND, R_SECOND)}
    sonars = {name: soundings(*mounts[name]) for name in list(mounts)[:heads]}

    numbers = {"P1": 0, "P2": 1, "P3": 2, "H": 3}
    surfaces = [ObservedSurface.at(FACES[k][0], np.array(FACES[k][1]), np.array(FACES[k][2]), 0.0) for k in range(3)]
    surfaces.append(ObservedSurface.at("H", np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.0, 0.0]), 0.0))
    coarse = Rotation.from_rotvec(np.radians([2.5, -2.0, 2.2])).as_matrix()
    further = [FurtherHead("mbes_2", coarse.T @ R_SECOND, LEVER_SECOND - [0.15, 0.1, -0.2])][: heads - 1]
    model = ObservationModel(
        BodyMotion.of(trajectory, LASER_LEVER),
        Faces(tuple(f"{k}" for k in range(len(FACES))), np.array([numbers[f] for f, *_ in FACES]), np.ones(len(FACES))),
        np.array([height for *_, height in FACES]),
        State.at(coarse @ R_TRUE, LEVER_TRUE + np.array([0.2, -0.25, 0.22]), surfaces, further=further),
        {"laser": sensor_sigmas(LASER), **dict.fromkeys(sonars, sensor_sigmas(MBES))},
        (-4.0, 0.0),
    )
    return {name: Stream((MemoryPart(name, points),)) for name, points in {"laser": laser, **sonars}.items()}, model


def columns(t_ns: np.ndarray, face: np.ndarray, x: np.ndarray, suffix: str) -> dict[str, np.ndarray]:
    labels = {"t_ns": t_ns, "face": face.astype(np.int16), "edge_weight": np.ones(len(t_ns), dtype=np.float32)}
    return labels | {f"{axis}_{suffix}": x[:, k] for k, axis in enumerate("xyz")}


def error_of(found: MountAdjustment) -> np.ndarray:
    """ε of R_true = Exp(ε) R, and of the lever arm; of one head after the other."""
    errors = []
    for head, (R, lever) in zip(found.state.heads, ((R_TRUE, LEVER_TRUE), (R_SECOND, LEVER_SECOND)), strict=False):
        R_found, lever_found = found.state.mount_of(head)
        errors += [rotation_error(R, R_found), lever - lever_found]
    return np.concatenate(errors)


def solved(seed: int, ins: Ins = QUIET, settings: Any = None, **options: Any) -> MountAdjustment:
    streams, model = made(seed, ins, **options)
    return adjust_mount(problem(model, ins), streams, settings or Adjust(), 5.0)


def problem(model: ObservationModel, ins: Ins) -> CalibrationProblem:
    """The noise of this INS, and nothing else known."""
    prior = PriorInformation(pose_noise(ins.drift, ins.white))
    return CalibrationProblem(model, prior, ConsiderErrors(np.zeros(model.coarse.size)))
