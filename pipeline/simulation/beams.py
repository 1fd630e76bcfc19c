"""A fan of beams: the angles that a head records, its transmit tilts, and ranges of beams of finite width.

Directions follow from rotations. A transmit fan tilted by τ consists of the ray (0, sin τ, -cos τ), swung to starboard
by ψ round the transmitting array (the y axis). The component of the swung ray along the receiving array (the x axis) is
cos τ sin ψ. The receive beam at the angle θ hears the ray with the component sin θ.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.simulation.raycast import RayCaster
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.site import Floats

LEAST_WEIGHT = 0.3  # least weight of the rays that meet a surface; with less there is no detection
LONGEST_STEP = 60_000  # in section A2, whose steps are at most 65535


@dataclass(frozen=True)
class FanAngles:
    """Angles of a fan as a BTH0 packet holds them: evenly from first to last (A0), or first plus whole steps (A2)."""

    first_rad: float  # a float32 number, as is last_rad
    last_rad: float
    angles_rad: Floats
    steps: NDArray[np.uint16] | None = None  # A2 only; the first is 0
    step_scale_rad: float = 0.0


def fan_angles(scenario: MbesScenario) -> FanAngles:
    """Return the recorded angles, the same in all pings, port to starboard.

    "equidistant" angles are even in tan(angle), as on a flat floor.
    """
    half = np.radians(scenario.sector_deg) / 2
    first, last = float(np.float32(-half)), float(np.float32(half))
    if scenario.spacing == "equi_angle":
        return FanAngles(first, last, np.linspace(first, last, scenario.beams))
    equidistant = np.arctan(np.linspace(-np.tan(half), np.tan(half), scenario.beams)) - first
    scale = float(np.float32(np.diff(equidistant).max() / LONGEST_STEP))
    steps = np.diff(np.rint(equidistant / scale), prepend=0.0).astype(np.uint16)
    return FanAngles(first, last, first + np.cumsum(steps.astype(np.float64)) * scale, steps, scale)


def transmit_tilts_rad(scenario: MbesScenario, angles_rad: Floats, pings: NDArray[np.int64]) -> Floats:
    """Return the recorded transmit tilts.

    Parameters
    ----------
    scenario : MbesScenario
        The sonar; each of its sectors reaches up to and including its to_deg.
    angles_rad : (b,) array
        Recorded angles of the beams.
    pings : (p,) array
        Numbers of the pings.

    Returns
    -------
    (p, b) array
        Tilts, forward +, rad.
    """
    angles_deg = np.degrees(angles_rad)
    of_beam = np.zeros(len(angles_rad))
    for sector in reversed(scenario.sectors):
        of_beam = np.where(angles_deg <= sector.to_deg, sector.tilt_deg, of_beam)
    of_ping = np.array(scenario.ping_tilts_deg or (0.0,))
    return np.radians(of_ping[pings % len(of_ping), None] + of_beam)


def swing_rad(sine: Floats, tilt_rad: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the swing ψ of the ray in a tilted fan with the starboard component ``sine``.

    The ray looks down: the widest fan of a scenario is 170°.

    Parameters
    ----------
    sine : (p, b) array
        Starboard component of the ray's unit vector.
    tilt_rad : (p, b) array
        Tilt τ of the fan, forward +.

    Returns
    -------
    swing : (p, b) array
        ψ, to starboard, rad; 0 if the fan has no ray with this component.
    exists : (p, b) array of bool
        Whether the fan has a ray with this component.
    """
    sideways = sine / np.cos(tilt_rad)
    exists = np.abs(sideways) < 1
    return np.arcsin(np.where(exists, sideways, 0.0)), exists


def directions_in_mbes(swing: Floats, tilt_rad: Floats) -> Floats:
    """Return unit vectors (..., 3) in the mbes frame: the ray (0, sin τ, -cos τ) swung round y by ψ."""
    along = np.cos(tilt_rad)
    forward = np.broadcast_to(np.sin(tilt_rad), swing.shape)
    return np.stack([np.sin(swing) * along, forward, -np.cos(swing) * along], axis=-1)


