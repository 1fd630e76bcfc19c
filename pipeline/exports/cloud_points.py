"""The labelled points of a run, placed with the calibrated mount, and their distances from the adjusted surfaces.

A point x of a sensor with the mount (R, t) lies at X = p + R_target_from_body (R x + t). The slow error (δ, ω) of the
pose, estimated at knots and linear between them (``maths/adjustment/pose_errors.py``), puts it at X + δ + ω × r, r its
vector from the INS. Its distance is n · X - d - h, with the adjusted plane (n, d) of its family and the height h of its
face above the plane.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.results import DRIFT, SURFACES
from pipeline.artefacts.catalogue.target import FACES, LASER_LABELLED, SOUNDINGS_LABELLED, TARGET_POSE
from pipeline.artefacts.from_tables import normal_of, slow_errors, trajectory_in_target
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import Batch, point_array
from pipeline.config.session import Calibrated
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import Mounted
from pipeline.run.results import Tables

Array = NDArray[np.float64]
STREAMS: dict[Calibrated, Artefact] = {"laser": LASER_LABELLED, "mbes": SOUNDINGS_LABELLED}


@dataclass(frozen=True)
class PlacedPoints:
    """Points (n,) of one sensor: times, passes, faces, coordinates (n, 3) m in the target frame, distances (n,) m."""

    sensor: Calibrated
    t_ns: NDArray[np.int64]
    number_of_pass: NDArray[np.int64]
    face: NDArray[np.int64]
    points_target_m: Array
    residual_m: Array


@dataclass(frozen=True)
class Surfaces:
    """By number of the face: unit normal (f, 3), and distance (f,) m of the face's plane from the target's origin."""

    normals: Array
    distances_m: Array

    @classmethod
    def of(cls, faces: pd.DataFrame, surfaces: pd.DataFrame, as_built: Mapping[str, float]) -> "Surfaces":
        """Return the adjusted plane of each face.

        Parameters
        ----------
        faces, surfaces
            The tables of these names.
        as_built
            By name of the face, its surveyed distance (m) from its place by design, along its own outward normal.
        """
        planes = {str(row["family"]): row for row in surfaces.to_dict("records")}
        rows = faces.sort_values("face").to_dict("records")
        heights = [row["offset_m"] + row["sense"] * as_built.get(str(row["name"]), 0.0) for row in rows]
        distances = [float(planes[str(row["family"])]["distance_m"]) for row in rows]
        normals = [normal_of(planes[str(row["family"])]) for row in rows]
        return cls(np.array(normals), np.array(distances) + np.array(heights))


@dataclass(frozen=True)
class CalibratedPoints:
    """The labelled points of a run, both sensors, one batch after another.

    tables: the run's; mounts: by sensor, those with which points are placed; trajectory: the body in the target frame;
    drift: table of slow errors; surfaces: the adjusted ones; face_names: by number.
    """

    tables: Tables
    mounts: Mapping[Calibrated, Mounted]
    trajectory: Trajectory
    drift: pd.DataFrame
    surfaces: Surfaces
    face_names: tuple[str, ...]

    @classmethod
    def of(
        cls, tables: Tables, mounts: Mapping[Calibrated, Mounted], as_built: Mapping[str, float]
    ) -> "CalibratedPoints":
        """Return the points of a run folder, placed with these mounts.

        Parameters
        ----------
        tables
            The run's tables and streams.
        mounts
            By sensor; a sensor without one is left out.
        as_built
            Settings of the same name: surveyed distances of faces, m.
        """
        faces = tables.table(FACES)
        names = tuple(str(name) for name in faces.sort_values("face")["name"])
        trajectory = trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE))
        surfaces = Surfaces.of(faces, tables.table(SURFACES), as_built)
        return cls(tables, mounts, trajectory, tables.table(DRIFT), surfaces, names)

    def batches(self) -> Iterator[PlacedPoints]:
        """Yield the placed points of all sensors, at most one batch of a stream at a time."""
        for sensor, mount in self.mounts.items():
            names = ("t_ns", "pass", "face", *(f"{axis}_{sensor}_m" for axis in "xyz"))
            for batch in self.tables.stream(STREAMS[sensor], *names).batches():
                if len(batch["t_ns"]):
                    yield self._placed(sensor, mount, batch)

    def _placed(self, sensor: Calibrated, mount: Mounted, batch: Batch) -> PlacedPoints:
        t_ns, face = batch["t_ns"], batch["face"].astype(np.int64)
        body = point_array(batch, f"{sensor}_m") @ mount.R_body_from_sensor.T + mount.lever_arm_body_m
        recorded = self.trajectory.points_from_body(t_ns, body)
        points = recorded + self._slow_error(t_ns, recorded)
        normals, distances = self.surfaces.normals[face], self.surfaces.distances_m[face]
        residual = np.einsum("ni,ni->n", normals, points) - distances
        return PlacedPoints(sensor, t_ns, batch["pass"].astype(np.int64), face, points, residual)

    def _slow_error(self, t_ns: NDArray[np.int64], recorded: Array) -> Array:
        """Return the change (n, 3) m of points by the slow errors of the poses: δ + ω × r."""
        shift, turn = slow_errors(self.drift, t_ns)
        start = self.trajectory.t_ns[0]
        since, records = ((times - start).astype(np.float64) for times in (t_ns, self.trajectory.t_ns))
        ins = np.column_stack([np.interp(since, records, column) for column in self.trajectory.positions_m.T])
        return np.asarray(shift + np.cross(turn, recorded - ins))
