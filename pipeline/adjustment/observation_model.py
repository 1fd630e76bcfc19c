"""The functional model: labelled points become observations of surfaces, linearised at the current values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch, point_array
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.design_matrix import (
    PointDesign,
    SensorSigmas,
    SoundingsOnSurface,
    laser_point_design,
    pose_design,
    sensor_noise,
    sonar_point_design,
)
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.interval_sums import N_MOVED, IntervalSums, LinearisedPoints, Runs, interval_sums
from pipeline.maths.adjustment.normal_equations import RecordErrors, residual_shift
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import LASER_FEATURES, MBES_FEATURES, State, kind_of
from pipeline.maths.adjustment.pose_errors import N_POSE, DriftEstimate
from pipeline.maths.adjustment.weighting import Weighting, common_variance

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# by kind of sensor; the sonar's with the bow
N_FEATURES = {"laser": N_MOVED + len(LASER_FEATURES), "mbes": N_MOVED + len(MBES_FEATURES) + 1}


@dataclass(frozen=True)
class CurrentValues:
    """The values at which the model is linearised: parameters, drift (None: not yet estimated), and weights."""

    state: State
    drift: DriftEstimate | None = None
    weighting: Weighting = field(default_factory=Weighting)


@dataclass(frozen=True)
class SurfaceBatch:
    """A sensor's points (n,) on one surface, in the order of time.

    share (n,): place of each point between two INS records, from 0 to 1; record (g,): the INS record at the start of
    each interval; axes (3, 3): rows t1, t2, n of the surface, target frame.
    """

    points: Batch
    share: Array
    record: Integers
    intervals: Runs
    surface: ObservedSurface
    axes: Array

    @classmethod
    def of(cls, points: Batch, record: Integers, share: Array, surface: ObservedSurface) -> "SurfaceBatch":
        """Return the batch of points with records (n,) and shares (n,) on one surface.

        Parameters
        ----------
        points : Batch
            Columns of n points.
        record, share : (n,) arrays
            INS record before each point, and place of the point between this record and the next, from 0 to 1.
        surface : ObservedSurface
            The surface of the points.
        """
        intervals = Runs.of(record)
        axes = np.vstack([surface.tangents, surface.normal])
        return cls(
            points=points,
            share=share,
            record=record[intervals.starts],
            intervals=intervals,
            surface=surface,
            axes=axes,
        )


@dataclass(frozen=True)
class LinearisedBatch:
    """Points on one surface: vectors r (3, n) from the body, m, surface axes; distances v_m (n,); the design."""

    r: Array
    v_m: Array
    design: PointDesign


@dataclass(frozen=True)
class Observations:
    """Observations of one batch (n,), ordered by surface and time, so that the points of an interval lie together.

    sensor: the one that observed; points: columns of the points; record: INS record before each point; share: place of
    the point between this record and the next, from 0 to 1; surface: number of its surface; v_m: distance from the
    surface less mean_m, the mean of the noise; sigma_m: sigma of the sensor's noise in v; common_m: sigma of the INS's
    white noise, common to the interval; edge_weight: weight by the distance from edges; features (F, n) and slopes
    (F - 1, n): see :mod:`pipeline.maths.adjustment.design_matrix`.
    """

    sensor: str
    points: Batch
    record: Integers
    share: Array
    surface: Integers
    v_m: Array
    mean_m: Array
    sigma_m: Array
    common_m: Array
    edge_weight: Array
    features: Array
    slopes: Array

    def features_at_adjusted(self, weight: Array) -> Array:
        """Return the features (F, n) at the adjusted points. They are uncorrelated with the sensor's noise in v."""
        noise = sensor_noise(self.v_m, weight, Runs.of(self.record, self.surface), self.common_m)
        return np.concatenate([self.features[:1], self.features[1:] - self.slopes * noise])

    def sums(self, weight: Array, by_face: bool = False) -> IntervalSums:
        """Return the sums of each interval and surface; ``weight`` (n,).

        ``by_face``: of each interval and face, with the number of the face in place of that of its surface.
        """
        points = LinearisedPoints(
            record=self.record,
            surface=self.points["face"].astype(np.int64) if by_face else self.surface,
            share=self.share,
            features=self.features_at_adjusted(weight),
            weight=weight,
            v_m=self.v_m,
            count=np.where(weight > 0, self.edge_weight, 0.0),
        )
        return interval_sums(points)


