"""From labelled points to observations: poses, each face's surface and design height, sigmas."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline import config
from pipeline.fitted import ALL_PASSES, laser_planes
from pipeline.maths.adjustment import Body, pull_of
from pipeline.maths.epochs import MOVING
from pipeline.maths.knots import Drift
from pipeline.maths.observations import Seen, Sigmas, laser_observations, sensor_part, sonar_observations
from pipeline.maths.robust import igg3_weights
from pipeline.maths.unknowns import SIX, State, Surface
from pipeline.mounts import mount_of
from pipeline.poses import trajectory_in_target
from pipeline.streams import Batch, xyz

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
GROUPS = ("laser", "mbes_vertical", "mbes_horizontal")
FEATURES = {"laser": MOVING + 1, "mbes": MOVING + 3}


@dataclass(frozen=True)
class Weighting:
    """Variance factors f and robust scales by group, and IGG III's bounds (None: nothing is reduced).

    A residual is large or small against all that it is expected to have in it, f σ² and what its epoch shares: on a
    face that the laser grazes σ is 1 mm, and the INS's 2 mm are no outliers. (Held against σ alone they were cut, and
    the sigmas of the result came out 3 % too small.)
    """

    factors: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    scales: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 1.0))
    robust: tuple[float, float] | None = None

    def weights(self, seen: "Observations") -> tuple[Array, Array]:
        """Robust weights w (n,) and full weights w / (σ² f) (n,)."""
        scales = np.array([self.scales[name] for name in GROUPS])[seen.group]
        size = self.normalised(seen) / scales
        robust = np.ones(len(size)) if self.robust is None else igg3_weights(size, *self.robust)
        return robust, robust / (seen.sigma_m**2 * self.factor(seen.group))

    def normalised(self, seen: "Observations") -> Array:
        """v / root(f σ² + what the epoch shares) (n,)."""
        return seen.v_m / np.sqrt(self.factor(seen.group) * seen.sigma_m**2 + seen.common_m**2)

    def factor(self, group: Integers) -> Array:
        """Variance factors (n,) by group."""
        return np.array([self.factors[name] for name in GROUPS])[group]


@dataclass(frozen=True)
class Observations:
    """Of a batch (n,): the record of the INS before each, the share of the step to the next, surface, group of
    observations, v (m) less the mean of its noise, that mean (m), sigma (m), what its epoch shares of the INS's white
    noise (m), features (F, n) and slopes (F - 1, n) of :mod:`pipeline.maths.observations`."""

    record: Integers
    share: Array
    surface: Integers
    group: Integers
    v_m: Array
    mean_m: Array
    sigma_m: Array
    common_m: Array
    features: Array
    slopes: Array

    def epochs(self, surfaces: int) -> Integers:
        """A number for what one sensor sees of one surface between two records, from 0; (n,)."""
        first = int(self.record.min()) if len(self.record) else 0
        return np.asarray((self.record - first) * surfaces + self.surface)

    def adjusted(self, weight: Array, surfaces: int) -> Array:
        """Features at the adjusted points: free of the noise that is in v."""
        own = sensor_part(self.v_m, weight, self.epochs(surfaces), self.common_m)
        features = self.features.copy()
        features[1:] -= self.slopes * own
        return features


@dataclass(frozen=True)
class Scene:
    """What turns a batch into observations; ``coarse``: the state that the adjustment starts from; ``white_m``: the
    white noise of the INS's positions, which all points of an epoch share."""

    body: Body
    surface_of_face: Integers
    height_of_face: Array
    coarse: State
    white_m: float
    laser: config.Laser
    mbes: config.Mbes

    def observe(
        self, sensor: str, batch: Batch, state: State, drift: Drift | None = None, weighting: Weighting | None = None
    ) -> Observations:
        """The observations of a batch of labelled points; of known drift v is free, and of the mean of its noise."""
        record, share = self.body.trajectory.located(batch["t_ns"])
        surface = self.surface_of_face[batch["face"]]
        horizontal = np.array([one.family == "H" for one in state.surfaces])[surface]
        group = np.where(horizontal, 2, 1) if sensor == "mbes" else np.zeros(len(surface), dtype=np.int64)
        see = self._see_laser if sensor == "laser" else self._see_sonar
        v, mean, sigma = np.empty((3, len(surface)))
        features, slopes = np.empty((FEATURES[sensor], len(surface))), np.empty((FEATURES[sensor] - 1, len(surface)))
        pull, turns = self._pull(sensor, state, drift, record)
        for number in range(len(state.surfaces)):
            rows = np.flatnonzero(surface == number)
            if len(rows):
                axes = np.vstack([state.surfaces[number].tangents, state.surfaces[number].normal])
                v[rows], r, found = see(batch, rows, state, number, axes, record[rows], share[rows])
                v[rows] += pull.of(number, record[rows], found.features)
                mean[rows], sigma[rows], features[:, rows], slopes[:, rows] = found
                features[1:MOVING, rows] += np.cross(axes @ turns[:, record[rows] - pull.first], r, axis=0)[:2]
        mean *= (weighting or Weighting()).factor(group)
        common = self.white_m * np.sqrt((1 - share) ** 2 + share**2)
        return Observations(record, share, surface, group, v - mean, mean, sigma, common, features, slopes)

    def _pull(
        self, sensor: str, state: State, drift: Drift | None, record: Integers
    ) -> tuple["_Pull", Array]:
        """What moves v, and how the drift turns the body (3, r), of the records from the batch's first to its last."""
        first, last = (int(record.min()), int(record.max()) + 1) if len(record) else (0, 0)
        records = np.arange(first, last)
        seconds = self.body.seconds[first : last + 1]
        error = np.zeros((len(records), SIX))
        if drift is not None:
            error = drift.at((seconds[:-1] + seconds[1:]) / 2)
        return _Pull(first, pull_of(state, sensor, self.body, records, error, FEATURES[sensor])), error[:, 3:].T

    def _see_laser(
        self, batch: Batch, rows: Integers, state: State, number: int, axes: Array, record: Integers, share: Array
    ) -> tuple[Array, Array, Seen]:
        """v, r in surface axes, and what the observations' module makes of them."""
        surface, trajectory = state.surfaces[number], self.body.trajectory
        own = xyz(batch, "laser_m", rows)
        range_m = np.sqrt(np.einsum("ni,ni->n", own, own))
        first, last = int(record.min()), int(record.max()) + 2
        where = axes @ trajectory.positions_m[first:last].T
        lever = axes @ (trajectory.R_frame_from_body[first:last] @ self.body.laser_lever_arm_m).T
        start = where[:, record - first]
        points = axes @ xyz(batch, "target_m", rows).T
        r = points - start - share * (where[:, record - first + 1] - start)
        lever = lever[:, record - first]
        v = points[2] - surface.distance_m - self.height_of_face[batch["face"][rows]]
        sigmas = Sigmas(self.laser.range_sigma_m, float(np.radians(self.laser.angle_sigma_deg)))
        return v, r, laser_observations(r, lever, range_m, sigmas)

    def _see_sonar(
        self, batch: Batch, rows: Integers, state: State, number: int, axes: Array, _: Integers, __: Array
    ) -> tuple[Array, Array, Seen]:
        surface = state.surfaces[number]
        points = xyz(batch, "mbes_m", rows).T
        moments, back = np.unique(batch["t_ns"][rows], return_inverse=True)  # beams of a ping share their pose
        where, R_target_from_body = self.body.trajectory.poses_at(moments)
        R = R_target_from_body @ state.R_body_from_mbes
        in_mbes = np.einsum("kj,gji->kig", axes, R)[:, :, back]
        up = R[:, 2, :].T[:, back]
        lever = (axes @ (R_target_from_body @ state.lever_arm_m).T)[:, back]
        r = np.einsum("kin,in->kn", in_mbes, points) + lever
        v = r[2] + (where @ surface.normal)[back] - surface.distance_m - self.height_of_face[batch["face"][rows]]
        sigmas = Sigmas(self.mbes.range_sigma_m, float(np.radians(self.mbes.angle_sigma_deg)))
        return v, r, sonar_observations(points, in_mbes, up, r, v, sigmas)

    # --- to be looked at ---------------------------------------------------------------------------------------------
    def sample(self, sensor: str, batch: Batch, state: State, drift: Drift | None, weighting: Weighting) -> Batch:
        """Where points lie and their residuals, calibrated and coarse, as columns of the table ``residuals``."""
        own = xyz(batch, f"{sensor}_m")
        ranges = np.linalg.norm(own, axis=1)
        seen = self.observe(sensor, batch, state, drift, weighting)
        if sensor == "laser":
            points = coarse_points = xyz(batch, "target_m")
            coarse_residual, angle = seen.v_m, np.arcsin(own[:, 2] / ranges)
        else:
            coarse = replace(self.coarse, surfaces=state.surfaces)
            points, coarse_points = self._placed(batch, state), self._placed(batch, coarse)
            before, angle = self.observe(sensor, batch, coarse), np.arctan2(own[:, 0], -own[:, 2])
            coarse_residual = before.v_m + before.mean_m
        columns = {f"{axis}_target_m": points[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"coarse_{axis}_target_m": coarse_points[:, k] for k, axis in enumerate("xyz")}
        columns |= {"range_m": ranges, "angle_deg": np.degrees(angle), "residual_m": seen.v_m + seen.mean_m}
        weight = weighting.weights(seen)[0]
        columns |= {"coarse_residual_m": coarse_residual, "weight": weight}
        single = {name: values.astype(np.float32) for name, values in columns.items()}
        words = np.full(len(seen.v_m), sensor, dtype=object)
        return {"sensor": words} | {name: batch[name] for name in ("t_ns", "pass", "face")} | single

    def _placed(self, batch: Batch, state: State) -> Array:
        """Soundings in the target frame with the state's mount, (n, 3) m."""
        positions, R_target_from_body = self.body.trajectory.poses_at(batch["t_ns"])
        body = xyz(batch, "mbes_m") @ state.R_body_from_mbes.T + state.lever_arm_m
        return np.asarray(positions + np.einsum("nij,nj->ni", R_target_from_body, body))


@dataclass(frozen=True)
class _Pull:
    """By how much v is moved, by feature: table (r, s, F) of the records from ``first`` on and the surfaces."""

    first: int
    table: Array

    def of(self, surface: int, record: Integers, features: Array) -> Array:
        taken = self.table[record - self.first, surface]
        return np.asarray(np.einsum("nf,fn->n", taken, features))


def scene_of(
    faces: pd.DataFrame,
    poses: pd.DataFrame,
    target_pose: pd.DataFrame,
    planes: pd.DataFrame,
    ins: config.Ins,
    laser: config.Laser,
    mbes: config.Mbes,
    as_built: Mapping[str, float],
) -> Scene:
    """Coarse mount, and the laser's planes as surfaces; the horizontal faces level at their design heights; faces
    ``as_built`` off their surface by so much outward (m)."""
    mount, found = mount_of(mbes.mount), laser_planes(planes)
    surfaces = []
    for family in ("P1", "P2", "P3"):
        rows = faces[faces["family"] == family]
        plane = found.get((ALL_PASSES, family))
        if plane is not None:
            surfaces.append(Surface.at(family, plane.normal, plane.centroid_m, 0.0))
        elif len(rows):
            first = rows.iloc[0]
            normal = np.array([first[f"normal_{axis}_target_1"] for axis in "xyz"], dtype=np.float64)
            surfaces.append(Surface.at(family, normal, normal * float(first["distance_m"]), 0.0))
    horizontal = faces[faces["family"] == "H"]
    corners = np.concatenate([np.reshape(corner, (-1, 3)) for corner in horizontal["vertices_target_m"]])
    centre = np.array([corners[:, 0].mean(), 0.0, 0.0])
    surfaces.append(Surface.at("H", np.array([0.0, 0.0, 1.0]), centre, 0.0))
    number = {surface.family: k for k, surface in enumerate(surfaces)}
    outward = np.where(faces["family"] == "H", faces["normal_z_target_1"], 1.0)  # as H's surface looks up
    heights = np.where(faces["family"] == "H", faces["distance_m"] * outward, 0.0)
    heights = heights + outward * np.array([as_built.get(name, 0.0) for name in faces["name"]])
    return Scene(
        Body.of(trajectory_in_target(poses, target_pose), mount_of(laser.mount).lever_arm_body_m),
        np.array([number[family] for family in faces["family"]]),
        heights,
        State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, surfaces),
        ins.white.position_m,
        laser,
        mbes,
    )
