"""Lifted second moments: one sum over the soundings, from which their planes with *any* mount follow.

A sounding lies in the target frame at

    X = p + T · (E · m + l),    p, T: pose of the body (T = R_target_from_body),
                                m = R_body_from_mbes(coarse) · x_mbes,  E = Exp(δ),  l = lever arm,

which is linear in θ = (vec E, l, 1) with 9 + 3 + 1 = 13 elements: X_a = f_a · θ with

    f_a = (T_a1 m1, T_a1 m2, T_a1 m3, T_a2 m1, …, T_a3 m3 | T_a1, T_a2, T_a3 | p_a),      vec E row by row.

So Σ X_a X_b = θᵀ (Σ f_a f_bᵀ) θ. The f_a of the three axes and a constant 1 are the 40 *features* of a sounding. With
the constant the sums contain Σ X_a and the count as well. One 40 x 40 matrix per pass and face is enough for all
mounts. An iteration over mounts then costs microseconds, and no sounding is read twice.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.planes import PlaneMoments

Array = NDArray[np.float64]
FEATURES = 13
SIZE = 3 * FEATURES + 1  # three axes, and the constant 1 for the sums


def lift(R_target_from_body: Array, positions_m: Array, points_body_m: Array) -> Array:
    """Return the features (n, 40) of soundings.

    Parameters
    ----------
    R_target_from_body, positions_m
        Poses (n, 3, 3) and (n, 3) m, target frame.
    points_body_m
        Points m = R_body_from_mbes x_mbes, (n, 3) m, with the coarse mount.
    """
    n = len(positions_m)
    features = np.empty((n, SIZE))
    for axis in range(3):
        block = features[:, axis * FEATURES : (axis + 1) * FEATURES]
        row = R_target_from_body[:, axis, :]
        block[:, :9] = (row[:, :, None] * points_body_m[:, None, :]).reshape(n, 9)
        block[:, 9:12] = row
        block[:, 12] = positions_m[:, axis]
    features[:, -1] = 1.0
    return features


def plane_moments(lifted: Array, correction: Array, lever_arm_m: Array) -> PlaneMoments:
    """Return the moments of the soundings, placed with the mount Exp(δ) · coarse and this lever arm.

    Their noise is Σ r rᵀ of the rays r = T E m. A beam that errs by an angle δ meets a face at incidence i too early or
    too late by r δ tan i. So its point errs along the recorded ray, as with noise of the range.

    Parameters
    ----------
    lifted
        Lifted moments (40, 40).
    correction
        Exp(δ) (3, 3).
    lever_arm_m
        Lever arm (3,), body axes.
    """
    place, rays = np.zeros((4, SIZE)), np.zeros((3, SIZE))
    for axis in range(3):
        place[axis, axis * FEATURES : (axis + 1) * FEATURES] = np.concatenate([correction.ravel(), lever_arm_m, [1.0]])
        rays[axis, axis * FEATURES : axis * FEATURES + 9] = correction.ravel()
    place[3, -1] = 1.0
    sums = place @ lifted @ place.T
    return PlaneMoments(round(float(sums[3, 3])), sums[:3, 3], sums[:3, :3], rays @ lifted @ rays.T)


def attitude_sum(lifted: Array) -> Array:
    """Return Σ R_target_from_body (3, 3) over the soundings, from the products of the features T_a and the constant."""
    return np.array([lifted[axis * FEATURES + 9 : axis * FEATURES + 12, -1] for axis in range(3)])


def by_family(
    family_of_face: Mapping[int, str], moments: Mapping[tuple[int, int], Array]
) -> dict[tuple[int, str], Array]:
    """Return the lifted moments of (pass, face) summed over the faces of each family: (pass, family) -> (40, 40)."""
    total: dict[tuple[int, str], Array] = {}
    for (number, face), lifted in moments.items():
        key = (number, family_of_face[face])
        total[key] = total[key] + lifted if key in total else lifted
    return total
