"""Bent beams: the sound speed changes with depth, by a constant gradient or by a profile.

Straight lines meet the mesh. Therefore a bent beam is replaced by its chord, which leaves the head in another direction
than the beam, and the time along the beam is counted, not that along the chord.
"""

import numpy as np

from pipeline.simulation.beams import BeamBundles, directions_in_mbes
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.site import Floats

_STEPS = 64  # of the integration along a ray: 0.1 m
_ROUNDS = 3  # of chord, range, chord
_LEVEL_M = 1e-9  # a ray that falls less in a step is level


class WaterColumn:
    """True sound speed by depth, and beams in it. A path is a time multiplied by the scenario's true sound speed."""

    def __init__(self, scenario: MbesScenario, beams: BeamBundles, water_level_m: float) -> None:
        self.speed, self.gradient = scenario.sound_speed_true_m_s, scenario.sound_speed_gradient_1_s
        self.beams, self.water_level_m = beams, water_level_m
        self.profile = np.array(scenario.sound_speed_profile).reshape(-1, 2)

    def speeds_at(self, origins_m: Floats) -> Floats:
        """Return the true sound speed at heads (p, 3), (p, 1)."""
        if not len(self.profile):
            return np.full((len(origins_m), 1), self.speed)
        depths, speeds = self.profile.T
        return np.asarray(np.interp(self.water_level_m - origins_m[:, 2:], depths, speeds))

    def paths(
        self, origins: Floats, R_target_from_mbes: Floats, swing: Floats, tilts: Floats
    ) -> tuple[Floats, Floats]:
        """Return paths of the beams (p, b), and the directions of their chords (p, b, 3).

        Parameters and results are those of :meth:`BeamBundles.paths`.
        """
        if len(self.profile):
            return self._in_layers(origins, R_target_from_mbes, swing, tilts)
        if self.gradient:
            return self._in_gradient(origins, R_target_from_mbes, swing, tilts)
        return self.beams.paths(origins, R_target_from_mbes, swing, tilts)

    def _in_gradient(
        self, origins: Floats, R_target_from_mbes: Floats, swing: Floats, tilts: Floats
    ) -> tuple[Floats, Floats]:
        """Return paths and directions where the sound speed grows evenly with depth.

        With dc/d(depth) = g, a ray curves upward by g/c per metre, times the part of the vector "up" that is normal to
        the ray. After a range r, to what its axis meets, its chord is turned upward by r g / 2c times this part. The
        part is split into the two directions in which ψ and τ of the ray grow. The mean sound speed down to a depth is
        g · depth / 2 higher.
        """
        ranges_m = self.beams.axis_ranges(origins, R_target_from_mbes, swing, tilts)
        up = R_target_from_mbes[:, 2, :]
        sideways = np.einsum("pi,pbi->pb", up, directions_in_mbes(swing + np.pi / 2, np.zeros_like(tilts)))
        ahead = np.einsum("pi,pbi->pb", up, directions_in_mbes(swing, tilts + np.pi / 2))
        turn = self.gradient / (2 * self.speed) * np.where(np.isfinite(ranges_m), ranges_m, 0.0)
        swing, tilts = swing + turn * sideways / np.cos(tilts), tilts + turn * ahead
        paths, directions = self.beams.paths(origins, R_target_from_mbes, swing, tilts)
        depths = -directions[..., 2] * np.where(np.isfinite(paths), paths, 0.0)
        return paths * (1 - self.gradient * depths / (2 * self.speed)), directions

    def _in_layers(
        self, origins: Floats, R_target_from_mbes: Floats, swing: Floats, tilts: Floats
    ) -> tuple[Floats, Floats]:
        """Return paths and directions in the profile, by rounds of chord and range."""
        start = directions_in_mbes(swing, tilts) @ R_target_from_mbes.transpose(0, 2, 1)
        depths = np.broadcast_to(self.water_level_m - origins[:, 2:], swing.shape)
        for _ in range(_ROUNDS):
            ranges_m = self.beams.axis_ranges(origins, R_target_from_mbes, swing, tilts)
            chords, _ = self._chords(depths, start, np.where(np.isfinite(ranges_m), ranges_m, 0.0))
            of_head = chords @ R_target_from_mbes
            swing, tilts = np.arctan2(of_head[..., 0], -of_head[..., 2]), np.arcsin(of_head[..., 1])
        paths, directions = self.beams.paths(origins, R_target_from_mbes, swing, tilts)
        there = np.isfinite(paths)
        _, times_s = self._chords(depths, start, np.where(there, paths, 0.0))
        return np.where(there, self.speed * times_s, paths), directions

    def _chords(self, depths_m: Floats, start: Floats, lengths_m: Floats) -> tuple[Floats, Floats]:
        """Return unit vectors (p, b, 3) of the chords of rays that begin with ``start``, and the times along the rays.

        The ray is integrated in steps, by the midpoint rule. With c(depth) and v, the downward component of its
        direction, dv/ds = -(1 - v²) c' / c, as Snell's law has it. The horizontal direction stays.

        Parameters
        ----------
        depths_m : (p, b) array
            Depths of the head below the water.
        start : (p, b, 3) array
            Unit vectors at the head, target frame.
        lengths_m : (p, b) array
            Lengths of the chords.
        """
        table, speeds = self.profile.T
        slopes = np.concatenate([[0.0], np.diff(speeds) / np.diff(table), [0.0]])

        def bend(depth: Floats, down: Floats, step: Floats) -> Floats:
            """Return c' / c on the way from a depth: of both ends, so that borders of layers count in full."""
            fall, speed = down * step, np.interp(depth, table, speeds)
            slope = np.divide(
                np.interp(depth + fall, table, speeds) - speed,
                fall,
                out=slopes[np.searchsorted(table, depth)],
                where=np.abs(fall) > _LEVEL_M,
            )
            return np.asarray(slope / speed)

        step = lengths_m / _STEPS
        down, depth, across, time = -start[..., 2], depths_m, np.zeros_like(step), np.zeros_like(step)
        for _ in range(_STEPS):
            half_down = down - step / 2 * (1 - down**2) * bend(depth, down, step / 2)
            half_depth = depth + step / 2 * down
            down = down - step * (1 - half_down**2) * bend(depth, half_down, step)
            depth = depth + step * half_down
            across = across + step * np.sqrt(1 - half_down**2)
            time = time + step / np.interp(half_depth, table, speeds)
        fallen, arc = depth - depths_m, np.hypot(across, depth - depths_m)
        level = start[..., :2] / np.maximum(np.hypot(start[..., 0], start[..., 1]), 1e-12)[..., None]
        chord = np.concatenate([level * across[..., None], -fallen[..., None]], axis=-1)
        there = arc > 0
        chord = np.where(there[..., None], chord / np.where(there, arc, 1.0)[..., None], start)
        return chord, time * np.divide(lengths_m, arc, out=np.ones_like(arc), where=there)
