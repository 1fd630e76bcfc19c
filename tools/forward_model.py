"""A forward model of simulated sessions apart from the adjustment: true poses, true noise, true rays.

:class:`World` casts the rays of both sensors from the true poses and places their points with a wrong mount or wrong
poses. It imports nothing of the adjustment.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.config.pool import Segment
from pipeline.config.session import Laser
from pipeline.gps_time import NS
from pipeline.simulation.beams import directions_in_mbes, fan_angles, swing_rad, transmit_tilts_rad
from pipeline.simulation.echoes import UPWARD_RAD
from pipeline.simulation.laser import scan_directions
from pipeline.simulation.mbes import CLOCK_RATE_ERROR
from pipeline.simulation.mesh import Mesh, build_mesh
from pipeline.simulation.motion import Movement, R_level_from_body
from pipeline.simulation.mounts import R_body_from_sensor, lever_arm_m
from pipeline.simulation.random_streams import generator
from pipeline.simulation.raycast import RayCaster
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.site import Site

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
DEFAULTS = Segment()
NORMALS = np.array(
    [[-1, 0, 0], [-(0.5**0.5), -(0.5**0.5), 0], [-(0.5**0.5), 0.5**0.5, 0], [0, 0, 1]]
)  # of the families
LASER_BEAM_M = float(Laser.model_fields["beam_m"].default)
BEFORE_M = 0.001  # what stands nearer than the plane by more is before it
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

    def __init__(self, scenario: Scenario, seed: int, segment: Segment = DEFAULTS) -> None:
        self.segment = segment
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
        family = self.family[mesh.surfaces]
        self.centres_m = np.array([self._middle(mesh, family == k) for k in range(len(NORMALS))])

    @staticmethod
    def _middle(mesh: Mesh, triangles: NDArray[np.bool_]) -> Array:
        """Return the mean (3,) of the corners of the faces with these triangles."""
        corners = np.unique(mesh.triangles[triangles])
        return np.asarray(mesh.vertices_m[corners].mean(axis=0))

    def hits(self, sensor: str, k: int, t_ns: Integers, rays: Array) -> tuple[Array, Integers, Array]:
        """Return range, plane and sine of elevation of each ray or beam (n,).

        Plane -1 marks a ray that stage segment would not label. The stage's settings require the whole footprint and a
        margin on one face, no grazing incidence, and a distance from the water line. A beam keeps a distance from inner
        corners, where something stands before the face's plane (``segment.side_lobe_widths``). The weights that rise
        along a ramp (``segment.edge_ramp_m``) count as a limit in its middle. The edges are not widened by the angle
        noise of a beam, so that the bound takes more rays than the stage labels.

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
        good = (plane >= 0) & (self.family[plane] >= 0) & (-slant > np.sin(np.radians(self.segment.min_grazing_deg)))
        ramp = self.segment.edge_ramp_m / 2
        highest_m = self.scenario.target.water_level_m - self.segment.water_margin_m
        above = (hit[:, 2] - self.scenario.target.water_level_m) * (1 if sensor == "laser" else -1)
        rows = np.flatnonzero(good & (above > self.segment.water_margin_m + ramp))
        away = (reached * slant)[rows, None]
        reach = away / np.einsum("ni,nmi->nm", normal[rows], directions[rows, 1:])
        widths = start[rows, None] + reach[..., None] * directions[rows, 1:] - hit[rows, None]  # half axes on the plane
        level = np.cross(normal[rows], np.where(np.abs(normal[rows, 2:]) > 0.5, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
        level /= np.linalg.norm(level, axis=1)[:, None]
        spot = LASER_BEAM_M / 2 / -slant[rows, None] if sensor == "laser" else 0.0  # half its length on the plane
        margin = np.maximum(self.segment.margin_m, spot) + ramp
        inside = np.ones(len(rows), dtype=bool)
        for turn in np.arange(8) * np.pi / 4:  # each edge of the target is normal to one of these directions
            outward = np.cos(turn) * level + np.sin(turn) * np.cross(normal[rows], level)
            rim = np.einsum("nm,nmi->ni", np.sign(np.einsum("nmi,ni->nm", widths, outward)), widths)
            toward = hit[rows] + rim + margin * outward - start[rows]
            toward /= np.linalg.norm(toward, axis=1)[:, None]
            inside &= self.caster.cast(start[rows], toward)[1] == plane[rows]
            if sensor == "mbes":
                beside = hit[rows] + 2 * self.segment.side_lobe_widths * rim + ramp * outward
                inside &= ~self._corner_beside(start[rows], beside) & (beside[:, 2] < highest_m)
        plane_on_target = np.full(len(plane), -1)
        plane_on_target[rows[inside]] = plane[rows[inside]]
        return reached, plane_on_target, axis[:, 2]

    def _corner_beside(self, start: Array, beside: Array) -> NDArray[np.bool_]:
        """Return whether something stands between the head at ``start`` (n, 3) and points of a plane."""
        away = np.linalg.norm(beside - start, axis=1)
        ranges, _ = self.caster.cast(start, (beside - start) / away[:, None])
        return np.asarray(ranges < away - BEFORE_M)

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
