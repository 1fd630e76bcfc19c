"""Compute the Cramér-Rao bound of simulated sessions: no unbiased estimator has a smaller covariance.

The bound is independent of the adjustment and imports nothing from it. It uses true poses, true noise and true rays.
Derivatives are differences of a forward model of its own. The INS errors are unknowns with a prior, record by record,
in one sparse matrix. A ray whose whole footprint lies on a plane n · X = d gives one equation

    n · X(range, angles; mount parameters, pose) - d - (two turns and a shift of the plane's family) = 0

whose variance Σ (n · dX/ds)² σ_s² follows from the noise of its range and angles. The unknowns are x (the six mount
parameters, the families' turns and shifts) and e (the INS errors: white at records, Gauss-Markov at knots, linear
between them). Their information matrix is

    [ Jxᵀ W Jx    Jxᵀ W Je     ]
    [ Jeᵀ W Jx    Jeᵀ W Je + P ]        W: 1 / variance, P: inverse of the covariance of e,

and the bound is the first 6 x 6 block of its inverse.

Where the laser itself is calibrated (:func:`laser_bound`), the mount parameters are the laser's and there is no sonar.
One displacement of the whole target, plumb within a sigma, then takes the place of the families' turns and shifts in x.

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
    """Rays of one sensor in one pass that lie on the target.

    Attributes
    ----------
    sensor
        "laser" or "mbes".
    pass_number
        Number of the pass.
    t_ns, plane
        (n,): times, numbers of the planes.
    points_m
        (n, 3) in the sensor's frame.
    noise_m
        (n, 3, s): displacement of each point by a sigma of each of the sensor's s measurements.
    clean
        (n,): expected share of such rays that are neither outliers nor dropped.
    """

    sensor: str
    pass_number: int
    t_ns: NDArray[np.int64]
    plane: NDArray[np.int64]
    points_m: Array
    noise_m: Array
    clean: Array


def _ray(angle_rad: Array, tilt_rad: Array) -> Array:
    """Return the directions (n, 3), in the sonar's frame, of a receive beam and a transmit fan."""
    return directions_in_mbes(swing_rad(np.sin(angle_rad), tilt_rad)[0], tilt_rad)


class World:
    """The truth of a simulated session."""

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
        """Return range, plane and sine of elevation of each ray or beam (n,).

        Plane -1 marks a ray that stage segment would not label. The stage's settings require the whole footprint and a
        margin on one face, no grazing incidence, and a distance from the water line. The edges are not widened by the
        angle noise of a beam, so that the bound takes a few more rays than the stage labels.

        Parameters
        ----------
        sensor
            "laser" or "mbes".
        k
            Number of the pass.
        t_ns
            (n,): times.
        rays
            (n, m, 3): unit vectors in the sensor's frame. The first is the axis; a beam of finite width has two more
            on its rim, one across and one along.
        """
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
        for turn in np.arange(8) * np.pi / 4:  # each edge of the target is normal to one of these directions
            outward = np.cos(turn) * level + np.sin(turn) * np.cross(normal[rows], level)
            rim = np.einsum("nm,nmi->ni", np.sign(np.einsum("nmi,ni->nm", widths, outward)), widths)
            toward = hit[rows] + rim + SETTINGS.margin_m * outward - start[rows]
            toward /= np.linalg.norm(toward, axis=1)[:, None]
            inside &= self.caster.cast(start[rows], toward)[1] == plane[rows]
        plane_on_target = np.full(len(plane), -1)
        plane_on_target[rows[inside]] = plane[rows[inside]]
        return reached, plane_on_target, axis[:, 2]

    def laser(self, k: int) -> Rays:
        """Return the laser's rays on the target in pass ``k``."""
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
        """Return the sonar's beams on the target in pass ``k``."""
        s = self.scenario.mbes
        start_ns, end_ns = self.movement.sensors_run_ns(k)
        phase = generator(self.seed, "mbes_clock", k).random()  # a ping may fall anywhere between two INS records
        period_ns = (1 + CLOCK_RATE_ERROR) / s.ping_rate_hz * NS
        number = np.arange(round((end_ns - start_ns) / period_ns))
        pings = start_ns + np.rint((number + phase) * period_ns).astype(np.int64)
        angles = fan_angles(s).angles_rad
        t_ns, angle = (values.ravel() for values in np.meshgrid(pings, angles, indexing="ij"))
        tilt = transmit_tilts_rad(s, angles, number).ravel()
        across, along = np.radians(s.beam_deg) / 2
        ends = ((0, 0), (across, 0), (0, along))
        _, exists = swing_rad(np.sin(angle), tilt)
        bundle = np.stack([_ray(angle + turn, tilt + tilt_change) for turn, tilt_change in ends], axis=1)
        ranges, plane, rise = self.hits("mbes", k, t_ns, bundle)
        kept = np.flatnonzero((plane >= 0) & (ranges <= s.max_range_m) & exists)
        axis, angle, tilt = bundle[kept, 0], angle[kept], tilt[kept]
        turned = (_ray(angle + 1e-6, tilt) - _ray(angle - 1e-6, tilt)) / 2e-6
        noise = [s.range_sigma_m * axis, np.radians(s.angle_sigma_deg) * ranges[kept, None] * turned]
        clean = np.where(rise[kept] > np.sin(UPWARD_RAD), 1 - s.surface_share, 1.0)
        clean *= (1 - s.outlier_share) * (1 - s.dropped_ping_share)
        points = ranges[kept, None] * axis
        return Rays("mbes", k, t_ns[kept], plane[kept], points, np.stack(noise, axis=2), clean)

    def placed(self, rays: Rays, points_m: Array, mount_error: Array, pose_error: Array) -> Array:
        """Return points (n, 3) in the target frame, computed with a wrong mount and wrong poses.

        Parameters
        ----------
        rays
            The rays, for their sensor, pass and times.
        points_m
            (n, 3) in the sensor's frame.
        mount_error
            (6,): rotation vector in rad, lever arm in m, both in the body frame.
        pose_error
            (6,): position in m, in the target frame; roll, pitch and azimuth in rad.
        """
        pose, mount = self.movement.pose(rays.pass_number, rays.t_ns), getattr(self.scenario, rays.sensor).mount
        level = self.site.R_target_from_level(pose.latitude_rad, pose.longitude_rad)
        R = level @ R_level_from_body(
            pose.roll_rad + pose_error[3], pose.pitch_rad + pose_error[4], pose.azimuth_rad + pose_error[5]
        )
        turned = (Rotation.from_rotvec(mount_error[:3]) * R_body_from_sensor(mount)).apply(points_m)
        body = turned + lever_arm_m(mount) + mount_error[3:]
        return np.asarray(pose.position_target_m + pose_error[:3] + np.einsum("nij,nj->ni", R, body))

    def equations(self, rays: Rays, calibrated: str = "mbes") -> tuple[Array, Array, Array]:
        """Return Jx (n, 18), or (n, 12) for the laser; derivatives by the pose errors (n, 6); weights (n,)."""
        normal, none, steps = self.normals[rays.plane], np.zeros(6), np.diag(STEP)

        def difference(mount_error: Array, pose_error: Array) -> Array:
            """Return central differences along the normal (n,)."""
            ends = [self.placed(rays, rays.points_m, sign * mount_error, sign * pose_error) for sign in (1, -1)]
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
    """Return the bound (6, 6): rotation about body x, y, z in rad and lever arm in m, as in calibration.json."""
    world = World(scenario, seed)
    rays = [world.laser(k) for k in world.movement.passes] + [world.mbes(k) for k in world.movement.passes]
    return _bound(scenario, rays, [world.equations(part) for part in rays], np.zeros(18))


