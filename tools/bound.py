"""The Cramér-Rao bound of simulated sessions: no unbiased estimator's covariance can be smaller.

Written apart from the adjustment, and importing nothing of it: true poses, true noise, true rays; derivatives are
differences of a forward model of its own, and the INS's errors are unknowns with a prior in one sparse matrix, record
by record. A ray whose whole footprint lies on a plane n · X = d says

    n · X(range, angles; six, pose) - d - (two turns and a shift of the plane's family) = 0

with the noise of its range and angles: one equation of variance Σ (n · dX/ds)² σ_s². Of the unknowns x (the six, the
families' turns and shifts) and e (the INS's errors: white at records, Gauss-Markov at knots, straight between them) the
information matrix is

    [ Jxᵀ W Jx    Jxᵀ W Je     ]
    [ Jeᵀ W Jx    Jeᵀ W Je + P ]        W: 1 / variance, P: inverse of the covariance of e,

and the bound the first 6 x 6 of its inverse.

Of a laser that is calibrated itself (:func:`laser_bound`) the six are its own, there is no sonar, and x has in place of
the families' turns and shifts one displacement of the whole target, plumb within a sigma.

    python -m tools.bound [SCENARIO.yaml] [--seeds 4]
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csc_matrix, csr_matrix, diags, hstack, identity, kron
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from pipeline.config.pool import Segment
from pipeline.gps_time import NS
from pipeline.simulation.beams import directions_in_mbes, fan_angles, swing_rad, transmit_tilts_rad
from pipeline.simulation.ins import pose_sigmas
from pipeline.simulation.laser import scan_directions
from pipeline.simulation.mbes import CLOCK_RATE_ERROR, UPWARD_RAD
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.motion import Movement, R_level_from_body
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.random_streams import generator
from pipeline.simulation.raycast import RayCaster
from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.site import Site

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SETTINGS = Segment()
KNOT_S = 0.25
STEP = np.array([1e-5] * 3 + [1e-4] * 3)  # of differences, rad and m
NORMALS = np.array([[-1, 0, 0], [-0.5**0.5, -(0.5**0.5), 0], [-0.5**0.5, 0.5**0.5, 0], [0, 0, 1]])  # of the families
SMALL_TILT = np.cos(np.radians(5.0))


@dataclass(frozen=True)
class Rays:
    """Rays of one sensor in one pass that lie on the target (n,): time, plane, points in the sensor's frame, by how
    much a sigma of each of its measurements moves them (n, 3, s), and the share of such rays that nothing spoils."""

    sensor: str
    pass_number: int
    t_ns: NDArray[np.int64]
    plane: NDArray[np.int64]
    points_m: Array
    noise_m: Array
    clean: Array


def _ray(angle_rad: Array, tilt_rad: Array) -> Array:
    """(n, 3) in the sonar's frame: of a receive beam and a transmit fan."""
    return directions_in_mbes(swing_rad(np.sin(angle_rad), tilt_rad)[0], tilt_rad)


