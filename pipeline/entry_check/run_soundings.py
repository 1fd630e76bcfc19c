"""The run's side: soundings in the sonar's frame with the poses of their times, and the mounts that may be entered."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import POOL_FRAME, POSES, SOUNDINGS_POOL
from pipeline.artefacts.from_tables import trajectory_in_pool
from pipeline.artefacts.streams import point_array
from pipeline.errors import ArtefactError
from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.mount import Mounted, mount_of
from pipeline.results.finished_run import FinishedRun
from pipeline.run.results import Tables

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_SOUNDINGS = 30_000  # more do not make the answer better, only later;
LEAST_SHARE = 0.01  # but so many of all: less would hardly meet the file's, which are thinned as well
NS_PER_S = 1e9


@dataclass(frozen=True)
class RunSoundings:
    """Soundings of a run, ping by ping.

    Attributes
    ----------
    t_ns, ping, beam
        (n,): time; a number of the ping that is unique in the run, ascending; number of the beam.
    points_mbes_m
        (n, 3) in frame mbes.
    positions_m, R_pool_from_body
        (n, 3) and (n, 3, 3): pose of the INS at each sounding, pool frame.
    trajectory
        The INS's trajectory in the pool frame.
    """

    t_ns: Integers
    ping: Integers
    beam: Integers
    points_mbes_m: Array
    positions_m: Array
    R_pool_from_body: Array
    trajectory: Trajectory

    @classmethod
    def of(cls, trajectory: Trajectory, t_ns: Integers, beam: Integers, points_mbes_m: Array) -> "RunSoundings":
        """Return soundings in the order of their times and beams, with the poses of their times."""
        order = np.lexsort((beam, t_ns))
        t_ns, beam, points = t_ns[order], beam[order].astype(np.int64), points_mbes_m[order]
        ping = np.cumsum(np.diff(t_ns, prepend=t_ns[:1]) > 0, dtype=np.int64)
        return cls(t_ns, ping, beam, points, *trajectory.poses_at(t_ns), trajectory)

    def later(self, delay_s: float) -> "RunSoundings":
        """Return the same soundings with the poses of times that are later by ``delay_s``."""
        t_ns = np.clip(self.t_ns + round(delay_s * NS_PER_S), self.trajectory.t_ns[0], self.trajectory.t_ns[-1])
        return RunSoundings(
            self.t_ns, self.ping, self.beam, self.points_mbes_m, *self.trajectory.poses_at(t_ns), self.trajectory
        )

    def rows(self, rows: NDArray[Any]) -> "RunSoundings":
        """Return some of the soundings."""
        poses = self.positions_m[rows], self.R_pool_from_body[rows]
        points = self.points_mbes_m[rows]
        return RunSoundings(self.t_ns[rows], self.ping[rows], self.beam[rows], points, *poses, self.trajectory)

    def placed(self, R_body_from_mbes: Array, lever_arm_m: Array) -> Array:
        """Return the soundings (n, 3) m in the pool frame, placed with a mount."""
        body = self.points_mbes_m @ R_body_from_mbes.T + lever_arm_m
        return np.asarray(self.positions_m + np.einsum("nij,nj->ni", self.R_pool_from_body, body))

    def in_body(self, points_pool_m: Array) -> Array:
        """Return points (n, 3) m of the pool frame, one of each sounding, in the body frame of the sounding's pose."""
        return np.asarray(np.einsum("nji,nj->ni", self.R_pool_from_body, points_pool_m - self.positions_m))

    @property
    def reach_m(self) -> float:
        """The largest distance of a sounding from the sonar."""
        return float(np.linalg.norm(self.points_mbes_m, axis=1).max())


@dataclass(frozen=True)
class EntrySource:
    """What a surveyor may have entered, rightly or wrongly: from the run's result and settings."""

    total: Mounted
    coarse: Mounted
    laser: Mounted
    mbes_latency_s: float
    ins_latency_s: float
    convergence_rad: float = 0.0  # grid north less true north, clockwise, in the CRS of the software
    azimuth_rad: float = 0.0  # of the pool's y axis, clockwise from true north


@dataclass(frozen=True)
class RunSide:
    """All that a check needs of a run."""

    session: str
    soundings: RunSoundings
    frame: PoolFrame
    source: EntrySource
    latitude_deg: float
    longitude_deg: float


def run_side(run: FinishedRun) -> RunSide:
    """Return what a check needs of a run; raise ArtefactError if it was rejected."""
    result = run.result
    if result["verdict"] != "accepted":
        raise ArtefactError(f"{run.path}: was rejected: its values must not be entered anywhere; calibrate again")
    tables, session = Tables(run.path), run.settings.session
    names = ("t_ns", "beam", *(f"{axis}_mbes_m" for axis in "xyz"))
    columns = _whole_pings(tables, names)
    origin = tables.table(POOL_FRAME).iloc[0]
    latitude, longitude = float(origin["latitude_deg"]), float(origin["longitude_deg"])
    mount = result["mbes"]
    return RunSide(
        session=str(result["session"]),
        soundings=RunSoundings.of(
            trajectory_in_pool(tables.table(POSES)), columns["t_ns"], columns["beam"], point_array(columns, "mbes_m")
        ),
        frame=PoolFrame.at(
            float(np.radians(latitude)), float(np.radians(longitude)), float(origin["height_m"]),
            float(np.radians(origin["azimuth_deg"])),
        ),
        source=EntrySource(
            total=Mounted(np.array(mount["R_body_from_mbes"]), np.array(mount["lever_arm_m"])),
            coarse=mount_of(session.sonar.mount),
            laser=mount_of(session.laser.mount),
            mbes_latency_s=session.sonar.latency_s,
            ins_latency_s=session.ins.latency_s,
            azimuth_rad=float(np.radians(origin["azimuth_deg"])),
        ),
        latitude_deg=latitude,
        longitude_deg=longitude,
    )  # fmt: skip


def _whole_pings(tables: Tables, names: tuple[str, ...]) -> Mapping[str, Any]:
    """Return columns of some soundings, all of every n-th ping: their beams are neighbours."""
    count, times = 0, []
    for batch in tables.stream(SOUNDINGS_POOL, "t_ns").batches():
        count += len(batch["t_ns"])
        times.append(np.unique(batch["t_ns"]))
    if not count:
        raise ArtefactError(f"{tables.run}: holds no soundings near the target; run poolcal run again")
    every = max(1, min(-(-count // MOST_SOUNDINGS), round(1 / LEAST_SHARE)))
    wanted = np.unique(np.concatenate(times))[::every]
    kept = []
    for batch in tables.stream(SOUNDINGS_POOL, *names).batches():
        rows = np.isin(batch["t_ns"], wanted)
        kept.append({name: batch[name][rows] for name in names})
    return {name: np.concatenate([batch[name] for batch in kept]) for name in names}
