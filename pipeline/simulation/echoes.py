"""Which echo of a beam is detected, and how well: errors by the face it meets, and echoes from elsewhere."""

import numpy as np
from numpy.typing import NDArray

from pipeline.simulation.beams import BeamBundles
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario_sensors import LaserScenario, MbesScenario
from pipeline.simulation.site import Floats

UPWARD_RAD = np.radians(-30.0)  # beams above this may get the water surface's echo
LEVEL_COSINE = 0.99  # vertical component of a level face's normal
FLATTEST_COSINE = np.cos(np.radians(80.0))  # incidence beyond which nothing grows further
_UNSEEN_M = 0.02  # a corner this much behind what a ray meets is hidden
_Generators = dict[str, np.random.Generator]


def cosines_of_incidence(normals: Floats, directions: Floats) -> Floats:
    """Return cos i (...) of rays that meet faces, at least that of 80°; 1 where a ray meets none (normal zero)."""
    met = np.any(normals != 0, axis=-1)
    return np.where(met, np.clip(np.abs(np.sum(normals * directions, axis=-1)), FLATTEST_COSINE, 1.0), 1.0)


def growth(cosines: Floats, law: str) -> Floats:
    """Return what a bias grows with, 1 at 45°: (1 / cos i - 1) / (√2 - 1) by "secant", or else tan² i."""
    return (1 / cosines - 1) / (np.sqrt(2) - 1) if law == "secant" else 1 / cosines**2 - 1


def range_bias(scenario: MbesScenario | LaserScenario, normals: Floats, directions: Floats, law: str) -> Floats:
    """Return what a sensor adds to its ranges (...) because of how its rays meet the faces.

    Parameters
    ----------
    scenario : MbesScenario or LaserScenario
        The sensor.
    normals : (..., 3) array
        Of the faces met; zero: none is met, and nothing is added.
    directions : (..., 3) array
        Unit vectors of the rays.
    law : {"secant", "tangent_squared"}
        How the bias grows with incidence.
    """
    level = np.abs(normals[..., 2]) > LEVEL_COSINE
    bias = scenario.incidence_bias_m * growth(cosines_of_incidence(normals, directions), law)
    return np.asarray(bias + scenario.level_bias_m * level)


