"""Which echo of a beam is detected, and how well: errors by the face it meets, and echoes from elsewhere."""

import numpy as np

from pipeline.simulation.beams import BeamBundles
from pipeline.simulation.corner_echoes import CornerEchoes, Generators
from pipeline.simulation.range_errors import noise_factors, range_bias
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.site import Floats

UPWARD_RAD = np.radians(-30.0)  # beams above this may get the water surface's echo


class Echoes:
    """Echoes of the beams of one pass. Its generators are drawn from in the order of the pings."""

    def __init__(self, scenario: MbesScenario, pool: Pool, beams: BeamBundles, random: Generators) -> None:
        self.scenario, self.pool, self.random = scenario, pool, random
        self.corners = CornerEchoes(scenario, pool, beams, random)

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
            factors = noise_factors(scenario, normals, directions, R_target_from_mbes[:, :, 1])
            paths = paths + range_bias(scenario, normals, directions, scenario.incidence_law)
        if scenario.range_bias_m:
            paths = paths + scenario.range_bias_m
        if scenario.image_share:
            paths = self._image(paths, origins, directions)
        paths = self.corners.in_main_lobe(paths, origins, directions)
        if scenario.side_lobe_share:
            paths = self.corners.in_side_lobes(paths, origins, directions, R_target_from_mbes)
        paths = paths + scenario.range_sigma_m * factors * self.random["range"].standard_normal(paths.shape)
        return self._surface(paths, origins, directions)

    def _normals(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the normals (p, b, 3) of what the beams' axes meet; zero without a detection."""
        repeated = np.repeat(origins, paths.shape[1], axis=0)
        normals = self.pool.caster.normals(repeated, directions.reshape(-1, 3)).reshape(directions.shape)
        return np.where(np.isfinite(paths)[..., None], normals, 0.0)

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

    def _surface(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
        """Return the paths, some replaced by the path to the water surface: along the beam, or else straight up."""
        dice = self.random["surface"].random(paths.shape)
        chosen = (dice < self.scenario.surface_share) & (directions[..., 2] > np.sin(UPWARD_RAD))
        depth = np.broadcast_to((self.pool.water_level_m - origins[:, 2])[:, None], paths.shape)
        rise = directions[..., 2]
        along = np.divide(depth, rise, out=np.full(paths.shape, np.inf), where=rise > 1e-3)
        return np.where(chosen, np.where(along <= self.scenario.max_range_m, along, depth), paths)
