"""Small offsets of a clock, from the boat's unrest: with a wrong one the front sways with the boat.

A point of the front lies at n · X(t) = d. With the sensor's clock ahead by τ it is placed too late, off by τ times the
speed v = n · dX/dt at which the body's motion moves it. So of the points within each pass

    n · X = a + b y + c z + Σ m_k ∂(n · X)/∂(mount)_k + τ v

in one least squares, a, b, c for each pass and the six of the mount together: what a coarse mount or a wrong origin
does is taken up by them. What remains is means over moments, for the INS's own noise is common to a moment's points.
How sure τ is follows from their scatter; with 1° of roll in 4 s and 5 m below the INS, v is 0.1 m/s, and 20 ms are
2 mm, where thousands of points tell tenths of that.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline import config
from pipeline.checking.finding import Finding
from pipeline.checking.placed import Sample, put
from pipeline.checking.track import Track
from pipeline.maths.targets import Face, TargetModel
from pipeline.mounts import mount_of
from pipeline.passes import pass_of
from pipeline.times import NS

Array = NDArray[np.float64]
MOMENT_NS = NS // 10  # whose points have one error of the INS
NARROW_S, WIDE_S = 0.02, 0.2
GATE_M, KEPT_SCALES = 0.45, 3.0
SIGMAS, LEAST_S, MOST_S = 8.0, 0.008, 0.8  # eight: what the design lacks, its sigma does not know
STILL = 1e-6  # (m/s)²: slower than 1 mm/s nothing moves
FEWEST = 50  # moments
WATER_M = 0.3  # kept from its surface
ROUNDS = 4


@dataclass(frozen=True)
class Ahead:
    """By how much a sensor's clock is ahead of the INS's, and how sure that is."""

    seconds: float
    sigma_s: float

    @property
    def clear(self) -> bool:
        return LEAST_S < abs(self.seconds) < MOST_S and abs(self.seconds) > SIGMAS * self.sigma_s


def ahead(track: Track, some: Sample, front: Face, heights: tuple[float, float]) -> Ahead | None:
    """None where too little of the front was seen to tell, or where the boat lay still."""
    near = some.near(track)
    if near.georeferenced or not len(near.t_ns):
        return None
    legs = [leg for leg in track.legs if leg.good]
    number = pass_of(near.t_ns, np.array([leg.start_ns for leg in legs]), np.array([leg.end_ns for leg in legs]))
    points = put(track, near)
    rows = np.flatnonzero(_on_front(points, front, heights))
    tau = 0.0
    found = None
    for _ in range(ROUNDS):
        points = put(track, near, ahead_s=tau)[rows]
        speed, steady = (_speed(track, near, rows, front, tau, step) for step in (NARROW_S, WIDE_S))
        use = np.isfinite(speed) & np.isfinite(steady) & np.isfinite(points[:, 0])
        if found is not None:
            use &= np.abs(found[2]) < KEPT_SCALES * max(1.4826 * float(np.median(np.abs(found[2][use]))), 1e-3)
        design = _design(track, near, rows, points, number[rows], front, tau)
        found = _solved(near.t_ns[rows], design, speed, steady, points @ front.normal - front.distance_m, use)
        if found is None:
            return None
        tau += found[0]
        if abs(tau) > MOST_S:
            return None
    return None if found is None else Ahead(tau, found[1])


def _speed(track: Track, near: Sample, rows: NDArray[np.int64], front: Face, tau: float, step_s: float) -> Array:
    """n · dX/dt (n,) m/s of points carried by the body, over a time step on either side."""
    later, sooner = (put(track, near, ahead_s=tau + step)[rows] for step in (-step_s, step_s))
    return np.asarray((later - sooner) @ front.normal / (2 * step_s))


def _on_front(points: Array, front: Face, heights: tuple[float, float]) -> NDArray[np.bool_]:
    off = points @ front.normal - front.distance_m
    shadow = points - off[:, None] * front.normal
    known = np.isfinite(off) & (points[:, 2] > heights[0]) & (points[:, 2] < heights[1])
    return np.asarray(known & (np.abs(off) < GATE_M) & (front.clearance(shadow) > min(0.3, 0.2 * front.width_m)))


def _design(
    track: Track,
    near: Sample,
    rows: NDArray[np.int64],
    points: Array,
    number: NDArray[np.int16],
    front: Face,
    tau: float,
) -> Array:
    """Columns (n, 3 p + 6): each pass's plane, the mount."""
    mounted = mount_of(near.mount)
    t_ns = np.clip(near.t_ns[rows] - round(tau * NS), track.trajectory.t_ns[0], track.trajectory.t_ns[-1])
    _, R = track.trajectory.poses_at(t_ns)
    into = np.einsum("i,nij->nj", front.normal, R)
    body = near.points_m[rows] @ mounted.R_body_from_sensor.T
    mount = np.column_stack([np.cross(body, into), into])
    along = points @ np.array([-front.normal[1], front.normal[0], 0.0])
    plane = np.column_stack([np.ones(len(rows)), along, points[:, 2]])
    passes = [plane * (number == k)[:, None] for k in np.unique(number)]
    return np.hstack([*passes, mount])


