"""Real rows of a boat's laser and INS, as LibAC of CIDCO wrote them, in the frames of CONVENTIONS.md.

A row has 22 numbers (LidarToolkit, ``scripts/SphereCalibrationOctave/calibration``: ``readLibacBinaryData.m`` and
``georef.m``, which names what it uses): the point as LibAC placed it, the time, the point in the scanner's frame, its
three sigmas, roll, pitch and heading, their uncertainties (of a unit that nothing says), the INS's position, its three
sigmas. There

    level: north, west, up      body: forward, port, up      C = Rz(-heading) Ry(pitch) Rx(roll), pitch + is bow down
    x_level = p + C (B x_scanner + a)

With P = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], which turns north, west, up into east, north, up, and forward, port, up
into starboard, forward, up, P C Pᵀ is our R_level_from_body of (roll, -pitch, heading), and P B Pᵀ our
R_body_from_laser if the scanner's own axes are turned like the body's. B is written by three angles as C is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.config.mount import Mount
from pipeline.config.stage_settings import LaserPlacement
from pipeline.georeference.placement import laser_in_pool
from pipeline.georeference.pool_context import PoolContext
from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.maths.geometry.rotations import rotation_from_attitude
from pipeline.maths.geometry.trajectory import NS_PER_S, Trajectory
from pipeline.maths.survey.frame_adjustment import closed_form
from pipeline.mount import Mounted

Array = NDArray[np.float64]
R_OURS_FROM_NWU = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
COLUMNS = 22
TARGETS, PASSES = ("target1", "sphere1", "sphere2"), (1, 2)
LINE_GAP_S = 0.005  # a longer time without a point: the scanner's mirror goes round
NEAR_M = np.array([1077.6, 1606.1, 6.0])  # east, north, up: near the targets, so that sums of squares keep their digits


@dataclass(frozen=True)
class Rows:
    """Rows in the order of time, n of them, in the frames of CONVENTIONS.md; levels are from ``NEAR_M``.

    placed_m (n, 3): the points as the rows have them, level; t_ns (n,): time of day; laser_m (n, 3): points in the
    scanner's frame; laser_sigma_m (n, 3); attitude_rad (n, 3): roll, pitch, heading; position_m, position_sigma_m
    (n, 3): the INS, level.
    """

    placed_m: Array
    t_ns: NDArray[np.int64]
    laser_m: Array
    laser_sigma_m: Array
    attitude_rad: Array
    position_m: Array
    position_sigma_m: Array

    @classmethod
    def of(cls, table: Array) -> "Rows":
        """Return the rows of a table (n, 22) as in the file."""
        table = table[np.argsort(table[:, 3], kind="stable")]
        turned = {first: table[:, first : first + 3] @ R_OURS_FROM_NWU.T for first in (0, 4, 16)}
        sigmas = {first: table[:, first : first + 3] @ np.abs(R_OURS_FROM_NWU).T for first in (7, 19)}
        return cls(
            placed_m=turned[0] - NEAR_M,
            t_ns=np.rint(table[:, 3] * NS_PER_S).astype(np.int64),
            laser_m=turned[4],
            laser_sigma_m=sigmas[7],
            attitude_rad=table[:, 10:13] * [1.0, -1.0, 1.0],
            position_m=turned[16] - NEAR_M,
            position_sigma_m=sigmas[19],
        )

    def __len__(self) -> int:
        return len(self.t_ns)

    @cached_property
    def R_level_from_body(self) -> Array:
        """Return the attitude (n, 3, 3) of each row."""
        return rotation_from_attitude(*self.attitude_rad.T)

    @property
    def range_m(self) -> float:
        """Return the mean range."""
        return float(np.linalg.norm(self.laser_m, axis=1).mean())

    @property
    def seconds(self) -> float:
        """Return the time from the first to the last row."""
        return float(np.ptp(self.t_ns) / NS_PER_S)

    @cached_property
    def line_starts(self) -> NDArray[np.int64]:
        """Return the number of the first row of each line of the scanner."""
        return np.concatenate([[0], np.flatnonzero(np.diff(self.t_ns) > LINE_GAP_S * NS_PER_S) + 1])

    @property
    def track(self) -> Array:
        """Return the axes (3, 3) of the mean heading, as rows: along the track, across it to starboard, up."""
        x, y = self.R_level_from_body[:, :2, 1].mean(axis=0)
        along = np.array([x, y, 0.0]) / np.hypot(x, y)
        return np.array([along, [along[1], -along[0], 0.0], [0.0, 0.0, 1.0]])

    @property
    def velocity_m_s(self) -> Array:
        """Return the mean velocity (3,) of the INS over the rows, level frame."""
        return np.asarray((self.position_m[-1] - self.position_m[0]) / self.seconds)

    def trajectory(self, records: NDArray[np.int64] | None = None) -> Trajectory:
        """Return the trajectory through the poses of these rows; by default of all with times of their own."""
        chosen = np.unique(self.t_ns, return_index=True)[1] if records is None else records
        return Trajectory.build(self.t_ns[chosen], self.position_m[chosen], self.R_level_from_body[chosen])

    def in_level(self, mount: Mounted, trajectory: Trajectory | None = None) -> Array:
        """Return the points (n, 3) placed by the program with a mount, as stage georeference places them."""
        known = self.trajectory() if trajectory is None else trajectory
        context = PoolContext(PoolFrame.at(0.0, 0.0, 0.0, 0.0), known, *np.empty((2, 0), np.int64), *np.empty((2, 3)))
        settings = LaserPlacement(mount=Mount(**mount.settings()), frame="laser")
        return laser_in_pool(self.t_ns, self.laser_m, context, settings)[1]


def file_of(folder: Path, number: int, target: str) -> Path:
    """Return the file of a target in a pass; ``folder`` is that of all real data."""
    return folder / "georeferencing" / f"q_25_passage_{number}_{target}.bin"


def read_rows(folder: Path) -> dict[tuple[str, int], Rows]:
    """Return the rows of each target and pass."""
    files = {(target, number): file_of(folder, number, target) for target in TARGETS for number in PASSES}
    return {key: Rows.of(np.fromfile(path, "<f8").reshape(-1, COLUMNS)) for key, path in files.items()}


def mount_of_rows(all_rows: Sequence[Rows]) -> Mounted:
    """Return the mount with which LibAC placed the rows: that which turns the scanner's points into the body's."""
    body = [
        np.einsum("nji,nj->ni", rows.R_level_from_body, rows.placed_m - rows.position_m) for rows in all_rows
    ]
    laser = np.concatenate([rows.laser_m for rows in all_rows])
    return Mounted(*closed_form(laser, np.concatenate(body), np.ones(len(laser))))


def mount_of_libac(boresight_deg: Sequence[float], lever_m: Sequence[float]) -> Mounted:
    """Return our mount of LibAC's boresight (roll, pitch, heading) and lever arm (forward, port, up)."""
    roll, pitch, heading = np.radians(np.array(boresight_deg)[:, None])
    (R_body_from_laser,) = rotation_from_attitude(roll, -pitch, heading)
    return Mounted(R_body_from_laser, R_OURS_FROM_NWU @ np.array(lever_m))
