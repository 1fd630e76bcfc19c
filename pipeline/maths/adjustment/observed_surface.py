"""A surface that the sensors observe: the plane of one family of faces."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.planes import tangents_of
from pipeline.maths.target.face import HORIZONTAL_COSINE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ObservedSurface:
    """The plane of one family of faces: normal · (X - centre) = shift, target frame.

    The tangents (2, 3) satisfy t1 × t2 = normal. They turn with the surface. A new choice after each step could differ,
    but the interval sums refer to these tangents.
    """

    family: str
    normal: Array
    tangents: Array
    centre_m: Array
    shift_m: float

    @classmethod
    def at(cls, family: str, normal: Array, centre_m: Array, shift_m: float = 0.0) -> "ObservedSurface":
        """Return the surface with tangents chosen from its normal.

        Parameters
        ----------
        family : str
            Name of the family of faces.
        normal : (3,) array
            Unit normal, target frame.
        centre_m : (3,) array
            Fixed point near the surface, target frame.
        shift_m : float
            Distance of the surface from the centre, along the normal.
        """
        return cls(family, normal, tangents_of(normal), centre_m, shift_m)

    @property
    def level(self) -> bool:
        """Return whether the surface is horizontal."""
        return bool(abs(self.normal[2]) > HORIZONTAL_COSINE)

    @property
    def distance_m(self) -> float:
        """Return the value of normal · X on the surface."""
        return float(self.normal @ self.centre_m + self.shift_m)

    def updated(self, turn_1: float, turn_2: float, shift_m: float) -> "ObservedSurface":
        """Return the surface after a step of its three parameters.

        Parameters
        ----------
        turn_1, turn_2 : float
            Changes of the normal along the tangents, rad.
        shift_m : float
            Change of the shift.
        """
        normal = self.normal + turn_1 * self.tangents[0] + turn_2 * self.tangents[1]
        normal /= np.linalg.norm(normal)
        first = self.tangents[0] - (self.tangents[0] @ normal) * normal
        first /= np.linalg.norm(first)
        tangents = np.stack([first, np.cross(normal, first)])
        return replace(self, normal=normal, tangents=tangents, shift_m=self.shift_m + shift_m)