def _solved(
    t_ns: NDArray[np.int64], design: Array, speed: Array, steady: Array, off: Array, use: NDArray[np.bool_]
) -> tuple[float, float, Array] | None:
    """τ, its sigma, and residuals (n,) of all rows.

    The INS's noise makes the speed over a short step noisy, which would draw τ towards zero: the speed over a long one,
    whose noise is another, is the instrument (τ = Σ w off / Σ w v, all three freed of the other unknowns). Its sigma
    takes the sum over a moment as one observation.
    """
    moment, index = np.unique(t_ns[use] // MOMENT_NS, return_inverse=True)
    if len(moment) < FEWEST:
        return None
    scale = np.maximum(np.linalg.norm(design[use], axis=0), 1e-12)
    unknowns = design / scale
    values = np.column_stack([speed, steady, off])
    others, *_ = np.linalg.lstsq(unknowns[use], values[use], rcond=1e-9)
    speed, steady, off = (values - unknowns @ others).T
    squares = float(steady[use] @ speed[use])
    if squares <= STILL * len(index):
        return None
    tau = float(steady[use] @ off[use]) / squares
    residual = off - tau * speed
    sums = np.bincount(index, steady[use] * residual[use], len(moment))
    return tau, float(np.sqrt(sums @ sums)) / squares, residual


def latencies(
    track: Track, samples: Sequence[Sample], model: TargetModel, settings: config.Segment
) -> Iterator[Finding]:
    """Sensors whose clock is clearly off; both by the same: the INS's."""
    front = model.front()
    if front is None:
        return
    level = model.water_level_m
    heights = {"laser": (level + settings.water_margin_m, np.inf), "mbes": (-np.inf, level - WATER_M)}
    found = {some.sensor: ahead(track, some, front, heights[some.sensor]) for some in samples}
    clear = {sensor: one for sensor, one in found.items() if one is not None and one.clear}
    if len(clear) > 1 and np.ptp([one.seconds for one in clear.values()]) < 2 * LEAST_S:
        both = float(np.mean([one.seconds for one in clear.values()]))
        yield Finding("latency", f"ins: its clock is {_said(-both)} both sensors': give ins.latency_s = {-both:.3f}")
        return
    for sensor, one in clear.items():
        sigma = f"{1000 * one.sigma_s:.1f} ms"
        yield Finding(
            "latency",
            f"{sensor}: its clock is {_said(one.seconds)} the INS's (sigma {sigma}), as the front sways with the boat: "
            f"add {one.seconds:.3f} to {sensor}.latency_s, and see what delays it",
        )


def _said(ahead_s: float) -> str:
    """
    >>> _said(-0.0204)
    '20 ms behind'
    """
    return f"{abs(1000 * ahead_s):.0f} ms {'ahead of' if ahead_s > 0 else 'behind'}"
