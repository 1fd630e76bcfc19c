"""From labelled points to observations: poses, each face's surface and design height, sigmas."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline import config
from pipeline.fitted import ALL_PASSES, laser_planes
from pipeline.maths.adjustment import Rows, State, Surface, laser_rows, sounding_rows, weights_of
from pipeline.maths.trajectory import Trajectory
from pipeline.mounts import mount_of
from pipeline.poses import trajectory_in_target
from pipeline.streams import Batch, xyz
from pipeline.times import NS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Observed:
    """rows; record, share (n,): where between the INS's records; r (n, 3) from the body to the point; spread (n, 3) =
    Σ n, Σ the point's covariance, m²."""

    rows: Rows
    record: NDArray[np.int64]
    share: Array
    r_m: Array
    spread: Array


@dataclass(frozen=True)
class Scene:
    """What turns a batch into observations; ``coarse``: the state that the adjustment starts from."""

    trajectory: Trajectory
    surface_of_face: NDArray[np.int64]
    height_of_face: Array
    coarse: State
    adjust: config.Adjust
    laser: config.Laser
    mbes: config.Mbes

    def rows(self, sensor: str, batch: Batch, state: State) -> Rows:
        """The observations of a batch of labelled points of either sensor."""
        return self.laser_rows(batch, state)[0] if sensor == "laser" else self.sounding_rows(batch, state)

    def laser_rows(self, batch: Batch, state: State) -> tuple[Rows, Array]:
        """And the points, reduced."""
        face, laser = batch["face"], self.laser
        points = xyz(batch, "target_m")
        points -= self._heights(face, state)
        ranges = np.sqrt(batch["x_laser_m"] ** 2 + batch["y_laser_m"] ** 2 + batch["z_laser_m"] ** 2)
        sigmas = (laser.range_sigma_m, np.radians(laser.angle_sigma_deg))
        return laser_rows(state, self.surface_of_face[face], points, ranges, batch["cos_incidence"], *sigmas), points

    def sounding_rows(self, batch: Batch, state: State) -> Rows:
        face, mbes = batch["face"], self.mbes
        positions, R_target_from_body = self.trajectory.poses_at(batch["t_ns"])
        positions -= self._heights(face, state)
        points = xyz(batch, "mbes_m")
        sigmas = (mbes.range_sigma_m, np.radians(mbes.angle_sigma_deg))
        return sounding_rows(state, self.surface_of_face[face], points, positions, R_target_from_body, *sigmas)

    def _heights(self, face: NDArray[np.int16], state: State) -> Array:
        """What brings the points on all horizontal faces into one plane, (n, 3) m."""
        (normal,) = (surface.normal for surface in state.surfaces if surface.family == "H")
        return self.height_of_face[face][:, None] * normal

    @property
    def seconds(self) -> Array:
        """Times of the INS's records since the first (n,)."""
        return np.asarray((self.trajectory.t_ns - self.trajectory.t_ns[0]) / NS)

    def observed(self, sensor: str, batch: Batch, state: State) -> "Observed":
        """The observations of a batch with where they were seen from."""
        rows = self.rows(sensor, batch, state)
        t_ns, normal = batch["t_ns"], np.array([s.normal for s in state.surfaces])[rows.surface]
        record, share = self.trajectory.located(t_ns)
        own = xyz(batch, f"{sensor}_m")
        ranges = np.linalg.norm(own, axis=1)
        if sensor == "laser":
            lever = mount_of(self.laser.mount).lever_arm_body_m
            position = self.trajectory.carried(t_ns, np.zeros(3))
            r = xyz(batch, "target_m") - position
            ray = (r - (self.trajectory.carried(t_ns, lever) - position)) / ranges[:, None]
            along = np.einsum("ni,ni->n", ray, normal)[:, None]
            across_m = ranges * np.radians(self.laser.angle_sigma_deg)
            spread = self.laser.range_sigma_m**2 * along * ray + across_m[:, None] ** 2 * (normal - along * ray)
        else:
            _, R_target_from_body = self.trajectory.poses_at(t_ns)
            R = R_target_from_body @ state.R_body_from_mbes
            r = np.einsum("nij,nj->ni", R, own) + R_target_from_body @ state.lever_arm_m
            ray = np.einsum("nij,nj->ni", R, own) / ranges[:, None]
            side = np.einsum("nij,nj->ni", R, np.column_stack([-own[:, 2], np.zeros(len(own)), own[:, 0]]))
            along, aside = (np.einsum("ni,ni->n", one, normal)[:, None] for one in (ray, side))
            spread = self.mbes.range_sigma_m**2 * along * ray
            spread = spread + np.radians(self.mbes.angle_sigma_deg) ** 2 * aside * side
        return Observed(rows, record, share, r, spread)

    # --- to be looked at ---------------------------------------------------------------------------------------------
    def sample(self, sensor: str, batch: Batch, state: State, rows: Rows, step: int) -> Batch:
        """One point in ``step``: where it lies and its residual, calibrated and coarse, as columns of ``residuals``."""
        taken = {name: values[::step] for name, values in batch.items()}
        own = xyz(taken, f"{sensor}_m")
        ranges = np.linalg.norm(own, axis=1)
        residual = rows.residual_m[::step]
        if sensor == "laser":
            points = coarse_points = xyz(taken, "target_m")
            coarse_residual, angle = residual, np.arcsin(own[:, 2] / ranges)
        else:
            coarse = replace(self.coarse, surfaces=state.surfaces)
            points, coarse_points = self._placed(taken, state), self._placed(taken, coarse)
            coarse_residual, angle = self.sounding_rows(taken, coarse).residual_m, np.arctan2(own[:, 0], -own[:, 2])
        columns = {f"{axis}_target_m": points[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"coarse_{axis}_target_m": coarse_points[:, k] for k, axis in enumerate("xyz")}
        columns |= {"range_m": ranges, "angle_deg": np.degrees(angle), "residual_m": residual}
        columns |= {"coarse_residual_m": coarse_residual, "weight": weights_of(state, rows)[0][::step]}
        single = {name: values.astype(np.float32) for name, values in columns.items()}
        words = np.full(len(residual), sensor, dtype=object)
        return {"sensor": words} | {name: taken[name] for name in ("t_ns", "pass", "face")} | single

    def _placed(self, batch: Batch, state: State) -> Array:
        """Soundings in the target frame with the state's mount, (n, 3) m."""
        positions, R_target_from_body = self.trajectory.poses_at(batch["t_ns"])
        body = xyz(batch, "mbes_m") @ state.R_body_from_mbes.T + state.lever_arm_m
        return np.asarray(positions + np.einsum("nij,nj->ni", R_target_from_body, body))


def scene_of(
    faces: pd.DataFrame,
    poses: pd.DataFrame,
    target_pose: pd.DataFrame,
    planes: pd.DataFrame,
    adjust: config.Adjust,
    laser: config.Laser,
    mbes: config.Mbes,
) -> Scene:
    """Coarse mount, and the laser's planes as surfaces; the horizontal faces level at their design heights."""
    mount, found = mount_of(mbes.mount), laser_planes(planes)
    surfaces = []
    for family in ("P1", "P2", "P3"):
        rows = faces[faces["family"] == family]
        plane = found.get((ALL_PASSES, family))
        if plane is not None:
            surfaces.append(Surface(family, plane.normal, plane.centroid_m, 0.0))
        elif len(rows):
            first = rows.iloc[0]
            normal = np.array([first[f"normal_{axis}_target_1"] for axis in "xyz"], dtype=np.float64)
            surfaces.append(Surface(family, normal, normal * float(first["distance_m"]), 0.0))
    horizontal = faces[faces["family"] == "H"]
    corners = np.concatenate([np.reshape(corner, (-1, 3)) for corner in horizontal["vertices_target_m"]])
    centre = np.array([corners[:, 0].mean(), 0.0, 0.0])
    surfaces.append(Surface("H", np.array([0.0, 0.0, 1.0]), centre, 0.0))
    number = {surface.family: k for k, surface in enumerate(surfaces)}
    heights = np.where(faces["family"] == "H", faces["distance_m"] * faces["normal_z_target_1"], 0.0)
    return Scene(
        trajectory_in_target(poses, target_pose),
        np.array([number[family] for family in faces["family"]]),
        heights,
        State(mount.R_body_from_sensor, mount.lever_arm_body_m, tuple(surfaces)),
        adjust,
        laser,
        mbes,
    )