class BeamBundles:
    """Beams as bundles of rays over their -3 dB width, weighted with a Gaussian pattern.

    In the array's near field a beam is no narrower than the aperture: at the range r to what its axis meets, its width
    is at least aperture / r. The rays still leave one point.
    """

    def __init__(self, scenario: MbesScenario, caster: RayCaster, water_level_m: float) -> None:
        self.caster, self.water_level_m, self.max_range_m = caster, water_level_m, scenario.max_range_m
        self.projector_m = np.array(scenario.projector_offset_m)
        self.beam_rad, self.aperture_m = np.radians(scenario.beam_deg), np.array(scenario.aperture_m)
        counts = (1, 1) if scenario.point_beams else scenario.sub_rays
        across, along = (np.arange(n) - n // 2 for n in counts)
        parts = [offsets / max(n - 1, 1) for offsets, n in zip((across, along), counts, strict=True)]  # in widths
        grid_across, grid_along = (grid.ravel() for grid in np.meshgrid(*parts, indexing="ij"))
        self.across_rad = grid_across * np.radians(scenario.beam_deg[0])
        self.along_rad = grid_along * np.radians(scenario.beam_deg[1])
        weights = np.exp(-4 * np.log(2) * (grid_across**2 + grid_along**2))
        self.weights = weights / weights.sum()
        self.rays = len(weights)
        self.axis = self.rays // 2

    def paths(
        self, origins_m: Floats, R_target_from_mbes: Floats, swing: Floats, tilt_rad: Floats
    ) -> tuple[Floats, Floats]:
        """Return half the sound's path of each beam, and the directions of the beams' axes.

        If a beam lies entirely on one plane, its range is that along its axis (phase detection). Any other beam's range
        is the weighted mean over its rays, which differ by parts of the receive width in θ and of the transmit width in
        τ. (From sin θ = cos τ sin ψ: dψ = √(1 + l²) dθ + l sin ψ dτ with l = tan τ / cos ψ.)

        Which plane a ray meets, and whether under water, is judged on the mesh as designed; of the rays that count, one
        that the faces as built bring out of the water is dropped.

        Parameters
        ----------
        origins_m : (p, 3) array
            Acoustic centre in the target frame, by ping.
        R_target_from_mbes : (p, 3, 3) array
            Attitude by ping.
        swing, tilt_rad : (p, b) arrays
            ψ and τ of the beams' axes, rad.

        Returns
        -------
        paths : (p, b) array
            m; inf without a detection.
        directions : (p, b, 3) array
            Unit vectors in the target frame.
        """
        pings, beams = swing.shape
        lean = (np.tan(tilt_rad) / np.cos(swing))[..., None]
        across, along = self.across_rad, self.along_rad
        if self.aperture_m.any():
            axis_ranges_m = self.axis_ranges(origins_m, R_target_from_mbes, swing, tilt_rad)
            wider = self.widths_rad(axis_ranges_m) / self.beam_rad
            across, along = across * wider[..., :1], along * wider[..., 1:]
        turned = np.hypot(1.0, lean) * across + lean * np.sin(swing)[..., None] * along
        direction_mbes = directions_in_mbes(swing[..., None] + turned, tilt_rad[..., None] + along)
        directions = direction_mbes.reshape(pings, beams * self.rays, 3) @ R_target_from_mbes.transpose(0, 2, 1)
        origins = np.repeat(origins_m, beams * self.rays, axis=0)
        flat = directions.reshape(-1, 3)
        reach, triangles = self.caster.first_met(origins, flat)
        wet, paths = self._wet(reach, origins, flat), np.zeros(len(reach))
        shape = (pings, beams, self.rays)
        rays_wet, surfaces = wet.reshape(shape), self.caster.mesh.surfaces[triangles].reshape(shape)
        one_plane = np.all(rays_wet & (surfaces == surfaces[..., self.axis, None]), axis=-1)
        needed = rays_wet & (~one_plane[..., None] | (np.arange(self.rays) == self.axis))
        rows = np.flatnonzero(needed)
        paths[rows] = self.caster.ranges(triangles[rows], origins[rows], flat[rows])
        wet[rows] = self._wet(paths[rows], origins[rows], flat[rows])
        rows = rows[wet[rows]]
        if self.projector_m.any():
            points_mbes = paths[rows, None] * direction_mbes.reshape(-1, 3)[rows]
            paths[rows] = (paths[rows] + np.linalg.norm(points_mbes - self.projector_m, axis=1)) / 2
        detected = self._detect(paths.reshape(shape), wet.reshape(shape), one_plane)
        return detected, directions.reshape(*shape, 3)[:, :, self.axis]

    def widths_rad(self, ranges_m: Floats) -> Floats:
        """Return the widths (..., 2) of beams, across and along, at ranges (...)."""
        return np.maximum(self.beam_rad, self.aperture_m / np.maximum(ranges_m, 0.1)[..., None])

    def axis_ranges(
        self, origins_m: Floats, R_target_from_mbes: Floats, swing: Floats, tilt_rad: Floats
    ) -> Floats:
        """Return the ranges (p, b) m to what the beams' axes meet; inf: nothing. Parameters as for :meth:`paths`."""
        axes = directions_in_mbes(swing, tilt_rad) @ R_target_from_mbes.transpose(0, 2, 1)
        ranges, _ = self.caster.cast(np.repeat(origins_m, axes.shape[1], axis=0), axes.reshape(-1, 3))
        return ranges.reshape(swing.shape)

    def _wet(
        self, ranges_m: NDArray[np.floating[Any]], origins_m: Floats, directions: Floats
    ) -> NDArray[np.bool_]:
        """Return which rays (n,) meet something below the water, within the sonar's range."""
        near = ranges_m <= self.max_range_m
        z_m = origins_m[:, 2] + np.where(near, ranges_m, 0.0) * directions[:, 2]
        return np.asarray(near & (z_m < self.water_level_m))

    def _detect(self, paths: Floats, wet: NDArray[np.bool_], one_plane: NDArray[np.bool_]) -> Floats:
        """Return the detected path (p, b) of each beam from those of its rays (p, b, rays); inf: no detection."""
        paths = np.where(wet, paths, 0.0)
        weights = self.weights * wet
        total = weights.sum(axis=-1)
        mean = np.divide((weights * paths).sum(axis=-1), total, out=np.full(total.shape, np.inf), where=total > 0)
        on_axis = np.where(wet[..., self.axis], paths[..., self.axis], np.inf)
        return np.where(one_plane, on_axis, np.where(total >= LEAST_WEIGHT, mean, np.inf))
