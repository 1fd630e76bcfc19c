"""The motion of the body in the target frame: its poses corrected by the drift, its rates, its unrest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pose_errors import (
    LARGEST_SPACING_S,
    DriftEstimate,
    PoseNoise,
    knot_spacing,
    place_knots,
)
from pipeline.maths.geometry.trajectory import NS_PER_S, Trajectory
from pipeline.maths.kernels.poses import Drift

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
REACH_S = 0.2  # rates are means over this time on either side: between two records noise of 2 mm gives 0.5 m/s
LEAST_TILT_RAD = 1e-6  # RMS of the tilt below which a boat lies still: no INS resolves less


@dataclass(frozen=True)
class BodyPoses:
    """The body at g instants, target frame.

    positions_m (g, 3); R_target_from_body (g, 3, 3); rates (g, 6): velocity (m/s) and angular velocity (rad/s).
    """

    positions_m: Array
    R_target_from_body: Array
    rates: Array


@dataclass(frozen=True)
class BodyMotion:
    """The motion of the body in the target frame.

    trajectory of n records; seconds (n,): their times since the first; rates (n, 6): velocity (m/s) and angular
    velocity (rad/s) there; laser_lever_arm_m (3,), body axes.
    """

    trajectory: Trajectory
    seconds: Array
    rates: Array
    laser_lever_arm_m: Array

    @classmethod
    def of(cls, trajectory: Trajectory, laser_lever_arm_m: Array) -> "BodyMotion":
        """Return the motion along a trajectory in the target frame."""
        seconds = (trajectory.t_ns - trajectory.t_ns[0]) / NS_PER_S
        return cls(trajectory, seconds, trajectory.rates(REACH_S), laser_lever_arm_m)

    @property
    def motion_hz(self) -> float:
        """Return the mean frequency of roll and pitch: RMS of their rates over RMS of the tilt, divided by 2π.

        The body's z axis, (0, 0, 1) for an even keel, tilts by its horizontal components (rad), at the rate of the
        horizontal angular velocity. For a sinusoid this is its frequency. A boat that lies still has 0.
        """
        tilt = self.trajectory.R_frame_from_body[:, :2, 2]
        size = float(np.sqrt(np.mean((tilt - tilt.mean(axis=0)) ** 2)))
        rate = float(np.sqrt(np.mean(self.rates[:, 3:5] ** 2)))
        return rate / (2 * np.pi * size) if size > LEAST_TILT_RAD else 0.0

    def zero_drift(self, record: Integers, noise: PoseNoise, gap_s: float) -> DriftEstimate:
        """Return a drift of zero at knots for these records.

        Parameters
        ----------
        record : (m,) array
            Last INS record before each observation, ascending, each once.
        noise : PoseNoise
            The pose errors; without drift the knots are as far apart as possible.
        gap_s : float
            A longer time (s) without observations interrupts the knots.
        """
        spacing_s = knot_spacing(self.motion_hz) if noise.drifts else LARGEST_SPACING_S
        return DriftEstimate.zero(place_knots(record, self.seconds, spacing_s, gap_s))

    def times(self, record: Integers, share: Array) -> Array:
        """Return the times (g,) s at these shares of the interval from each record to the next."""
        seconds = self.seconds
        return np.asarray(seconds[record] + share * (seconds[record + 1] - seconds[record]))

    def poses(self, record: Integers, share: Array, drift: DriftEstimate | None) -> BodyPoses:
        """Return the poses at these shares of the intervals, corrected by the drift: the best known for the design.

        Parameters
        ----------
        record, share : (g,) arrays
            Record before each instant, and the share of the interval to the next.
        drift : DriftEstimate or None
            The drift estimated so far.
        """
        if drift is None:
            poses = self.trajectory.poses_within(record, share)
        else:
            poses = self.trajectory.poses_with_drift(record, share, Drift(drift.knots.seconds, drift.values))
        return BodyPoses(*poses, self.rates[record])

    def lever_arm(self, sensor: str, state: State) -> Array:
        """Return the sensor's lever arm (3,) m, body axes: the estimate if it is calibrated, else as configured."""
        return state.mount_of(sensor)[1] if sensor in state.heads else self.laser_lever_arm_m
