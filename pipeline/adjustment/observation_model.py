"""From labelled points to observations: poses, each face's surface and design height, sigmas."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.weighting import Observations, Weighting
from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import laser_planes, trajectory_in_target
from pipeline.artefacts.streams import Batch, point_array
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.maths.adjustment.interval_sums import MOVING, Runs
from pipeline.maths.adjustment.normal_equations import Body, pull_of
from pipeline.maths.adjustment.observations import Seen, Sigmas, laser_observations, sonar_observations
from pipeline.maths.adjustment.parameters import SIX, State, Surface
from pipeline.maths.adjustment.pose_errors import Drift
from pipeline.maths.sonar.soundings import receive_angle
from pipeline.maths.target.model import Family, TargetModel
from pipeline.mount import mount_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
FEATURES = {"laser": MOVING + 1, "mbes": MOVING + 3}


@dataclass(frozen=True)
class Sight:
    """What a sensor sees of one surface: points (n,) in time's order, each one's share of the step between two records;
    the first record (g,) of each epoch."""

    points: Batch
    share: Array
    record: Integers
    epochs: Runs

    @classmethod
    def of(cls, points: Batch, record: Integers, share: Array) -> "Sight":
        """``record`` (n,) of each point."""
        epochs = Runs.of(record)
        return cls(points, share, record[epochs.starts], epochs)

    def spread(self, values: Array) -> Array:
        """Of epochs (…, g) to points (…, n)."""
        return self.epochs.spread(values)


@dataclass(frozen=True)
class Scene:
    """What turns a batch into observations; ``coarse``: the state that the adjustment starts from; ``white_m``: the
    white noise of the INS's positions, which all points of an epoch share."""

    body: Body
    surface_of_face: Integers
    height_of_face: Array
    coarse: State
    white_m: float
    laser: Laser
    mbes: Mbes | None

    def observe(
        self, sensor: str, batch: Batch, state: State, drift: Drift | None = None, weighting: Weighting | None = None
    ) -> Observations:
        """The observations of a batch of labelled points; of known drift v is free, and of the mean of its noise."""
        points, surface = self._ordered(batch)
        record, share = self.body.trajectory.interval_of(points["t_ns"])
        see = self._see_laser if sensor == "laser" else self._see_sonar
        v, mean, sigma = np.empty((3, len(surface)))
        features, slopes = np.empty((FEATURES[sensor], len(surface))), np.empty((FEATURES[sensor] - 1, len(surface)))
        first, pull, turns = self._pull(sensor, state, drift, record)
        bounds = np.searchsorted(surface, np.arange(len(state.surfaces) + 1)).tolist()
        for number, (start, stop) in enumerate(pairwise(bounds)):
            if start < stop:
                rows, one = slice(start, stop), state.surfaces[number]
                sight = Sight.of({name: values[rows] for name, values in points.items()}, record[rows], share[rows])
                axes = np.vstack([one.tangents, one.normal])
                r, v_m, found = see(sight, state, axes, one.distance_m)
                pulled = sight.spread(pull[sight.record - first, number].T)
                v[rows] = v_m + np.einsum("fn,fn->n", pulled, found.features)
                mean[rows], sigma[rows], features[:, rows], slopes[:, rows] = found
                turned = sight.spread(axes @ turns[:, sight.record - first])
                features[1, rows] += turned[1] * r[2] - turned[2] * r[1]  # turned × r
                features[2, rows] += turned[2] * r[0] - turned[0] * r[2]
        groups = [0 if sensor == "laser" else 2 if one.level else 1 for one in state.surfaces]
        group = np.array(groups)[surface]
        mean *= (weighting or Weighting()).factor(group)
        common = self.white_m * np.sqrt((1 - share) ** 2 + share**2)
        v -= mean
        return Observations(points, record, share, surface, group, v, mean, sigma, common, features, slopes)

    def _ordered(self, batch: Batch) -> tuple[Batch, Integers]:
        """The batch by surface and, on each, by time; the surfaces."""
        t_ns, surface = batch["t_ns"], self.surface_of_face[batch["face"]]
        ascending = bool(np.all(t_ns[1:] >= t_ns[:-1]))
        order = np.argsort(surface.astype(np.int16), kind="stable") if ascending else np.lexsort((t_ns, surface))
        return {name: values[order] for name, values in batch.items()}, surface[order]

    def _pull(
        self, sensor: str, state: State, drift: Drift | None, record: Integers
    ) -> tuple[int, Array, Array]:
        """The batch's first record; of the records from it to the last what moves v, by feature (r, s, F), and how the
        drift turns the body (3, r)."""
        first, last = (int(record.min()), int(record.max()) + 1) if len(record) else (0, 0)
        records = np.arange(first, last)
        seconds = self.body.seconds[first : last + 1]
        error = np.zeros((len(records), SIX))
        if drift is not None:
            error = drift.at((seconds[:-1] + seconds[1:]) / 2)
        return first, pull_of(state, sensor, self.body, records, error, FEATURES[sensor]), error[:, 3:].T

    def _see_laser(self, sight: Sight, state: State, axes: Array, distance_m: float) -> tuple[Array, Array, Seen]:
        """r in surface axes, v, and what the observations' module makes of them."""
        trajectory, record = self.body.trajectory, sight.record
        x, y, z = (sight.points[f"{axis}_laser_m"] for axis in "xyz")
        range_m = np.sqrt(x * x + y * y + z * z)
        start = axes @ trajectory.positions_m[record].T
        step = axes @ trajectory.positions_m[record + 1].T - start
        lever = axes @ (trajectory.R_frame_from_body[record] @ self.body.lever_arm("laser", state)).T
        placed = (
            self._placed(sight.points, state)
            if state.calibrated == "laser"
            else point_array(sight.points, "target_m")
        )
        points = axes @ placed.T
        r = points - sight.spread(start) - sight.share * sight.spread(step)
        v = points[2] - distance_m - self.height_of_face[sight.points["face"]]
        sigmas = Sigmas(self.laser.range_sigma_m, float(np.radians(self.laser.angle_sigma_deg)))
        return r, v, laser_observations(r, sight.spread(lever), range_m, sigmas)

    def _see_sonar(self, sight: Sight, state: State, axes: Array, distance_m: float) -> tuple[Array, Array, Seen]:
        points = point_array(sight.points, "mbes_m").T
        pings = Runs.of(sight.points["t_ns"])  # beams of a ping share their pose
        where, R_target_from_body = self.body.trajectory.poses_at(sight.points["t_ns"][pings.starts])
        R = R_target_from_body @ state.R_body_from_sensor
        in_mbes = pings.spread(np.einsum("kj,gji->kig", axes, R))
        up = pings.spread(R[:, 2, :].T)
        lever = pings.spread(axes @ (R_target_from_body @ state.lever_arm_m).T)
        r = np.einsum("kin,in->kn", in_mbes, points) + lever
        v = r[2] + pings.spread(where @ axes[2]) - distance_m - self.height_of_face[sight.points["face"]]
        if self.mbes is None:
            raise TypeError("soundings without a sonar")
        sigmas = Sigmas(self.mbes.range_sigma_m, float(np.radians(self.mbes.angle_sigma_deg)))
        return r, v, sonar_observations(points, in_mbes, up, r, v, sigmas)

    # --- to be looked at ---------------------------------------------------------------------------------------------
    def sample(self, sensor: str, batch: Batch, state: State, drift: Drift | None, weighting: Weighting) -> Batch:
        """Where points lie and their residuals, calibrated and coarse, as columns of the table ``residuals``."""
        numbered = {**batch, "row": np.arange(len(batch["t_ns"]))}
        seen = self.observe(sensor, numbered, state, drift, weighting)
        points = seen.points
        own = point_array(points, f"{sensor}_m")
        ranges = np.linalg.norm(own, axis=1)
        angle = receive_angle(own) if sensor == "mbes" else np.arcsin(own[:, 2] / ranges)
        if sensor != state.calibrated:
            placed = coarse_placed = point_array(points, "target_m")
            coarse_residual = seen.v_m
        else:
            coarse = replace(self.coarse, surfaces=state.surfaces)
            placed, coarse_placed = self._placed(points, state), self._placed(points, coarse)
            before = self.observe(sensor, points, coarse)
            coarse_residual = before.v_m + before.mean_m
        columns = {f"{axis}_target_m": placed[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"coarse_{axis}_target_m": coarse_placed[:, k] for k, axis in enumerate("xyz")}
        columns |= {"range_m": ranges, "angle_deg": np.degrees(angle), "residual_m": seen.v_m + seen.mean_m}
        weight = weighting.weights(seen)[0]
        columns |= {"coarse_residual_m": coarse_residual, "weight": weight}
        single = {name: values.astype(np.float32) for name, values in columns.items()}
        words = np.full(len(seen.v_m), sensor, dtype=object)
        found = {"sensor": words} | {name: points[name] for name in ("t_ns", "pass", "face")} | single
        as_given = np.argsort(points["row"])
        return {name: values[as_given] for name, values in found.items()}

    def _placed(self, batch: Batch, state: State) -> Array:
        """Points of the sensor that is calibrated in the target frame, with the state's mount, (n, 3) m."""
        positions, R_target_from_body = self.body.trajectory.poses_at(batch["t_ns"])
        body = point_array(batch, f"{state.calibrated}_m") @ state.R_body_from_sensor.T + state.lever_arm_m
        return np.asarray(positions + np.einsum("nij,nj->ni", R_target_from_body, body))


def by_design(family: Family, corners_m: Array) -> Surface:
    """The family's plane where it should be, its centre in the midst of the corners (k, 3) of its faces."""
    centre = corners_m.mean(axis=0)
    return Surface.at(family.name, family.normal, centre - (centre @ family.normal - family.distance_m) * family.normal)


def scene_of(
    model: TargetModel,
    poses: pd.DataFrame,
    target_pose: pd.DataFrame,
    planes: pd.DataFrame,
    ins: Ins,
    laser: Laser,
    mbes: Mbes,
    as_built: Mapping[str, float],
) -> Scene:
    """Coarse mount of the sonar, and the laser's planes as surfaces; faces ``as_built`` off their surface by so much
    outward (m)."""
    mount = mount_of(mbes.mount)
    state = State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, _surfaces(model, planes))
    lever = mount_of(laser.mount).lever_arm_body_m
    body = Body.of(trajectory_in_target(poses, target_pose), lever)
    return Scene(body, *_places(model, state, as_built), state, ins.white.position_m, laser, mbes)