class World:
    """The simulated session's truth."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.scenario, self.movement, self.seed = scenario, Movement(scenario, seed), seed
        self.site = Site(scenario.target.origin, scenario.azimuth_deg)
        mesh = build_mesh(scenario.target, scenario.surroundings)
        self.caster = RayCaster(mesh)
        self.normals = np.zeros((mesh.surfaces.max() + 1, 3))
        self.normals[mesh.surfaces] = mesh.normals
        alike = np.abs(self.normals @ NORMALS.T)
        self.family = np.where(alike.max(axis=1) > SMALL_TILT, alike.argmax(axis=1), -1)
        for surface, name in zip(mesh.surfaces, mesh.names, strict=True):
            if name in ("floor", "back_wall"):
                self.family[surface] = -1

    def hits(self, sensor: str, k: int, t_ns: Integers, rays: Array) -> tuple[Array, Integers, Array]:
        """Of bundles of rays (n, m, 3), the axis and, of a beam of some width, one on its rim across and one along:
        range and plane of the point hit, how steeply the axis rises (n,). Plane -1: not on the target as the segment
        stage's settings want it: the whole footprint on one face and a margin more, not grazed, away from the water
        line. (What a beam may stray is not kept from the edges: a few more rays than the labels take.)"""
        pose, mount = self.movement.pose(k, t_ns), getattr(self.scenario, sensor).mount
        start = pose.position_target_m + pose.R_target_from_body @ lever_arm_m(mount)
        R = pose.R_target_from_body @ R_body_from_sensor(mount).as_matrix()
        directions = np.einsum("nij,nmj->nmi", R, rays)
        axis = directions[:, 0]
        ranges, plane = self.caster.cast(start, axis)
        normal = self.normals[plane]
        slant = np.einsum("ni,ni->n", normal, axis)
        reached = np.where(np.isfinite(ranges), ranges, 0.0)
        hit = start + reached[:, None] * axis
        good = (plane >= 0) & (self.family[plane] >= 0) & (-slant > np.sin(np.radians(SETTINGS.min_grazing_deg)))
        above = (hit[:, 2] - self.scenario.target.water_level_m) * (1 if sensor == "laser" else -1)
        rows = np.flatnonzero(good & (above > SETTINGS.water_margin_m))
        away = (reached * slant)[rows, None]
        reach = away / np.einsum("ni,nmi->nm", normal[rows], directions[rows, 1:])
        widths = start[rows, None] + reach[..., None] * directions[rows, 1:] - hit[rows, None]  # half axes on the plane
        level = np.cross(normal[rows], np.where(np.abs(normal[rows, 2:]) > 0.5, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
        level /= np.linalg.norm(level, axis=1)[:, None]
        inside = np.ones(len(rows), dtype=bool)
        for turn in np.arange(8) * np.pi / 4:  # every edge of the target has one of these directions across it
            outward = np.cos(turn) * level + np.sin(turn) * np.cross(normal[rows], level)
            rim = np.einsum("nm,nmi->ni", np.sign(np.einsum("nmi,ni->nm", widths, outward)), widths)
            toward = hit[rows] + rim + SETTINGS.margin_m * outward - start[rows]
            toward /= np.linalg.norm(toward, axis=1)[:, None]
            inside &= self.caster.cast(start[rows], toward)[1] == plane[rows]
        found = np.full(len(plane), -1)
        found[rows[inside]] = plane[rows[inside]]
        return reached, found, axis[:, 2]

    def laser(self, k: int) -> Rays:
        s = self.scenario.laser
        start_ns, end_ns = self.movement.sensors_run_ns(k)
        number = np.arange(int((end_ns - start_ns) / NS * s.point_rate_hz))
        t_ns = start_ns + np.rint(number * (NS / s.point_rate_hz)).astype(np.int64)
        low, high = np.radians(s.field_deg)
        zenith = low + (high - low) * ((number * (s.line_rate_hz / s.point_rate_hz)) % 1.0)
        along = scan_directions(zenith, np.zeros(len(zenith)))
        ranges, plane, _ = self.hits("laser", k, t_ns, along[:, None])
        kept = np.flatnonzero((plane >= 0) & (ranges <= s.max_range_m))
        turned = scan_directions(zenith[kept] + np.pi / 2, np.zeros(len(kept)))
        sideways = scan_directions(np.full(len(kept), np.pi / 2), np.full(len(kept), np.pi / 2))
        by_angle = np.radians(s.angle_sigma_deg) * ranges[kept, None]
        noise = [s.range_sigma_m * along[kept], by_angle * turned, by_angle * np.sin(zenith[kept])[:, None] * sideways]
        clean = np.full(len(kept), 1 - s.outlier_share)
        points = ranges[kept, None] * along[kept]
        return Rays("laser", k, t_ns[kept], plane[kept], points, np.stack(noise, axis=2), clean)

    def mbes(self, k: int) -> Rays:
        s = self.scenario.mbes
        start_ns, end_ns = self.movement.sensors_run_ns(k)
        phase = generator(self.seed, "mbes_clock", k).random()  # within a record of the INS a ping may fall anywhere
        period_ns = (1 + CLOCK_RATE_ERROR) / s.ping_rate_hz * NS
        number = np.arange(round((end_ns - start_ns) / period_ns))
        pings = start_ns + np.rint((number + phase) * period_ns).astype(np.int64)
        angles = fan_angles(s).angles_rad
        t_ns, angle = (values.ravel() for values in np.meshgrid(pings, angles, indexing="ij"))
        tilt = transmit_tilts_rad(s, angles, number).ravel()
        across, along = np.radians(s.beam_deg) / 2
        ends = ((0, 0), (across, 0), (0, along))
        _, looks = swing_rad(np.sin(angle), tilt)
        bundle = np.stack([_ray(angle + turn, tilt + more) for turn, more in ends], axis=1)
        ranges, plane, rise = self.hits("mbes", k, t_ns, bundle)
        kept = np.flatnonzero((plane >= 0) & (ranges <= s.max_range_m) & looks)
        axis, angle, tilt = bundle[kept, 0], angle[kept], tilt[kept]
        turned = (_ray(angle + 1e-6, tilt) - _ray(angle - 1e-6, tilt)) / 2e-6
        noise = [s.range_sigma_m * axis, np.radians(s.angle_sigma_deg) * ranges[kept, None] * turned]
        clean = np.where(rise[kept] > np.sin(UPWARD_RAD), 1 - s.surface_share, 1.0)
        clean *= (1 - s.outlier_share) * (1 - s.dropped_ping_share)
        points = ranges[kept, None] * axis
        return Rays("mbes", k, t_ns[kept], plane[kept], points, np.stack(noise, axis=2), clean)

    def placed(self, rays: Rays, points_m: Array, six: Array, error: Array) -> Array:
        """(n, 3) in the target frame, with the mount off by ``six`` and every pose by ``error``."""
        pose, mount = self.movement.pose(rays.pass_number, rays.t_ns), getattr(self.scenario, rays.sensor).mount
        level = self.site.R_target_from_level(pose.latitude_rad, pose.longitude_rad)
        R = level @ R_level_from_body(pose.roll_rad + error[3], pose.pitch_rad + error[4], pose.azimuth_rad + error[5])
        turned = (Rotation.from_rotvec(six[:3]) * R_body_from_sensor(mount)).apply(points_m)
        body = turned + lever_arm_m(mount) + six[3:]
        return np.asarray(pose.position_target_m + error[:3] + np.einsum("nij,nj->ni", R, body))

    def equations(self, rays: Rays, calibrated: str = "mbes") -> tuple[Array, Array, Array]:
        """Jx (n, 18), or (n, 12) of the laser; derivatives by the pose's errors (n, 6), weights (n,)."""
        normal, none, steps = self.normals[rays.plane], np.zeros(6), np.diag(STEP)

        def difference(six: Array, error: Array) -> Array:
            """Central, along the normal (n,)."""
            ends = [self.placed(rays, rays.points_m, sign * six, sign * error) for sign in (1, -1)]
            return np.asarray(np.einsum("ni,ni->n", normal, ends[0] - ends[1]) / 2)

        here = self.placed(rays, rays.points_m, none, none)
        pose = np.stack([difference(none, step) for step in steps], axis=1) / STEP
        of_x = np.zeros((len(here), 6 + 3 * len(NORMALS)))
        if rays.sensor == calibrated:
            of_x[:, :6] = np.stack([difference(step, none) for step in steps], axis=1) / STEP
        family = self.family[rays.plane]
        sign = np.einsum("ni,ni->n", normal, NORMALS[family])  # tops and bottoms turn together
        for k, plane in enumerate(NORMALS):
            rows = family == k
            turns = here[rows] @ np.linalg.svd(plane[None])[2][1:].T
            of_x[rows, 6 + 3 * k : 9 + 3 * k] = sign[rows, None] * np.column_stack([turns, np.ones(len(turns))])
        ends = [self.placed(rays, rays.points_m + moved, none, none) for moved in np.moveaxis(rays.noise_m, 2, 0)]
        if calibrated == "laser":
            of_x = np.hstack([of_x[:, :6], normal, np.cross(here, normal)])
        variance = sum(np.einsum("ni,ni->n", normal, end - here) ** 2 for end in ends)
        return of_x, pose, rays.clean / variance


