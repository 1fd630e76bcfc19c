"""What range a laser beam gives that has a width, and that faces return otherwise by how it meets them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.simulation.range_errors import range_bias
from pipeline.simulation.raycast import Pool
from pipeline.simulation.scenario_laser import LaserScenario
from pipeline.simulation.site import Floats

_PULSE_M = 0.5  # echoes farther apart than this are told apart


@dataclass(frozen=True)
class Rays:
    """Rays and what they meet, target frame; range inf and surface -1: nothing."""

    origins_m: Floats  # (n, 3)
    directions: Floats  # (n, 3), unit vectors
    ranges_m: Floats  # (n,)
    surfaces: NDArray[np.int64]  # (n,)


def measured_ranges(scenario: LaserScenario, pool: Pool, rays: Rays) -> Floats:
    """Return the ranges (n,) that the scanner measures to the faces, without noise; inf: none."""
    measured = rays.ranges_m
    if scenario.spot_m or scenario.spot_divergence_deg:
        measured = _mixed(scenario, pool, rays)
    if scenario.incidence_bias_m or scenario.level_bias_m:
        normals = pool.caster.normals(rays.origins_m, rays.directions)
        measured = measured + range_bias(scenario, normals, rays.directions, scenario.incidence_law)
    return measured + scenario.range_bias_m


def _mixed(scenario: LaserScenario, pool: Pool, rays: Rays) -> Floats:
    """Return the ranges (n,) of beams with a width.

    A beam that meets more than one plane is four rays round its axis beside the axis itself, which counts twice. Their
    mean is measured, without those that end in water or whose echoes can be told apart from the axis's.
    """
    directions, ranges = rays.directions, rays.ranges_m
    side = np.cross(directions, [0.0, 0.0, 1.0])
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    total, count, mixed = 2 * ranges, np.full(len(ranges), 2.0), np.zeros(len(ranges), dtype=bool)
    widening = np.tan(np.radians(scenario.spot_divergence_deg) / 2)
    for way in (side, -side, np.cross(side, directions), -np.cross(side, directions)):
        leaning = (directions + widening * way) / np.hypot(1.0, widening)
        found, surface = pool.caster.cast(rays.origins_m + scenario.spot_m / 2 * way, leaning)
        near = np.abs(found - np.where(np.isfinite(ranges), ranges, 0.0)) < _PULSE_M
        near &= rays.origins_m[:, 2] + np.where(near, found, 0.0) * leaning[:, 2] > pool.water_level_m
        total, count = np.where(near, total + found, total), count + near
        mixed |= near & (surface != rays.surfaces)
    return np.where(mixed, total / count, ranges)