def laser_bound(scenario: Scenario, seed: int, plumb_deg: float) -> Array:
    """Return the bound (6, 6) of the laser's mount, in rad and m.

    Parameters
    ----------
    scenario
        The simulated session, whose target is exactly as designed.
    seed
        Its seed.
    plumb_deg
        Sigma of the target's plumb.
    """
    world = World(scenario, seed)
    rays = [world.laser(k) for k in world.movement.passes]
    prior_information = np.r_[np.zeros(9), [np.radians(plumb_deg) ** -2.0] * 2, 0.0]
    return _bound(scenario, rays, [world.equations(part, "laser") for part in rays], prior_information)


def _bound(
    scenario: Scenario, rays: list[Rays], equations: list[tuple[Array, Array, Array]], prior_information: Array
) -> Array:
    """Return the bound (6, 6); ``prior_information`` (x,) is 1 / variance of each unknown in x."""
    of_x, of_pose, weight = (np.concatenate([part[i] for part in equations]) for i in range(3))
    normal = of_x.T @ (weight[:, None] * of_x) + np.diag(prior_information)
    of_errors, prior = ins_errors(scenario, np.concatenate([part.t_ns for part in rays]) / NS, of_pose)
    if of_errors.shape[1]:
        inner = csc_matrix(of_errors.T @ diags(weight) @ of_errors + prior)
        across = of_errors.T @ (weight[:, None] * of_x)
        factors = splu(inner, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        normal -= across.T @ factors.solve(across)
    scale = 1 / np.sqrt(np.diag(normal))
    return np.asarray(scale[:, None] * np.linalg.inv(scale[:, None] * normal * scale) * scale)[:6, :6]


def ins_errors(scenario: Scenario, seconds: Array, of_pose: Array) -> tuple[csr_matrix, csr_matrix]:
    """Return Je (n, e), for errors of unit variance, and P (e, e), both sorted by time.

    In this order a knot comes after the records that depend on it.

    Parameters
    ----------
    scenario
        The simulated session, for the noise and drift of its INS.
    seconds
        (n,): times of the equations.
    of_pose
        (n, 6): derivatives of the equations by the pose errors.
    """
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
    """Return the inverse of the covariance exp(-|t - t'| / constant) of six interleaved processes; 0: white noise."""
    f = np.exp(-np.diff(seconds) / constant_s) if constant_s else np.zeros(len(seconds) - 1)
    gain = 1 / (1 - f**2)
    diagonal = np.ones(len(seconds))
    diagonal[:-1] += f**2 * gain
    diagonal[1:] += f**2 * gain
    return csr_matrix(kron(diags([diagonal, -f * gain, -f * gain], [0, 1, -1]), identity(6)))


def main() -> None:
    """Print the sigmas of the bound for a scenario."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "scenario", nargs="?", type=Path, metavar="SCENARIO", help="YAML file of a scenario; default: the built-in one"
    )
    parser.add_argument("--seeds", type=int, default=4, help="number of sessions over which the bound is averaged")
    options = parser.parse_args()
    scenario = load_scenario(options.scenario)
    sigma = np.sqrt(np.diag(np.mean([bound(scenario, seed) for seed in range(1, options.seeds + 1)], axis=0)))
    print("pitch, roll, yaw (about body x, y, z):", np.round(np.degrees(sigma[:3]), 5), "°")
    print("x, y, z:", np.round(1000 * sigma[3:], 4), "mm")


if __name__ == "__main__":
    main()
