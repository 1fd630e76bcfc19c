"""Planes from second moments, with errors in all three coordinates (patent CN 105425246 B, [0051-0088])."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import DegenerateGeometryError

Array = NDArray[np.float64]
ACROSS = 1e-3  # variance added to the points' errors in every direction, as a share of the errors' total variance
NEARLY_LEVEL = 0.9  # |n_z| of a plane at 26° to the horizontal, from which on its tangents follow from y, not z


@dataclass(frozen=True)
class PlaneMoments:
    """Sums over points from which a plane follows. Sums of several batches add up, so no points are kept.

    Parameters
    ----------
    count
        Number of points.
    total
        Σ x (3,).
    products
        Σ x xᵀ (3, 3), in a frame whose origin is near the points (pool or target: with coordinates of metres the
        smallest eigenvalue keeps an absolute precision of 1e-14 m²).
    noise
        Σ cov(x) (3, 3) up to a factor: the directions of the points' errors.
    """

    count: int
    total: Array
    products: Array
    noise: Array

    @classmethod
    def of(cls, points_m: Array) -> "PlaneMoments":
        """Return the moments of points (n, 3) m with equal errors in all directions."""
        return cls(len(points_m), points_m.sum(axis=0), points_m.T @ points_m, len(points_m) * np.eye(3))

    def with_equal_errors(self) -> "PlaneMoments":
        """Return the moments with equal errors in all directions: the plane is then the plain total least squares."""
        return PlaneMoments(self.count, self.total, self.products, self.count * np.eye(3))

    @classmethod
    def zero(cls) -> "PlaneMoments":
        """Return the moments of no points."""
        return cls(0, np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)))

    def __add__(self, other: "PlaneMoments") -> "PlaneMoments":
        return PlaneMoments(
            self.count + other.count,
            self.total + other.total,
            self.products + other.products,
            self.noise + other.noise,
        )


@dataclass(frozen=True)
class Plane:
    """The plane ``normal · x = distance_m``, fitted to points.

    The tangents (2, 3) are t1, the direction of the widest spread, and t2. The eigenvalues (3,) are the variances of
    the points along the normal, t2 and t1. The covariance (3, 3) is that of (turn of the normal along t1, along t2,
    distance at the centroid) in rad and m, for independent points with the RMS of their residuals.
    """

    normal: Array
    distance_m: float
    centroid_m: Array
    count: int
    rms_m: float
    eigenvalues_m2: Array
    tangents: Array
    covariance: Array


def fit_plane(moments: PlaneMoments, toward: Array) -> Plane:
    """Fit the plane that minimises nᵀ S n / nᵀ N n [0061-0088].

    This is the mean square of n · x - d, divided by its expectation from the errors of the points. S is the centred
    scatter matrix of the points and d = n · mean. A point x = x0 + e of the plane n · x0 = d with an error of
    covariance s C gives E[S] = S0 + s N, where N is the mean of C and S0 n = 0: the eigenvector n of S n = λ N n with
    the smallest λ is the plane's normal in expectation, and λ = s. With equal errors in all directions, N ∝ 1, this is
    the patent's total least squares. With errors along oblique rays the total least squares is biased: for each tangent
    t of the plane, with the eigenvalue λ_t of S, it turns the normal towards t by -s n · N t / λ_t (hundredths of a
    degree for slanted faces in a pass). The code scales N to the trace 1, and adds ACROSS to its diagonal, so that N is
    definite.

    The normal points so that n · toward >= 0. The tangents t_k are the eigenvectors of S within the face, with the
    eigenvalues λ_k. First-order covariance (e.g. Kanatani 1996, ch. 10): a turn of n along t_k changes the residuals by
    t_k · (x - mean), so the turn has the variance σ² / (count λ_k), and the distance at the centroid has σ² / count,
    with σ² = count nᵀ S n / (count - 3).

    Parameters
    ----------
    moments
        Moments of the points.
    toward
        Vector (3,) on whose side of the plane the normal is to point.

    Raises
    ------
    DegenerateGeometryError
        Fewer than four points, or points near a line: the smaller λ_k is below 1e-12 m² or below 2 nᵀ S n.
    """
    n = moments.count
    if n < 4:
        raise DegenerateGeometryError(f"a plane needs at least 4 points, not {n}")
    mean = moments.total / n
    scatter = moments.products / n - np.outer(mean, mean)
    whitening = np.linalg.inv(np.linalg.cholesky(moments.noise / np.trace(moments.noise) + ACROSS * np.eye(3)))
    normal = whitening.T @ np.linalg.eigh(whitening @ scatter @ whitening.T)[1][:, 0]
    normal *= (1.0 if normal @ toward >= 0 else -1.0) / np.linalg.norm(normal)
    in_face = tangents_of(normal)
    (less, more), vectors = np.linalg.eigh(in_face @ scatter @ in_face.T)
    square = max(float(normal @ scatter @ normal), 0.0)
    if less <= 1e-12 or less < 2 * square:
        raise DegenerateGeometryError(f"{n} points do not span a plane (eigenvalues {square:.3g}, {less:.3g} m²)")
    tangents = _signed((in_face.T @ vectors[:, ::-1]).T)
    variance = square * n / (n - 3)
    covariance = np.diag([variance / (n * more), variance / (n * less), variance / n])
    values = np.array([square, less, more])
    return Plane(
        normal=normal,
        distance_m=float(normal @ mean),
        centroid_m=mean,
        count=n,
        rms_m=float(np.sqrt(square)),
        eigenvalues_m2=values,
        tangents=tangents,
        covariance=covariance,
    )


def angle_between(first: Array, second: Array) -> float:
    """Return the angle (rad) between two unit vectors (3,), from their chord, which is exact for small angles.

    >>> round(angle_between(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])), 12) == round(np.pi / 2, 12)
    True
    """
    return float(2 * np.arcsin(min(float(np.linalg.norm(first - second)) / 2, 1.0)))


def _signed(rows: Array) -> Array:
    """Return eigenvectors (k, 3), each with its largest component positive, so that tables are reproducible."""
    largest = np.take_along_axis(rows, np.argmax(np.abs(rows), axis=1)[:, None], axis=1)
    return np.where(largest < 0, -rows, rows)


def tangents_of(normal: Array) -> Array:
    """Return two unit vectors (2, 3) that span the plane with this normal, right-handed: t1 x t2 = normal.

    The first is horizontal, or for a plane within 26° of the horizontal at right angles to y. Almost equal normals so
    have almost equal tangents: a turn about them means the same in two sessions at one target.
    """
    helper = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < NEARLY_LEVEL else np.array([0.0, 1.0, 0.0])
    first = _cross(helper, normal)
    first /= np.linalg.norm(first)
    return np.stack([first, _cross(normal, first)])


def _cross(a: Array, b: Array) -> Array:
    """Return a x b of two vectors (3,), for which numpy's own takes six times as long."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