class Echoes:
    """Echoes of the beams of one pass. Its generators are drawn from in the order of the pings."""

    def __init__(self, scenario: MbesScenario, pool: Pool, beams: BeamBundles, random: _Generators) -> None:
        self.scenario, self.pool, self.beams, self.random = scenario, pool, beams, random

    def detected(self, paths: Floats, origins: Floats, directions: Floats, R_target_from_mbes: Floats) -> Floats:
        """Return the detected paths (p, b), noise of the ranges included; inf: no detection.

        Parameters
        ----------
        paths : (p, b) array
            Half the sound's way to the faces and back; inf: no face.
        origins : (p, 3) array
            Acoustic centre in the target frame.
        directions : (p, b, 3) array
            Unit vectors of the beams' axes (or chords) in the target frame.
        R_target_from_mbes : (p, 3, 3) array
            Attitude of the head.
        """
        scenario = self.scenario
        factors = np.ones(1)
        biases = (scenario.incidence_bias_m, scenario.level_bias_m)
        if any(biases) or (scenario.incidence_noise, scenario.slanted_noise) != (1.0, 1.0):
            normals = self._normals(paths, origins, directions)
            factors = self._noise_factors(normals, directions, R_target_from_mbes)
            paths = paths + range_bias(scenario, normals, directions, scenario.incidence_law)
        if scenario.range_bias_m:
            paths = paths + scenario.range_bias_m
        if scenario.image_share:
            paths = self._image(paths, origins, directions)
        paths = self._corners(paths, origins, directions)
        if scenario.side_lobe_share:
            paths = self._side_lobes(paths, origins, directions, R_target_from_mbes)
        paths = paths + scenario.range_sigma_m * factors * self.random["range"].standard_normal(paths.shape)
        return self._surface(paths, origins, directions)

    def _normals(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the normals (p, b, 3) of what the beams' axes meet; zero without a detection."""
        repeated = np.repeat(origins, paths.shape[1], axis=0)
        normals = self.pool.caster.normals(repeated, directions.reshape(-1, 3)).reshape(directions.shape)
        return np.where(np.isfinite(paths)[..., None], normals, 0.0)

    def _noise_factors(self, normals: Floats, directions: Floats, R_target_from_mbes: Floats) -> Floats:
        """Return the factors (p, b) of the range noise.

        With incidence i the footprint's own depth is tan i times its width; along track its part is that of the
        normal's component along the transmitting array (the head's y).
        """
        scenario, steepest = self.scenario, 1 / FLATTEST_COSINE**2 - 1
        squared = growth(cosines_of_incidence(normals, directions), "tangent_squared")
        approach = np.sum(normals * directions, axis=-1)
        ahead = np.einsum("pi,pbi->pb", R_target_from_mbes[:, :, 1], normals)
        along = np.divide(ahead, approach, out=np.zeros_like(approach), where=np.abs(approach) > 1e-6) ** 2
        variance = 1 + (scenario.incidence_noise**2 - 1) * squared
        variance = variance + (scenario.slanted_noise**2 - 1) * np.minimum(along, steepest)
        return np.asarray(np.sqrt(variance))

    def _image(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the paths, some just below the water replaced: there directly, back by reflection at the surface.

        The way back is that from the mirror image of the point above the surface.
        """
        dice = self.random["image"].random(paths.shape)
        ping, beam = np.nonzero(np.isfinite(paths) & (dice < self.scenario.image_share))
        hits = origins[ping] + paths[ping, beam, None] * directions[ping, beam]
        depth = self.pool.water_level_m - hits[:, 2]
        mirrored = hits + np.outer(2 * depth, [0.0, 0.0, 1.0])
        near = (depth > 0) & (depth < self.scenario.image_depth_m)
        result = paths.copy()
        way_back = np.linalg.norm(mirrored - origins[ping], axis=1)
        result[ping[near], beam[near]] = (paths[ping, beam] + way_back)[near] / 2
        return result

    def _corners(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the paths, some near an inner corner replaced by the path to the corner's line.

        The echo comes from the nearest point of the line within the beam.
        """
        scenario = self.scenario
        dice = self.random["corner"].random(paths.shape)
        ping, beam = np.nonzero(np.isfinite(paths) & (dice < scenario.corner_share))
        hits = origins[ping] + paths[ping, beam, None] * directions[ping, beam]
        half = paths[ping, beam] * np.radians(scenario.beam_deg[0]) / 2
        result = paths.copy()
        for x, y, low, high in self.pool.corner_lines:
            near = np.hypot(hits[:, 0] - x, hits[:, 1] - y) < scenario.corner_reach_m
            near &= (hits[:, 2] > low) & (hits[:, 2] < high)
            start = origins[ping[near]]
            height = np.clip(start[:, 2], hits[near, 2] - half[near], hits[near, 2] + half[near])
            points = np.column_stack([np.full(len(height), x), np.full(len(height), y), np.clip(height, low, high)])
            result[ping[near], beam[near]] = np.linalg.norm(points - start, axis=1)
        return result

    def _side_lobes(
        self, paths: Floats, origins: Floats, directions: Floats, R_target_from_mbes: Floats
    ) -> Floats:
        """Return the paths, some replaced by the path to a strong corner that a side lobe hears.

        A corner is within reach if its line passes the beam's axis at less than ``side_lobe_widths`` beam widths,
        counted across and along track in the widths there. Of several the nearest, in widths, is heard.
        """
        dice = self.random["side_lobe"].random(paths.shape)
        ping, beam = np.nonzero(np.isfinite(paths) & (dice < self.scenario.side_lobe_share))
        start, axis, ranges = origins[ping], directions[ping, beam], paths[ping, beam]
        ahead = R_target_from_mbes[ping][:, :, 1]
        sides = np.stack([np.cross(axis, ahead), ahead], axis=1)
        sides = sides / (self.beams.widths_rad(ranges) * ranges[:, None])[..., None]  # of a point: widths off the axis
        hits, nearest, heard = start + ranges[:, None] * axis, np.full(len(ping), np.inf), ranges.copy()
        for segment in self.pool.corner_segments:
            one, other = (np.einsum("nij,nj->ni", sides, end - hits) for end in segment)
            way = other - one
            share = -np.sum(one * way, axis=1) / np.maximum(np.sum(way**2, axis=1), 1e-12)
            share = np.clip(share, 0.0, 1.0)
            off = np.linalg.norm(one + share[:, None] * way, axis=1)
            rows = np.flatnonzero(off < np.minimum(nearest, self.scenario.side_lobe_widths))
            points = segment[0] + share[rows, None] * (segment[1] - segment[0])
            distance = np.linalg.norm(points - start[rows], axis=1)
            rows, distance = self._seen(rows, points, distance, start)
            nearest[rows], heard[rows] = off[rows], distance
        result = paths.copy()
        result[ping, beam] = heard
        return result

    def _seen(
        self, rows: NDArray[np.int64], points: Floats, distance: Floats, start: Floats
    ) -> tuple[NDArray[np.int64], Floats]:
        """Return the rows, and the distances, of points under water that nothing hides."""
        if not len(rows):
            return rows, distance
        met, _ = self.pool.caster.cast(start[rows], (points - start[rows]) / distance[:, None])
        seen = (met > distance - _UNSEEN_M) & (points[:, 2] < self.pool.water_level_m)
        return rows[seen], distance[seen]

    def _surface(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the paths, some replaced by the path to the water surface: along the beam, or else straight up."""
        dice = self.random["surface"].random(paths.shape)
        chosen = (dice < self.scenario.surface_share) & (directions[..., 2] > np.sin(UPWARD_RAD))
        depth = np.broadcast_to((self.pool.water_level_m - origins[:, 2])[:, None], paths.shape)
        rise = directions[..., 2]
        along = np.divide(depth, rise, out=np.full(paths.shape, np.inf), where=rise > 1e-3)
        return np.where(chosen, np.where(along <= self.scenario.max_range_m, along, depth), paths)
