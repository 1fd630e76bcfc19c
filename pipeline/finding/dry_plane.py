"""A plane above the water in the laser's points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.surfaces.flatness import Flatness, plane_axes

Array = NDArray[np.float64]
LEVEL_DEG = 10.0  # a plane that is less inclined is a deck, a quay's top or the water


@dataclass(frozen=True)
class DryPlane:
    """A plane of the cloud, frame of the points: ``normal · x = distance_m``, the normal toward the boat.

    outline_m (k, 2): its dry part along ``plane_axes(normal)``; lowest_m: z of its lower end; column_ends_m: z at which
    columns of its points end; sample_m (k, 3): of some of its points the place along the first axis, the height z, and
    the distance from the plane; gaps_m (k, 2): heights z between which hardly any points lie; refused: why it cannot
    serve, "" if it can.
    """

    normal: Array
    distance_m: float
    rms_m: float
    points: int
    flat: Flatness
    outline_m: Array
    lowest_m: float
    column_ends_m: Array
    sample_m: Array
    gaps_m: Array
    refused: str = ""

    @property
    def tilt_deg(self) -> float:
        """Return the inclination from level, 90: upright; above 90: it overhangs."""
        return float(np.degrees(np.arccos(np.clip(self.normal[2], -1.0, 1.0))))

    @property
    def level(self) -> bool:
        """Return whether the plane is a deck, a quay's top or the water."""
        return min(self.tilt_deg, 180 - self.tilt_deg) < LEVEL_DEG

    @property
    def middle_m(self) -> Array:
        """Return the middle (2,) of the outline's extent along the axes of the plane."""
        return np.asarray((self.outline_m.min(axis=0) + self.outline_m.max(axis=0)) / 2)

    def corners_m(self, outline_m: Array) -> Array:
        """Return the corners (k, 3) of an outline (k, 2) in the plane."""
        return np.asarray(outline_m @ plane_axes(self.normal) + self.distance_m * self.normal)
