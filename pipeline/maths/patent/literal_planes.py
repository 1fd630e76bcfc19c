"""Both sensors' planes P1 to P4 as the patent prints them: one for each sensor, plain total least squares, I + Ω.

Numbers in brackets are paragraphs of patent CN 105425246 B; :mod:`pipeline.maths.patent.literal_angles` says what is
chosen where the text leaves a choice, and what follows.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.planes import Plane, fit_plane
from pipeline.maths.geometry.rotations import skew
from pipeline.maths.patent.angles import fourth_normal
from pipeline.maths.patent.lifted_moments import plane_moments
from pipeline.maths.target.model import ROLES

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SessionPlanes:
    """Both sensors' points on P1, P2, P3 over all passes: lifted moments (40, 40), and the laser's planes."""

    lifted: Mapping[str, Array]
    laser: Mapping[str, Plane]

    @property
    def laser_normals(self) -> dict[str, Array]:
        """The laser's normals (3,) of P1 to P4, target frame."""
        normals = {name: self.laser[name].normal for name in ROLES}
        return normals | {"P4": fourth_normal(normals["P1"], normals["P2"])}

    def mbes_plane(self, name: str, angles_rad: Array, lever_arm_m: Array) -> Plane:
        """Fit the MBES's plane by plain total least squares, with the mount (I + Ω) · coarse.

        Parameters
        ----------
        name
            P1, P2 or P3.
        angles_rad
            Corrections (δθ, δγ, δφ) (3,), about the body's x, y, z.
        lever_arm_m
            Lever arm (3,), body axes.
        """
        placed = plane_moments(self.lifted[name], literal_matrix(angles_rad), lever_arm_m)
        return fit_plane(placed.with_equal_errors(), self.laser[name].normal)

    def mbes_normals(self, angles_rad: Array, lever_arm_m: Array) -> dict[str, Array]:
        """Return the MBES's normals (3,) of P1 to P4 with these corrections and this lever arm."""
        normals = {name: self.mbes_plane(name, angles_rad, lever_arm_m).normal for name in ROLES}
        return normals | {"P4": fourth_normal(normals["P1"], normals["P2"])}


def literal_matrix(angles_rad: Array) -> Array:
    """Return I + Ω (3, 3) of the corrections (δθ, δγ, δφ) (3,) about the body's x, y, z, as [0119] prints it."""
    return np.asarray(np.eye(3) + skew(angles_rad))
