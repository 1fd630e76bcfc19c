"""Echoes of inner corners, which are stronger than those of faces: in the main lobe, and through side lobes."""

import numpy as np
from numpy.typing import NDArray

from pipeline.simulation.beams import BeamBundles
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.site import Floats

_UNSEEN_M = 0.02  # a corner this much behind what a ray meets is hidden
Generators = dict[str, np.random.Generator]


class CornerEchoes:
    """Echoes of corners in the beams of one pass. Its generators are drawn from in the order of the pings."""

    def __init__(self, scenario: MbesScenario, pool: Pool, beams: BeamBundles, random: Generators) -> None:
        self.scenario, self.pool, self.beams, self.random = scenario, pool, beams, random

    def in_main_lobe(self, paths: Floats, origins: Floats, directions: Floats) -> Floats:
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

    def in_side_lobes(
        self, paths: Floats, origins: Floats, directions: Floats, R_target_from_mbes: Floats
    ) -> Floats:
        """Return the paths, some replaced by the path to a strong corner that a side lobe hears.

        A corner is within reach if its line passes the beam's axis at less than ``side_lobe_widths`` beam widths,
        counted across and along track in the widths there. Of several the nearest, in widths, is heard. Where the
        echoes of face and corner are as one, its middle lies ``side_lobe_pull`` of the way to the corner's range.
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
        result[ping, beam] = ranges + self.scenario.side_lobe_pull * (heard - ranges)
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
