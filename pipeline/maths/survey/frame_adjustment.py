"""Adjustment of frames in one survey of marks by rigid transformations: least squares with the full covariance.

A mark i stands at s_i in the survey and, by the drawing of frame f, at x_i in that frame. With R_f = R_survey_from_f
and t_f the frame's origin in the survey,

    r_fi = s_i - R_f x_i - t_f = e_i - R_f d_fi,

where e_i is the survey's error (covariance S_i) and d_fi the drawing's (D_fi, in the frame's own axes). A mark of two
frames has its e_i in the residuals of both. So all frames are adjusted together, with the covariance of the stacked
residuals

    Σ = B diag(S) Bᵀ + Σ_f B_f diag(R_f D_f R_fᵀ) B_fᵀ,      B = ∂r/∂s, B_f its rows of frame f.

A frame may instead be defined by *axes*. Its origin is a mark (a point with x = 0). One of its axes runs through two
marks (with d the vector between them, the two other components of R_fᵀ d are zero). The INS reads the turn about that
axis (roll or pitch of R_level_from_body, CONVENTIONS.md; its difference from the reading is zero). These are six
conditions for six unknowns.

The iteration starts from the closed form of Kabsch (1976) and Umeyama (IEEE PAMI 13, 1991), with det = +1 enforced.
Gauss-Newton follows (the Gauss-Helmert model, e.g. Förstner and Wrobel 2016, 4.8) over u = (η_f, δt_f), with
R_f <- Exp(η_f) R_f, in survey axes:

    ∂r/∂η = skew(R x),   ∂r/∂t = -1;   ∂(Rᵀ d)/∂η = Rᵀ skew(d);   C = (Jᵀ Σ⁻¹ J)⁻¹,   Ω = rᵀ Σ⁻¹ r ~ chi²(n - u).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import NotConvergedError
from pipeline.maths.geometry.rotations import rotation_x, rotation_y, skew
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.maths.survey.frames import FORWARD, FramePose, MarkSurvey, RigidFrame

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
MOST_ITERATIONS = 50
STEP_TOLERANCE = 1e-9  # largest step, rad and m, that ends the iteration


@dataclass(frozen=True)
class FrameAdjustment:
    """Result of the adjustment of f frames.

    Parameters
    ----------
    poses
        Poses of the frames.
    covariance
        Covariance (6 f, 6 f) of the poses' (η, δt), rad and m in survey axes.
    residuals, rows
        Residuals r (n,), and the rows of each frame.
    weight
        W = Σ⁻¹ (n, n).
    by_survey
        B (n, m, 3): derivatives of the residuals by the coordinates of the m marks of the survey.
    design
        J (n, 6 f).
    """

    poses: tuple[FramePose, ...]
    covariance: Array
    residuals: Array
    rows: tuple[slice, ...]
    weight: Array
    by_survey: Array
    design: Array

    @property
    def squares(self) -> float:
        """Return Ω = rᵀ Σ⁻¹ r."""
        return float(self.residuals @ self.weight @ self.residuals)

    @property
    def redundancy(self) -> int:
        """Return the number of residuals minus the number of unknowns."""
        return int(np.subtract(*self.design.shape))

    def residuals_of(self, frame: int, points: int) -> Array:
        """Return the residuals (points, 3) m of the marks of a frame, survey minus drawing, survey axes."""
        start = self.rows[frame].start
        return self.residuals[start : start + 3 * points].reshape(points, 3)


def closed_form(drawing_m: Array, survey_m: Array, weight: Array, mirrored: bool = False) -> tuple[Array, Array]:
    """Return R (3, 3) and t (3,) that minimise Σ w |s - R x - t|² with det R = +1.

    With the centred H = Σ w s xᵀ = U S Vᵀ: R = U diag(1, 1, ±det U det V) Vᵀ (Kabsch; Umeyama, eq. 40 to 43).

    Parameters
    ----------
    drawing_m, survey_m
        Places x and s (n, 3).
    weight
        Weights w (n,).
    mirrored
        True: det R = -1 instead.

    >>> R, t = closed_form(np.eye(3), np.eye(3) @ rotation_x(0.3).T + [1, 2, 3], np.ones(3))
    >>> bool(np.allclose(R, rotation_x(0.3))), t.round(9)
    (True, array([1., 2., 3.]))
    """
    share = weight / weight.sum()
    middle, centre = share @ drawing_m, share @ survey_m
    U, _, Vt = np.linalg.svd(((survey_m - centre) * share[:, None]).T @ (drawing_m - middle))
    sign = np.sign(np.linalg.det(U @ Vt)) * (-1.0 if mirrored else 1.0)
    R = U @ np.diag([1.0, 1.0, sign]) @ Vt
    return R, centre - R @ middle


def adjust_frames(survey: MarkSurvey, frames: Sequence[RigidFrame]) -> FrameAdjustment:
    """Adjust all frames together, by iteration to convergence.

    Raises
    ------
    NotConvergedError
        The marks do not fit their drawings even roughly.
    """
    centre = survey.at_m.mean(axis=0)  # national grids have coordinates of millions of metres
    near = MarkSurvey(survey.at_m - centre, survey.covariance)
    poses = [_start(near, frame) for frame in frames]
    for _ in range(MOST_ITERATIONS):
        system = _system(near, frames, poses)
        whiten = np.linalg.inv(np.linalg.cholesky(system.covariance))
        step = -np.linalg.lstsq(whiten @ system.design, whiten @ system.residuals, rcond=None)[0]
        poses = [pose.updated(np.asarray(part)) for pose, part in zip(poses, step.reshape(-1, N_MOUNT), strict=True)]
        if np.abs(step).max() < STEP_TOLERANCE:
            break
    else:
        raise NotConvergedError("the marks do not fit their drawings even roughly; check names and coordinates")
    system = _system(near, frames, poses)
    whiten = np.linalg.inv(np.linalg.cholesky(system.covariance))
    weight, rotated = whiten.T @ whiten, whiten @ system.design
    covariance = np.linalg.inv(rotated.T @ rotated)
    placed = tuple(replace(pose, origin_m=pose.origin_m + centre) for pose in poses)
    return FrameAdjustment(
        poses=placed,
        covariance=(covariance + covariance.T) / 2,
        residuals=system.residuals,
        rows=system.rows,
        weight=weight,
        by_survey=system.by_survey,
        design=system.design,
    )


def relative_mount(adjusted: FrameAdjustment, body: int, sensor: int) -> tuple[Array, Array, Array]:
    """Return R_body_from_sensor (3, 3), the lever arm (3,) m and their covariance (6, 6) of a sensor on the body.

    R_bs = R_wbᵀ R_ws and l = R_wbᵀ (t_s - t_b). With Exp(η) R the true rotations, to first order

        ε = R_wbᵀ (η_s - η_b),    δl = R_wbᵀ (δt_s - δt_b - η_b x (t_s - t_b)),

    ε in R_true = Exp(ε) R_bs, body axes; rad and m.

    Parameters
    ----------
    adjusted
        Adjustment of the frames.
    body, sensor
        Numbers of the two frames.
    """
    body_pose, sensor_pose = adjusted.poses[body], adjusted.poses[sensor]
    to_body = body_pose.R_survey_from_frame.T
    between = sensor_pose.origin_m - body_pose.origin_m
    jacobian = np.zeros((N_MOUNT, len(adjusted.covariance)))
    for frame, sign in ((body, -1.0), (sensor, 1.0)):
        jacobian[:3, N_MOUNT * frame : N_MOUNT * frame + 3] += sign * to_body
        jacobian[3:, N_MOUNT * frame + 3 : N_MOUNT * frame + N_MOUNT] += sign * to_body
    jacobian[3:, N_MOUNT * body : N_MOUNT * body + 3] += to_body @ skew(between)
    covariance = jacobian @ adjusted.covariance @ jacobian.T
    return to_body @ sensor_pose.R_survey_from_frame, to_body @ between, (covariance + covariance.T) / 2


# --- the linear system -----------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _System:
    residuals: Array
    design: Array
    by_survey: Array
    covariance: Array
    rows: tuple[slice, ...]


def _system(survey: MarkSurvey, frames: Sequence[RigidFrame], poses: Sequence[FramePose]) -> _System:
    """Return residuals, J, B and Σ of all frames at these poses."""
    parts = [_rows_of(survey, frame, pose) for frame, pose in zip(frames, poses, strict=True)]
    ends = np.cumsum([len(part[0]) for part in parts]).tolist()
    rows = tuple(slice(start, end) for start, end in zip([0, *ends[:-1]], ends, strict=True))
    design, by_survey = np.zeros((ends[-1], N_MOUNT * len(frames))), np.zeros((ends[-1], len(survey.at_m), 3))
    own = np.zeros((ends[-1], ends[-1]))
    for number, (frame, pose, place) in enumerate(zip(frames, poses, rows, strict=True)):
        _, J, B, level = parts[number]
        design[place, N_MOUNT * number : N_MOUNT * (number + 1)] = J
        by_survey[place, frame.marks] = B
        R = pose.R_survey_from_frame
        own[place, place] = _through(B, R @ frame.covariance @ R.T) + np.diag(level)
    covariance = _through(by_survey, survey.covariance) + own
    return _System(np.concatenate([part[0] for part in parts]), design, by_survey, covariance, rows)


def _through(by_mark: Array, covariance: Array) -> Array:
    """Return Σ_k B_k C_k B_kᵀ over marks: (n, k, 3) and (k, 3, 3) -> (n, n)."""
    B = np.moveaxis(by_mark, 1, 0)
    return np.asarray(np.tensordot(B @ covariance, B, axes=([0, 2], [0, 2])))


def _rows_of(survey: MarkSurvey, frame: RigidFrame, pose: FramePose) -> tuple[Array, Array, Array, Array]:
    """Return r (n,), J (n, 6), B (n, k, 3) of one frame and its k marks, and the variances (n,) of its INS reading."""
    R, k = pose.R_survey_from_frame, frame.points
    at = survey.at_m[frame.marks]
    turned = frame.drawing_m[:k] @ R.T
    r = (at[:k] - turned - pose.origin_m).ravel()
    J = np.concatenate([skew(turned), np.broadcast_to(-np.eye(3), (k, 3, 3))], axis=2).reshape(-1, N_MOUNT)
    B = np.eye(3 * len(at))[: 3 * k].reshape(-1, len(at), 3)
    if frame.axes is None:
        return r, J, B, np.zeros(len(r))
    axes = frame.axes
    d = at[axes.second] - at[axes.first]
    across = [axis for axis in range(3) if axis != axes.along]
    B_axes = np.zeros((3, len(at), 3))
    B_axes[:2, axes.second] += R.T[across]
    B_axes[:2, axes.first] -= R.T[across]
    angle, by_turn = _level(R, axes.along)
    J_axes = np.zeros((3, N_MOUNT))
    J_axes[:2, :3], J_axes[2, :3] = (R.T @ skew(d))[across], by_turn
    residuals = np.append((R.T @ d)[across], angle - axes.angle_rad)
    variances = np.append(np.zeros(len(r) + 2), axes.sigma_rad**2)
    return np.concatenate([r, residuals]), np.vstack([J, J_axes]), np.concatenate([B, B_axes]), variances


def _level(R: Array, along: int) -> tuple[float, Array]:
    """Return roll (along FORWARD) or pitch of R_survey_from_body, and its derivative (3,) by η in survey axes.

    The third row of Rz(-azimuth) Rx(pitch) Ry(roll) is ρ = (-cos p sin r, sin p, cos p cos r). A turn η changes ρ_k by
    η · (R e_k x e_z).
    """
    rho = R[2]
    by_turn = np.cross(R.T, [0.0, 0.0, 1.0])  # (k, 3)
    level = float(np.hypot(rho[0], rho[2]))
    if along == FORWARD:
        return float(np.arctan2(-rho[0], rho[2])), (rho[0] * by_turn[2] - rho[2] * by_turn[0]) / level**2
    return float(np.arctan2(rho[1], level)), by_turn[1] / level


def _start(survey: MarkSurvey, frame: RigidFrame) -> FramePose:
    """Return the pose from which the iteration starts.

    It is the closed form, weighted by the mean variance of each mark. A frame with axes starts from its axis and the
    vertical, made orthogonal to the axis, turned by the INS's reading.
    """
    at, axes = survey.at_m[frame.marks], frame.axes
    if axes is None:
        variance = np.trace(survey.covariance[frame.marks] + frame.covariance, axis1=1, axis2=2)
        return FramePose(*closed_form(frame.drawing_m, at, 1 / variance))
    axis = (at[axes.second] - at[axes.first]) / np.linalg.norm(at[axes.second] - at[axes.first])
    up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    up /= np.linalg.norm(up)
    if axes.along == FORWARD:
        return FramePose(np.column_stack([np.cross(axis, up), axis, up]) @ rotation_y(axes.angle_rad), at[0])
    return FramePose(np.column_stack([axis, np.cross(up, axis), up]) @ rotation_x(axes.angle_rad), at[0])
