"""Errors of ranges that depend on how a ray meets a face: biases and noise."""

import numpy as np

from pipeline.simulation.scenario_laser import LaserScenario
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.site import Floats

LEVEL_COSINE = 0.99  # vertical component of a level face's normal
FLATTEST_COSINE = np.cos(np.radians(80.0))  # incidence beyond which nothing grows further


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


def noise_factors(scenario: MbesScenario, normals: Floats, directions: Floats, ahead: Floats) -> Floats:
    """Return the factors (p, b) of the range noise.

    With incidence i the footprint's own depth is tan i times its width. Along track its part is that of the normal's
    component along the transmitting array.

    Parameters
    ----------
    scenario : MbesScenario
        The sonar.
    normals : (p, b, 3) array
        Of the faces met; zero: none is met, and the factor is 1.
    directions : (p, b, 3) array
        Unit vectors of the beams.
    ahead : (p, 3) array
        The transmitting array's direction (the head's y).
    """
    squared = growth(cosines_of_incidence(normals, directions), "tangent_squared")
    approach = np.sum(normals * directions, axis=-1)
    along = np.einsum("pi,pbi->pb", ahead, normals)
    along = np.divide(along, approach, out=np.zeros_like(approach), where=np.abs(approach) > 1e-6) ** 2
    variance = 1 + (scenario.incidence_noise**2 - 1) * squared
    variance = variance + (scenario.slanted_noise**2 - 1) * np.minimum(along, 1 / FLATTEST_COSINE**2 - 1)
    return np.asarray(np.sqrt(variance))
