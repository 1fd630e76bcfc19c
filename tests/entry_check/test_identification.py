"""Soundings found again: by their order, by their places, with depths, not at all."""

import numpy as np
import pytest

from pipeline.entry_check.fingerprints import FilePoints
from pipeline.entry_check.hypotheses import starts
from pipeline.entry_check.identification import identify
from tests.support.entered import ANGLES, LEVER, SOURCE, Boat, rotation

STARTS = starts(SOURCE)
BOAT = Boat()
ODD = rotation({"roll": -31.7, "pitch": 14.0, "yaw": 25.0})  # no mistake that the catalogue knows
ODD_LEVER = np.array([1.7, -2.2, 0.4])


def file_of(points: np.ndarray, decimals: int = 3) -> FilePoints:
    return FilePoints(np.round(points, decimals), np.arange(len(points)), 0.5 * 10.0**-decimals)


def found(
    points: np.ndarray, rows: np.ndarray | None = None, sign: float = 1.0, lift: float = 0.0
) -> tuple[float, str]:
    """Share of the soundings in the file that were paired with their own row, and how."""
    rows = np.arange(len(points)) if rows is None else rows
    written = (points[rows] + [0, 0, lift]) * [1, 1, sign]
    pairs = identify(BOAT.soundings, file_of(written), STARTS)
    assert pairs is not None
    assert pairs.negated == (sign < 0)
    own = {tuple(x): k for k, x in enumerate(BOAT.x_mbes)}
    number = np.array([own[tuple(x)] for x in pairs.soundings.points_mbes_m])
    good = np.linalg.norm((points[number] + [0, 0, lift]) - pairs.points_pool_m, axis=1) < 0.002
    return float(good.sum() / len(rows)), pairs.how


@pytest.mark.parametrize(("sign", "lift"), [(1.0, 0.0), (1.0, -8.3), (-1.0, 12.0)])
def test_by_their_order_whatever_the_mount_and_the_heights(sign: float, lift: float) -> None:
    share, how = found(BOAT.placed(ODD, ODD_LEVER), sign=sign, lift=lift)
    assert share > 0.98
    assert how == "order"


def test_every_third_beam_is_found_by_order() -> None:
    share, how = found(BOAT.placed(ODD, ODD_LEVER), np.arange(0, len(BOAT.x_mbes), 3))
    assert share > 0.98
    assert how == "order"


def test_shuffled_ones_are_found_by_their_places() -> None:
    mistake = rotation(ANGLES | {"yaw": 2.0, "roll": 48.8})
    rows = np.random.default_rng(3).permutation(len(BOAT.x_mbes))[:900]
    share, how = found(BOAT.placed(mistake, LEVER), rows)
    assert share > 0.95
    assert how == "places"


@pytest.mark.parametrize("kind", ["another session", "grid"])
def test_another_session_or_a_grid_is_not_found(kind: str) -> None:
    points = (Boat(speed_m_s=1.3, seed=2) if kind == "another session" else BOAT).placed(rotation(ANGLES), LEVER)
    if kind == "grid":
        points = np.unique(np.round(points / 0.25), axis=0) * 0.25
    assert identify(BOAT.soundings, file_of(points), STARTS) is None


def test_pings_that_no_mount_explains_are_not_found() -> None:
    """Each ping has the right distances between its beams, in the right order, but stands somewhere by itself."""
    points, ping = BOAT.placed(ODD, ODD_LEVER), BOAT.soundings.ping
    random = np.random.default_rng(8)
    for one in np.unique(ping):
        points[ping == one] = points[ping == one] @ rotation(
            dict(zip(ANGLES, random.uniform(-30, 30, 3), strict=True))
        ) + random.normal(0, 3, 3)
    assert identify(BOAT.soundings, file_of(points), STARTS) is None


@pytest.mark.parametrize(("moved_m", "is_even"), [(0.0, True), (0.7, False)])
def test_a_pass_that_stands_elsewhere_is_missed_among_shuffled_soundings(moved_m: float, is_even: bool) -> None:
    boat = Boat((0.0, 0.0, 0.0, 0.0))
    points = boat.placed(rotation(ANGLES), LEVER)
    points[len(points) // 4 : len(points) // 2] += moved_m
    some = np.random.default_rng(3).permutation(len(points))[:4000]
    pairs = identify(boat.soundings, file_of(points[some]), STARTS)
    assert pairs is not None
    assert pairs.how == "places"
    assert (pairs.evenness > 0.7) == is_even
    assert is_even or pairs.evenness < 0.2