def bound(scenario: Scenario, seed: int) -> Array:
    """(6, 6): rotation about body x, y, z in rad and lever arm in m, as in calibration.json."""
    world = World(scenario, seed)
    seen = [world.laser(k) for k in world.movement.passes] + [world.mbes(k) for k in world.movement.passes]
    return _bound(scenario, seen, [world.equations(rays) for rays in seen], np.zeros(18))


def laser_bound(scenario: Scenario, seed: int, plumb_deg: float) -> Array:
    """(6, 6) of the laser's mount; the target exactly as designed, out of plumb by a sigma."""
    world = World(scenario, seed)
    seen = [world.laser(k) for k in world.movement.passes]
    known = np.r_[np.zeros(9), [np.radians(plumb_deg) ** -2.0] * 2, 0.0]
    return _bound(scenario, seen, [world.equations(rays, "laser") for rays in seen], known)


def _bound(scenario: Scenario, seen: list[Rays], found: list[tuple[Array, Array, Array]], known: Array) -> Array:
    """(6, 6); ``known`` (x,): what is known of the unknowns beforehand, 1 / variance."""
    of_x, of_pose, weight = (np.concatenate([one[i] for one in found]) for i in range(3))
    normal = of_x.T @ (weight[:, None] * of_x) + np.diag(known)
    of_errors, prior = ins_errors(scenario, np.concatenate([rays.t_ns for rays in seen]) / NS, of_pose)
    if of_errors.shape[1]:
        inner = csc_matrix(of_errors.T @ diags(weight) @ of_errors + prior)
        across = of_errors.T @ (weight[:, None] * of_x)
        factors = splu(inner, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        normal -= across.T @ factors.solve(across)
    scale = 1 / np.sqrt(np.diag(normal))
    return np.asarray(scale[:, None] * np.linalg.inv(scale[:, None] * normal * scale) * scale)[:6, :6]


def ins_errors(scenario: Scenario, seconds: Array, of_pose: Array) -> tuple[csr_matrix, csr_matrix]:
    """Je (n, e), of unit variance each, and P (e, e), ordered by time, a knot behind the records it is tied to."""
    white, drift = scenario.ins.white, scenario.ins.drift
    position = drift.horizontal_m, drift.horizontal_m, drift.vertical_m
    attitude = drift.roll_pitch_deg, drift.roll_pitch_deg, drift.heading_deg
    kinds = (
        (pose_sigmas((white.position_m,) * 3, (white.attitude_deg,) * 3), 1 / scenario.ins.rate_hz, 0.0, 0.0),
        (pose_sigmas(position, attitude), KNOT_S, drift.time_constant_s, KNOT_S),
    )
    blocks, priors, when = [], [], []
    for scale, spacing_s, constant_s, behind_s in kinds:
        if not scale.any():
            continue
        place = (seconds - seconds.min()) / spacing_s
        knots, before = np.unique(np.concatenate([np.floor(place), np.floor(place) + 1]), return_inverse=True)
        column, share, rows = before[: len(place)], place - np.floor(place), np.arange(len(place))
        parts = []
        for offset, part in ((0, 1 - share), (1, share)):
            shape = (len(place), 6 * len(knots))
            for k in range(6):
                values = part * of_pose[:, k] * scale[k]
                parts.append(csr_matrix((values, (rows, 6 * (column + offset) + k)), shape=shape))
        blocks.append(sum(parts[1:], parts[0]))
        priors.append(_markov(knots * spacing_s, constant_s))
        when.append(np.repeat(knots * spacing_s + behind_s, 6))
    if not blocks:
        return csr_matrix((len(seconds), 0)), csr_matrix((0, 0))
    order = np.argsort(np.concatenate(when), kind="stable")
    return hstack(blocks, format="csc")[:, order], block_diag(priors, format="csc")[:, order][order]


def _markov(seconds: Array, constant_s: float) -> csr_matrix:
    """Inverse of the covariance exp(-|t - t'| / constant) of six processes at these times, interleaved; 0: white."""
    f = np.exp(-np.diff(seconds) / constant_s) if constant_s else np.zeros(len(seconds) - 1)
    gain = 1 / (1 - f**2)
    diagonal = np.ones(len(seconds))
    diagonal[:-1] += f**2 * gain
    diagonal[1:] += f**2 * gain
    return csr_matrix(kron(diags([diagonal, -f * gain, -f * gain], [0, 1, -1]), identity(6)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", nargs="?", type=Path)
    parser.add_argument("--seeds", type=int, default=4)
    options = parser.parse_args()
    scenario = load_scenario(options.scenario)
    sigma = np.sqrt(np.diag(np.mean([bound(scenario, seed) for seed in range(1, options.seeds + 1)], axis=0)))
    print("pitch, roll, yaw (about body x, y, z):", np.round(np.degrees(sigma[:3]), 5), "°")
    print("x, y, z:", np.round(1000 * sigma[3:], 4), "mm")


if __name__ == "__main__":
    main()
