"""Places on ellipsoids, in ECEF and on transverse Mercator maps, by formulas of the tests' own."""

import numpy as np

A = 6_378_137.0
WGS84, GRS80 = 1 / 298.257223563, 1 / 298.257222101  # flattening; CGCS2000 has that of GRS 80 (GB 22021-2008)
BEIJING, SHANGHAI, MELBOURNE = (116.4, 39.9, 43.5), (121.4737, 31.2304, 4.5), (144.96, -37.81, 30.0)


def ecef_of(longitude_deg: float, latitude_deg: float, height_m: float, flattening: float) -> np.ndarray:
    """By way of the reduced latitude: tan(beta) = (1 - f) tan(phi); a (cos beta, (1 - f) sin beta) and h outward."""
    longitude, latitude = np.radians(longitude_deg), np.radians(latitude_deg)
    reduced = np.arctan((1 - flattening) * np.tan(latitude))
    across = A * np.cos(reduced) + height_m * np.cos(latitude)
    up = A * (1 - flattening) * np.sin(reduced) + height_m * np.sin(latitude)
    return np.array([across * np.cos(longitude), across * np.sin(longitude), up])


def gauss_krueger(place: tuple[float, float, float], flattening: float, meridian_deg: float) -> tuple[float, float]:
    """East of the central meridian and north of the equator, scale 1, by numbers alone: no series.

    The map is the analytic continuation of the meridian's arc over the isometric latitude (Gauss): m(q + i l).
    """
    latitude, away = np.radians(place[1]), np.radians(place[0] - meridian_deg)
    e = np.sqrt(flattening * (2 - flattening))
    target = np.arctanh(np.sin(latitude)) - e * np.arctanh(e * np.sin(latitude)) + 1j * away
    phi = complex(latitude)
    for _ in range(50):  # Newton: d(isometric) = (1 - e2) / ((1 - e2 sin2) cos) d(phi)
        found = np.arctanh(np.sin(phi)) - e * np.arctanh(e * np.sin(phi))
        phi += (target - found) * (1 - e**2 * np.sin(phi) ** 2) * np.cos(phi) / (1 - e**2)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    along = phi * (nodes + 1) / 2
    arc = phi / 2 * np.sum(weights * A * (1 - e**2) / (1 - e**2 * np.sin(along) ** 2) ** 1.5)
    return float(arc.imag), float(arc.real)
