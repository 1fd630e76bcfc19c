"""The program's adjustment on the one plane of LibAC's rows: the laser's mount from its points on it, in both passes.

As in a calibration of the laser (:mod:`pipeline.adjustment.laser_design`) the coarse mount is an observation of all six
values, here LibAC's own with the default sigmas. But nobody knows where the plane is, or how it stands: its two turns
and its place are unknown without any prior information. Noise: of the points the rows' own sigma of a coordinate, along
the ray and across it; of the INS the rows' own sigmas of position as its drift, the session's defaults for the rest.

A record of the INS is the pose at the start of a line of the scanner, 20 ms from the next: a line lasts 0.1 ms.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.ins_drift import pose_noise
from pipeline.adjustment.iteration import MountAdjustment, adjust_mount
from pipeline.adjustment.laser_design import coarse_mount
from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.problem import CalibrationProblem, PriorInformation, sensor_sigmas
from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.mount import Covariance, Mount, MountOrigin
from pipeline.config.pool import Adjust, Ingest, LaserFit
from pipeline.config.session import Drift, White
from pipeline.config.stage_settings import LaserPrior, narrow
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.drift_likelihood import DriftPrior
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.adjustment.pseudo_observations import ParameterPrior
from pipeline.maths.adjustment.solution import ConsiderErrors
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.mount import Mounted
from tools.libac_rows import Rows
from tools.libac_surfaces import plane_through

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RowLaser:
    """The laser: its coarse mount, of which no covariance is known; standard deviations of a range and of an angle."""

    mount: Mount
    range_sigma_m: float
    angle_sigma_deg: float
    mount_covariance: Covariance | None = None
    mount_origin: MountOrigin | None = None


@dataclass(frozen=True)
class PlanePoints:
    """The rows of one pass, and which of them (k,) lie on the plane."""

    rows: Rows
    chosen: NDArray[np.int64]


@dataclass(frozen=True)
class Adjusted:
    """The adjustment; the covariance (6, 6) of the coarse mount, rad and m, body axes; the INS's errors as expected."""

    result: MountAdjustment
    coarse: Array
    noise: PoseNoise

    @property
    def mount(self) -> Mounted:
        """Return the adjusted mount."""
        return Mounted(self.result.state.R_body_from_sensor, self.result.state.lever_arm_m)

    @property
    def covariance(self) -> Array:
        """Return the covariance (6, 6) of the adjusted mount, with the errors of the coarse mount."""
        return np.asarray(self.result.solution.covariance[:N_MOUNT, :N_MOUNT])

    @property
    def shares(self) -> Array:
        """Return the sigmas after by those before, along six independent directions, the best determined first.

        They are the roots of the eigenvalues of L⁻¹ C L⁻ᵀ, with L Lᵀ the coarse covariance: 1 says that the points tell
        nothing of a direction.
        """
        half = np.linalg.inv(np.linalg.cholesky(self.coarse))
        return np.asarray(np.sqrt(np.linalg.eigvalsh(half @ self.covariance @ half.T)))


def adjusted_on(ordered: Sequence[PlanePoints], mount: Mounted) -> Adjusted:
    """Return the adjustment of the laser's mount to one plane that several passes see, in the order of time."""
    trajectory = _records(ordered)
    batch = _batch(ordered, mount, trajectory)
    start = plane_through(ordered[0].rows.in_level(mount), ordered[0].chosen, ordered[0].rows.position_m[0]).plane
    state = State.at(
        mount.R_body_from_sensor,
        mount.lever_arm_body_m,
        [ObservedSurface.at("target1", start.normal, start.centroid_m)],
        "laser",
    )
    laser = _laser_of(ordered, mount)
    _, coarse = coarse_mount(laser, narrow(LaserPrior, LaserFit()))
    model = ObservationModel(
        body=BodyMotion.of(trajectory, mount.lever_arm_body_m),
        faces=Faces(("target1",), np.zeros(1, dtype=np.int64), np.ones(1)),
        height_of_face=np.zeros(1),
        coarse=state,
        sigmas={"laser": sensor_sigmas(laser)},
        wet_heights_m=(-1.0, 0.0),  # of a sonar, which is not here
    )
    prior = PriorInformation(
        noise=_noise_of_ins(ordered),
        drift=DriftPrior(0.0, 0.0),
        parameters=ParameterPrior(np.arange(N_MOUNT), coarse, state),
        from_start=True,
    )
    problem = CalibrationProblem(model, prior, ConsiderErrors(np.zeros(state.size)))
    found = adjust_mount(problem, {"laser": Stream((MemoryPart("laser", batch),))}, Adjust(), Ingest().max_gap_s)
    return Adjusted(found, coarse, prior.noise)


def _laser_of(ordered: Sequence[PlanePoints], mount: Mounted) -> RowLaser:
    sigma_m = float(np.mean([one.rows.laser_sigma_m[one.chosen].mean() for one in ordered]))
    range_m = float(np.mean([one.rows.range_m for one in ordered]))
    return RowLaser(Mount(**mount.settings()), sigma_m, float(np.degrees(sigma_m / range_m)))


def _noise_of_ins(ordered: Sequence[PlanePoints]) -> PoseNoise:
    sigma = np.concatenate([one.rows.position_sigma_m for one in ordered]).mean(axis=0)
    drift = Drift(horizontal_m=float(sigma[:2].mean()), vertical_m=float(sigma[2]))
    return pose_noise(drift, White())


def _records(ordered: Sequence[PlanePoints]) -> Trajectory:
    """Return the poses at the start of each line, and the last of each pass a nanosecond late.

    A point at the time of a pass's last record would count to the interval up to the next pass.
    """
    parts = [one.rows.trajectory(np.r_[one.rows.line_starts, len(one.rows) - 1]) for one in ordered]
    return Trajectory.build(
        np.concatenate([np.r_[part.t_ns[:-1], part.t_ns[-1] + 1] for part in parts]),
        np.concatenate([part.positions_m for part in parts]),
        np.concatenate([part.R_frame_from_body for part in parts]),
    )


def _batch(ordered: Sequence[PlanePoints], mount: Mounted, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Return columns of the points on the plane, in the order of time."""
    t_ns = np.concatenate([one.rows.t_ns[one.chosen] for one in ordered])
    columns: dict[str, np.ndarray] = {"t_ns": t_ns, "face": np.zeros(len(t_ns), np.int16)}
    columns["edge_weight"] = np.ones(len(t_ns))
    own = np.concatenate([one.rows.laser_m[one.chosen] for one in ordered])
    placed = np.concatenate([one.rows.in_level(mount, trajectory)[one.chosen] for one in ordered])
    for frame, places in (("laser", own), ("target", placed)):
        columns |= {f"{axis}_{frame}_m": places[:, k] for k, axis in enumerate("xyz")}
    return columns
