"""Pieces of the bottom among made-up soundings: which serve, and why others do not, on either side of each limit."""

import numpy as np
import pytest

from pipeline.finding.bottom import MOST, SIDE_M, BottomPiece, bottom_pieces, serving

LEVEL_M = 0.3


def heard(
    low: tuple[float, float],
    count: int,
    *,
    slope: float = 0.0,
    noise_m: float = 0.01,
    seed: int = 1,
    rough_m: float = 0.0,
) -> np.ndarray:
    """Soundings (n, 3) all over one square: 4 m deep in its middle, rising along x; rough as a chequer-board."""
    draws = np.random.default_rng(seed)
    places = np.array(low) + SIDE_M * draws.random((count, 2))
    x = places[:, 0] - low[0] - SIDE_M / 2
    board = np.sign(np.sin(2 * np.pi * places[:, 0]) * np.sin(2 * np.pi * places[:, 1]))
    z = LEVEL_M - 4.0 + slope * x + rough_m * board + noise_m * draws.normal(size=count)
    return np.column_stack([places, z])


def one(points: np.ndarray, passes: np.ndarray) -> BottomPiece:
    (piece,) = bottom_pieces(points, passes.astype(np.int16), LEVEL_M)
    return piece


def halves(count: int) -> np.ndarray:
    return np.arange(count) % 2


@pytest.mark.parametrize("slope", [0.0, 0.5, -1.5])
def test_a_piece_that_two_passes_heard_lies_in_its_plane(slope: float) -> None:
    piece = one(heard((-6.0, 2.0), 4000, slope=slope), halves(4000))
    assert piece.refused == ""
    assert piece.passes == (0, 1)
    assert piece.slope_deg == pytest.approx(np.degrees(np.arctan(abs(slope))), abs=0.1)
    assert piece.depth_m == pytest.approx(4.0, abs=0.003)
    x, y, z = piece.corners_m.T
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((-5.9, -4.1, 2.1, 3.9))
    np.testing.assert_allclose(z, LEVEL_M - 4.0 + slope * (x + 5.0), atol=0.003)
    turn = np.cross(piece.corners_m[1] - piece.corners_m[0], piece.corners_m[2] - piece.corners_m[1])
    assert turn[2] > 0  # counter-clockwise from above


def test_outliers_do_not_lift_it() -> None:
    points = heard((0.0, 0.0), 4000)
    points[:200, 2] += np.linspace(0.2, 1.5, 200)
    piece = one(points, halves(4000))
    assert piece.refused == ""
    assert piece.corners_m[:, 2].mean() == pytest.approx(LEVEL_M - 4.0, abs=0.004)


@pytest.mark.parametrize(
    ("points", "second", "words"),
    [
        ({}, slice(0, 0), "heard in one pass"),
        ({}, slice(0, 290), "heard in one pass"),
        ({}, slice(0, 1200), ""),
        ({"slope": 1.9}, slice(1, None, 2), "steep, 62°"),
        ({"slope": 1.6}, slice(1, None, 2), ""),
        ({"rough_m": 0.013}, slice(1, None, 2), "uneven, 1"),
        ({"rough_m": 0.007}, slice(1, None, 2), ""),
        ({"noise_m": 0.05}, slice(1, None, 2), ""),
    ],
)
def test_why_a_piece_cannot_serve(points: dict[str, float], second: slice, words: str) -> None:
    passes = np.zeros(4000)
    passes[second] = 1
    found = one(heard((0.0, 0.0), 4000, **points), passes)
    assert found.refused.startswith(words) if words else found.refused == ""


@pytest.mark.parametrize(("apart_m", "refused"), [(0.055, ""), (0.065, "passes differ by 65 mm")])
def test_passes_must_agree_within_what_labels_allow(apart_m: float, refused: str) -> None:
    points, passes = heard((0.0, 0.0), 6000, noise_m=0.002), halves(6000)
    points[:, 2] += apart_m * passes
    assert one(points, passes).refused == refused


def test_half_a_square_is_not_enough() -> None:
    points = heard((0.0, 0.0), 4000)
    points = points[points[:, 0] < 1.0]
    assert one(points, halves(len(points))).refused == "heard in part"


def test_what_lies_near_the_surface_is_no_bottom() -> None:
    points = heard((0.0, 0.0), 4000)
    points[:, 2] += 3.6
    assert bottom_pieces(points, halves(4000).astype(np.int16), LEVEL_M) == []


def test_the_best_serve_and_are_numbered_along_the_wall() -> None:
    """The more passes, the sooner; then by y, then by x."""
    squares = [(2.0 * i, 2.0 * j) for i in range(6) for j in range(5)]
    points = np.concatenate([heard(low, 2000 + 10 * k, seed=k) for k, low in enumerate(squares)])
    passes = np.concatenate([np.arange(2000 + 10 * k) % (3 if k == 0 else 2) for k in range(30)])
    pieces = bottom_pieces(points, passes.astype(np.int16), LEVEL_M)
    used = serving(pieces)
    assert len(used) == MOST
    assert len(pieces[0].passes) == 3
    middles = [piece.corners_m[:, :2].mean(axis=0) for piece in used]
    assert [1.0, 1.0] in np.round(middles, 6).tolist()  # the one of three passes, though of the fewest soundings
    order = [(round(float(y), 3), float(x)) for x, y in middles]
    assert order == sorted(order)