@dataclass(frozen=True)
class ObservationModel:
    """Model that turns a batch of labelled points into observations.

    body: motion of the body, target frame; faces: the surface of each face; height_of_face (f,) m: distance of each
    face from its surface, along the normal; coarse: the state from which the adjustment starts; sigmas: standard
    deviations of each sensor that observes; wet_heights_m: z of the faces' lower end and of the water's surface, target
    frame.
    """

    body: BodyMotion
    faces: Faces
    height_of_face: Array
    coarse: State
    sigmas: Mapping[str, SensorSigmas]
    wet_heights_m: tuple[float, float]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters, and of the shifts of single faces."""
        return (*self.coarse.names, *self.faces.parameters)

    def linearise(self, sensor: str, batch: Batch, values: CurrentValues) -> Observations:
        """Return the observations of a batch. Their v is without the drift and without the mean of the noise.

        Parameters
        ----------
        sensor : str
            The sensor that observed the points: the laser, or a head of the sonar.
        batch : Batch
            Columns of labelled points.
        values : CurrentValues
            Parameters, drift and weights at which to linearise.
        """
        state = values.state
        points, surface = self._ordered(batch)
        record, share = self.body.trajectory.interval_of(points["t_ns"])
        n, n_features = len(surface), N_FEATURES[kind_of(sensor)]
        v, mean, sigma, common = np.empty((4, n))  # common: a variance
        features, slopes = np.empty((n_features, n)), np.empty((n_features - 1, n))
        by_pose = pose_design(state.surfaces, np.arange(len(state.surfaces)))
        errors = self.pose_errors(values.drift, np.unique(record))
        turns = errors.error[:, 3:].T
        shifts = residual_shift(state, sensor, self.body, errors, n_features)  # (r, s, F)
        linearised = self._linearised_laser if sensor == "laser" else partial(self._linearised_sonar, sensor=sensor)
        bounds = np.searchsorted(surface, np.arange(len(state.surfaces) + 1)).tolist()
        for number, (start, stop) in enumerate(pairwise(bounds)):
            if start == stop:
                continue
            rows = slice(start, stop)
            columns = {name: column[rows] for name, column in points.items()}
            on_surface = SurfaceBatch.of(columns, record[rows], share[rows], state.surfaces[number])
            on_plane = linearised(on_surface, state)
            r, design, place = on_plane.r, on_plane.design, np.searchsorted(errors.record, on_surface.record)
            shift = on_surface.intervals.spread(shifts[place, number].T)
            v[rows] = on_plane.v_m + np.einsum("fn,fn->n", shift, design.features)
            mean[rows], sigma[rows], features[:, rows], slopes[:, rows] = design
            turn = on_surface.intervals.spread(on_surface.axes @ turns[:, place])
            features[1, rows] += turn[1] * r[2] - turn[2] * r[1]  # turn × r
            features[2, rows] += turn[2] * r[0] - turn[0] * r[2]
            derivatives = by_pose[number].T @ features[:N_MOVED, rows]
            common[rows] = common_variance(derivatives, share[rows], values.weighting.white)
        mean *= values.weighting.factors_of(sensor, surface)
        return Observations(
            sensor=sensor,
            points=points,
            record=record,
            share=share,
            surface=surface,
            v_m=v - mean,
            mean_m=mean,
            sigma_m=sigma,
            common_m=np.sqrt(common),
            edge_weight=np.asarray(points["edge_weight"], dtype=np.float64),
            features=features,
            slopes=slopes,
        )

    def points_in_target(self, sensor: str, batch: Batch, state: State) -> Array:
        """Return a calibrated sensor's points (n, 3) m in the target frame, with the mount of the state."""
        points_m = point_array(batch, f"{kind_of(sensor)}_m")
        return self.body.trajectory.points_from_sensor(batch["t_ns"], points_m, *state.mount_of(sensor))

    def _ordered(self, batch: Batch) -> tuple[Batch, Integers]:
        """Return the batch ordered by surface, and on each surface by time, with the numbers (n,) of the surfaces."""
        t_ns, surface = batch["t_ns"], self.faces.surface[batch["face"]]
        ascending = bool(np.all(t_ns[1:] >= t_ns[:-1]))
        order = np.argsort(surface.astype(np.int16), kind="stable") if ascending else np.lexsort((t_ns, surface))
        return {name: column[order] for name, column in batch.items()}, surface[order]

    def pose_errors(self, drift: DriftEstimate | None, record: Integers) -> RecordErrors:
        """Return the drift in the middle of the intervals after records (r,), ascending; zero if it is None."""
        seconds, error = self.body.seconds, np.zeros((len(record), N_POSE))
        if drift is not None:
            error = drift.at((seconds[record] + seconds[record + 1]) / 2)
        return RecordErrors(record, error)

    def _linearised_laser(self, batch: SurfaceBatch, state: State) -> LinearisedBatch:
        trajectory, record, axes = self.body.trajectory, batch.record, batch.axes
        x, y, z = (batch.points[f"{axis}_laser_m"] for axis in "xyz")
        range_m = np.sqrt(x * x + y * y + z * z)
        start = axes @ trajectory.positions_m[record].T
        step = axes @ trajectory.positions_m[record + 1].T - start
        lever_arm = axes @ (trajectory.R_frame_from_body[record] @ self.body.lever_arm("laser", state)).T
        is_calibrated = state.calibrated == "laser"
        own = batch.points
        points = self.points_in_target("laser", own, state) if is_calibrated else point_array(own, "target_m")
        along_axes = axes @ points.T
        r = along_axes - batch.intervals.spread(start) - batch.share * batch.intervals.spread(step)
        v = along_axes[2] - batch.surface.distance_m - self.height_of_face[batch.points["face"]]
        return LinearisedBatch(
            r, v, laser_point_design(r, batch.intervals.spread(lever_arm), range_m, self.sigmas["laser"])
        )

    def _linearised_sonar(self, batch: SurfaceBatch, state: State, sensor: str) -> LinearisedBatch:
        R_body_from_mbes, lever_arm_m = state.mount_of(sensor)
        points_m, axes = point_array(batch.points, "mbes_m").T, batch.axes
        pings = Runs.of(batch.points["t_ns"])  # beams of a ping share their pose
        positions, R_target_from_body = self.body.trajectory.poses_at(batch.points["t_ns"][pings.starts])
        R = R_target_from_body @ R_body_from_mbes
        axes_mbes = pings.spread(np.einsum("kj,gji->kig", axes, R))
        up = pings.spread(R[:, 2, :].T)
        lever_arm = pings.spread(axes @ (R_target_from_body @ lever_arm_m).T)
        r = np.einsum("kin,in->kn", axes_mbes, points_m) + lever_arm
        v = r[2] + pings.spread(positions @ axes[2]) - batch.surface.distance_m
        v = v - self.height_of_face[batch.points["face"]]
        lowest_m, water_m = self.wet_heights_m
        soundings = SoundingsOnSurface(
            points_m=points_m,
            axes=axes_mbes,
            up=up,
            r=r,
            v_m=v,
            height=(axes[:, 2] @ r + pings.spread(positions[:, 2]) - lowest_m) / (water_m - lowest_m),
            depth_m=water_m - lowest_m,
        )
        return LinearisedBatch(r, v, sonar_point_design(soundings, self.sigmas[sensor]))