def laser_scene_of(
    model: TargetModel,
    poses: pd.DataFrame,
    target_pose: pd.DataFrame,
    planes: pd.DataFrame,
    ins: Ins,
    laser: Laser,
    as_built: Mapping[str, float],
) -> Scene:
    """The same where the laser is calibrated: its own coarse mount, and no sonar."""
    mount = mount_of(laser.mount)
    state = State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, _surfaces(model, planes), "laser")
    body = Body.of(trajectory_in_target(poses, target_pose), mount.lever_arm_body_m)
    return Scene(body, *_places(model, state, as_built), state, ins.white.position_m, laser, None)


def _surfaces(model: TargetModel, planes: pd.DataFrame) -> list[Surface]:
    """The laser's planes; families that are horizontal, or of several planes, by design."""
    found, surfaces = laser_planes(planes), []
    for family in model.families:
        plane = found.get((ALL_PASSES, family.name)) if family.one_plane and not family.level else None
        corners = np.concatenate([model.faces[number].vertices_m for number in family.faces])
        if plane is not None:
            surfaces.append(Surface.at(family.name, plane.normal, plane.centroid_m, 0.0))
        else:
            surfaces.append(by_design(family, corners))
    return surfaces


def _places(model: TargetModel, state: State, as_built: Mapping[str, float]) -> tuple[Integers, Array]:
    """Of each face the number of its surface, and how far it stands off that."""
    number = {surface.family: k for k, surface in enumerate(state.surfaces)}
    off = [face.offset_m + face.sense * as_built.get(face.name, 0.0) for face in model.faces]
    return np.array([number[face.family] for face in model.faces]), np.array(off)
