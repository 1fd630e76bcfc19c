"""The share of a survey's uncertainty that the mount takes, against formulas for one error and a dense search."""

import numpy as np
import pytest

from pipeline.maths.survey.mount_limits import largest_share, sigmas_alone
from pipeline.maths.survey.sounding_uncertainty import SPECIAL, Order

ORDER_2 = Order("Order 2", 1.0, 0.023, 20.0, 0.10)  # S-44, edition 6, table 1
LINE, PLANE = 1.959964, 2.447747  # 95 % of a normal error, and of two equal ones, in sigmas


def alone(place: int, sigma: float) -> np.ndarray:
    covariance = np.zeros((6, 6))
    covariance[place, place] = sigma**2
    return covariance


@pytest.mark.parametrize("order", [SPECIAL, ORDER_2])
def test_each_error_alone_takes_most_where_geometry_says(order: Order) -> None:
    """Roll tilts the outer beams, most in deep water; z counts most where TVU is least; pitch, yaw move soundings."""
    depth, swath = 30.0, 65.0
    tvu = np.sqrt(order.a_m**2 + (order.b * depth) ** 2)
    thu = order.horizontal_m + order.horizontal_by_depth * depth
    out = depth * np.tan(np.radians(swath))
    by_hand = [
        (0, PLANE * depth / thu, "the plane", depth),
        (1, LINE * out / tvu, "height", depth),
        (2, PLANE * out / thu, "the plane", depth),
        (3, PLANE / order.horizontal_m, "the plane", 0.0),
        (4, PLANE / order.horizontal_m, "the plane", 0.0),
        (5, LINE / order.a_m, "height", 0.0),
    ]
    limits = sigmas_alone(order, depth, swath, 0.3)
    for place, share, direction, where in by_hand:
        found = largest_share(alone(place, 1e-3), order, depth, swath)
        assert (found.direction, found.depth_m) == (direction, where)
        assert found.share == pytest.approx(1e-3 * share, rel=1e-6)
        assert found.by_mount_m / found.allowed_m == pytest.approx(found.share, rel=1e-12)
        assert limits[place] == pytest.approx(0.3 / share, rel=1e-6)


@pytest.mark.parametrize("correlation", [0.9, -0.9, -0.99])
def test_correlated_errors_take_most_at_some_depth_between(correlation: float) -> None:
    """Roll (out to one side) and z: against a search of all depths and angles with its own formula."""
    covariance = np.zeros((6, 6))
    roll, z = 2e-3, 0.06
    covariance[1, 1], covariance[5, 5] = roll**2, z**2
    covariance[1, 5] = covariance[5, 1] = correlation * roll * z
    depths, angles = np.meshgrid(np.linspace(0, 20, 2001), np.radians(np.linspace(-60, 60, 241)))
    out = depths * np.tan(angles)
    variance = (roll * out) ** 2 + z**2 - 2 * out * covariance[1, 5]
    vertical = LINE * np.sqrt(variance) / np.sqrt(0.25**2 + (0.0075 * depths) ** 2)
    assert largest_share(covariance, SPECIAL, 20.0, 60.0).share == pytest.approx(vertical.max(), rel=2e-3)
