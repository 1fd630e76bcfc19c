"""Total least squares planes from second moments [0051-0088]."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import DegenerateGeometryError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Moments:
    """Sums over points from which a plane follows; they add, so points are never kept.

    count; total (3,) = Σ x; products (3, 3) = Σ x xᵀ, in a frame whose origin is near the points (pool or target: with
    coordinates of metres the smallest eigenvalue keeps an absolute precision of 1e-14 m²).
    """

    count: int
    total: Array
    products: Array

    @classmethod
    def of(cls, points_m: Array) -> "Moments":
        return cls(len(points_m), points_m.sum(axis=0), points_m.T @ points_m)

    @classmethod
    def zero(cls) -> "Moments":
        return cls(0, np.zeros(3), np.zeros((3, 3)))

    def __add__(self, other: "Moments") -> "Moments":
        return Moments(self.count + other.count, self.total + other.total, self.products + other.products)


@dataclass(frozen=True)
class Plane:
    """``normal · x = distance_m``; the covariance is that of (turn of the normal along t1, along t2, distance at the
    centroid) in rad and m, for independent points of the RMS found."""

    normal: Array
    distance_m: float
    centroid_m: Array
    count: int
    rms_m: float
    eigenvalues_m2: Array
    tangents: Array
    covariance: Array


def fit_plane(moments: Moments, toward: Array) -> Plane:
    """Plane that minimises Σ (n · x - d)² with |n| = 1 [0061-0088].

    n is the eigenvector of the smallest eigenvalue λ0 of the centred scatter matrix, d = n · mean; the normal is turned
    so that n · toward > 0. First-order covariance (e.g. Kanatani 1996, ch. 10): turning n along the eigenvector t_k
    changes the residuals by t_k · (x - mean), so var = σ² / (count λ_k), and var of the distance at the centroid
    σ² / count, with σ² = count λ0 / (count - 3).

    Raises
    ------
    DegenerateGeometryError
        Fewer than four points, or points on a line (λ1 not greater than λ0 by rounding).
    """
    n = moments.count
    if n < 4:
        raise DegenerateGeometryError(f"a plane needs at least 4 points, not {n}")
    mean = moments.total / n
    scatter = moments.products / n - np.outer(mean, mean)
    values, vectors = np.linalg.eigh((scatter + scatter.T) / 2)
    values = np.maximum(values, 0.0)
    if values[1] <= 1e-12 or values[1] < 2 * values[0]:
        raise DegenerateGeometryError(
            f"{n} points do not span a plane (eigenvalues {values[0]:.3g}, {values[1]:.3g} m²)"
        )
    normal = vectors[:, 0] * (1.0 if vectors[:, 0] @ toward >= 0 else -1.0)
    tangents = _signed(vectors[:, [2, 1]].T)
    variance = values[0] * n / (n - 3)
    covariance = np.diag([variance / (n * values[2]), variance / (n * values[1]), variance / n])
    return Plane(normal, float(normal @ mean), mean, n, float(np.sqrt(values[0])), values, tangents, covariance)


def angle_between(one: Array, other: Array) -> float:
    """Angle between two unit vectors, rad, by the chord: exact where it is small.

    >>> round(angle_between(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])), 12) == round(np.pi / 2, 12)
    True
    """
    return float(2 * np.arcsin(min(float(np.linalg.norm(one - other)) / 2, 1.0)))


def _signed(rows: Array) -> Array:
    """Eigenvectors have no sign: make the largest component positive, so that tables are reproducible."""
    largest = np.take_along_axis(rows, np.argmax(np.abs(rows), axis=1)[:, None], axis=1)
    return np.where(largest < 0, -rows, rows)


def tangents_of(normal: Array) -> Array:
    """Two unit vectors (2, 3) that span the plane with this normal, right-handed: t1 x t2 = normal."""
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(helper, normal)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])
