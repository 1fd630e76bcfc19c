"""How LibAC's targets close between two passes with a mount, and whether a mount can explain what does not close.

A target's *closing* is its place in the second pass less that in the first: of a plane the distance along its normal,
of a sphere its centre's coordinates along the first pass's track, across it, and up. The closings c (7,) follow to
first order from errors:

    c = J m + v τ + d + e,          Q = J M Jᵀ + v vᵀ σ_τ² + D + E

m (6,) are the mount's (J by differences of closings with a mount that is a little wrong, so that no second formula
stands here), τ a latency of the laser that nobody knows (v: the velocity in the second pass less that in the first,
along each closing), d the INS's, δ + ω × r, drawn anew for each target and pass, which is more freedom than a drift
has, e those of the fits, for independent noise. If the errors are as large as said, cᵀ Q⁻¹ c is the number of closings
on average, and that of some of them their number.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import exp_so3, skew
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.mount import Mounted
from tools.libac_rows import PASSES, Rows
from tools.libac_surfaces import FoundPlane, PlaneClosing, Sphere, plane_closing, plane_through, sphere_through

Array = NDArray[np.float64]
AllRows = Mapping[tuple[str, int], Rows]
PLANE, SPHERES = "target1", ("sphere1", "sphere2")
RADIUS_M = 0.1  # of the spheres: r in LidarToolkit's script104_105_106.m
GROUPS = {"plane": (0,), "along": (1, 4), "across": (2, 5), "up": (3, 6), "all": tuple(range(7))}
ROLL = MOUNT_NAMES.index("rotation_y")
STEP = 1e-4  # rad and m: of the mount, for the derivatives
LATENCY_S = 1.0  # sigma of a latency that nobody knows


@dataclass(frozen=True)
class Closings:
    """Plane and spheres of both passes with one mount, level frame; track (3, 3): axes of the first pass's track."""

    planes: tuple[FoundPlane, FoundPlane]
    spheres: Mapping[str, tuple[Sphere, Sphere]]
    track: Array

    @property
    def plane(self) -> PlaneClosing:
        """Return how the plane closes."""
        return plane_closing(*self.planes)

    def of_sphere(self, name: str) -> Array:
        """Return the centre (3,) m in the second pass less that in the first: along the track, across it, up."""
        first, second = self.spheres[name]
        return np.asarray(self.track @ (second.centre_m - first.centre_m))

    @property
    def vector(self) -> Array:
        """Return all closings (7,) m: the plane's distance, then the spheres' coordinates."""
        return np.concatenate([[self.plane.distance_m], *(self.of_sphere(name) for name in SPHERES)])


def closings_with(all_rows: AllRows, on_plane: Sequence[NDArray[np.int64]], mount: Mounted) -> Closings:
    """Return the closings with a mount; ``on_plane``: in each pass the rows that lie on the plane."""
    first, second = (
        plane_through(all_rows[PLANE, number].in_level(mount), chosen, all_rows[PLANE, number].position_m.mean(axis=0))
        for number, chosen in zip(PASSES, on_plane, strict=True)
    )
    spheres = {}
    for name in SPHERES:
        one, other = (sphere_through(all_rows[name, number].in_level(mount), RADIUS_M) for number in PASSES)
        spheres[name] = one, other
    return Closings((first, second), spheres, all_rows[PLANE, PASSES[0]].track)


@dataclass(frozen=True)
class Explanation:
    """The closings c (7,), their design J (7, 6) by the mount, rad and m, body axes, and the covariance Q (7, 7)."""

    closings: Array
    design: Array
    covariance: Array

    def squares(self, group: Sequence[int]) -> float:
        """Return cᵀ Q⁻¹ c of some of the closings."""
        places = list(group)
        c = self.closings[places]
        return float(c @ np.linalg.solve(self.covariance[np.ix_(places, places)], c))

    @property
    def up_by_roll_m(self) -> float:
        """Return how far 0.1° of the mount's roll moves the closing of the spheres' heights, in the mean."""
        return float(np.radians(0.1) * self.design[list(GROUPS["up"]), ROLL].mean())


def explanation(
    all_rows: AllRows, on_plane: Sequence[NDArray[np.int64]], mount: Mounted, coarse: Array, drift: Array
) -> Explanation:
    """Return how far errors of the mount, of the laser's clock and of the INS explain the closings.

    Parameters
    ----------
    all_rows, on_plane
        The rows, and of each pass those that lie on the plane.
    mount, coarse
        The mount, and the covariance (6, 6) of its errors, rad and m, body axes.
    drift : (6,) array
        Standard deviations of the INS's position and attitude, level frame, m and rad.
    """

    def turned(step: Array) -> Array:
        R, lever_arm = exp_so3(step[:3]) @ mount.R_body_from_sensor, mount.lever_arm_body_m + step[3:]
        return closings_with(all_rows, on_plane, Mounted(R, lever_arm)).vector

    at = closings_with(all_rows, on_plane, mount)
    J = np.array([(turned(step) - turned(-step)) / (2 * STEP) for step in STEP * np.eye(6)]).T
    faster = {name: all_rows[name, 2].velocity_m_s - all_rows[name, 1].velocity_m_s for name in (PLANE, *SPHERES)}
    v = np.r_[at.planes[0].plane.normal @ faster[PLANE], *(at.track @ faster[name] for name in SPHERES)]
    Q = J @ coarse @ J.T + LATENCY_S**2 * np.outer(v, v) + _of_fits_and_ins(all_rows, at, drift)
    return Explanation(at.vector, J, Q)


def _of_fits_and_ins(all_rows: AllRows, at: Closings, drift: Array) -> Array:
    """Return the covariance (7, 7) of the closings by the fits and the INS's poses."""

    def of_pose(name: str, number: int, place_m: Array) -> Array:
        arm = skew(place_m - all_rows[name, number].position_m.mean(axis=0))
        return np.asarray(np.diag(drift[:3] ** 2) + arm @ np.diag(drift[3:] ** 2) @ arm.T)

    Q = np.zeros((1 + 3 * len(SPHERES),) * 2)
    for k, number in enumerate(PASSES):
        plane = at.planes[k].plane
        Q[0, 0] += plane.covariance[2, 2] + plane.normal @ of_pose(PLANE, number, plane.centroid_m) @ plane.normal
        for place, name in enumerate(SPHERES):
            part, sphere = slice(1 + 3 * place, 4 + 3 * place), at.spheres[name][k]
            covariance = sphere.covariance_m2 + of_pose(name, number, sphere.centre_m)
            Q[part, part] += at.track @ covariance @ at.track.T
    return Q
