"""What is known of surfaces before any point: against misclosures written anew, and their differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pseudo_observations import DesignPrior, ParallelPrior, displacement

RANDOM = np.random.default_rng(5)
PLANES = {
    "a": (np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.3, 1.0])),
    "b": (np.array([-0.6, 0.8, 0.0]), np.array([0.5, 2.0, 1.5])),
    "c": (np.array([0.0, 0.0, 1.0]), np.array([0.4, -1.0, 2.0])),
    "d": (np.array([-0.6, -0.8, 0.0]), np.array([0.5, -2.0, 0.5])),
}


def state(turn: float = 0.002, shift: float = 0.004) -> State:
    surfaces = []
    for name, (n, q) in PLANES.items():
        normal = Rotation.from_rotvec(turn * RANDOM.standard_normal(3)).apply(n)
        centre = q + 0.3 * RANDOM.standard_normal(3)
        centre -= normal * (normal @ (centre - q))
        surfaces.append(ObservedSurface.at(name, normal, centre, shift * RANDOM.standard_normal()))
    return State.at(np.eye(3), np.zeros(3), surfaces, "laser")


def least(at: State, design: DesignPrior) -> float:
    """The smallest sum of squares over all displacements of the design, by brute least squares."""
    rows, right = [], []
    for surface in at.surfaces:
        n0, q = design.planes[surface.family]
        n, c = surface.normal, surface.centre_m
        for t in surface.tangents:
            rows.append(np.r_[np.zeros(3), -np.cross(n0, t)] / design.turn_rad)
            right.append(t @ (n - n0) / design.turn_rad)
        rows.append(np.r_[n, np.cross(q, n)] / design.shift_m)
        right.append((n @ (q - c) - surface.shift_m) / design.shift_m)
    for k, sigma in enumerate(design.set_up_sigma):
        if np.isfinite(sigma):
            rows.append(np.eye(6)[k] / sigma)
            right.append(-design.set_up[k] / sigma)
    A, r = np.array(rows), np.array(right)
    g = np.linalg.lstsq(A, -r, rcond=None)[0]
    return float(np.sum((A @ g + r) ** 2))


@pytest.mark.parametrize("surveyed", [False, True])
def test_the_design_is_what_least_squares_over_its_displacement_leave(surveyed: bool) -> None:
    sigma = np.array([0.01, 0.01, 0.02, 3e-4, 3e-4, 1e-3])
    sigma = sigma if surveyed else np.where(sigma == 3e-4, sigma, np.inf)  # plumb is known
    design = DesignPrior(PLANES, 4e-4, 0.002, np.array([0.01, -0.02, 0.005, 0.0, 0.0, 0.001]), sigma)
    at = state()
    known = design.pseudo_observations(at)
    assert known.squares == pytest.approx(least(at, design), rel=1e-9)
    step = np.zeros(at.size)
    place = np.arange(at.size)[at.surface_slice]
    for k in place:
        step[k] = 1e-6
        up, down = least(at.updated(step), design), least(at.updated(-step), design)
        slope = (up - down) / 2e-6
        assert 2 * known.right[k] == pytest.approx(slope, rel=2e-3, abs=0.05 * np.sqrt(known.normal[k, k]))
        curvature = (up + down - 2 * known.squares) / 1e-12
        assert 2 * known.normal[k, k] == pytest.approx(curvature, rel=0.02, abs=1e-6 / design.turn_rad**2)
        step[k] = 0.0
    assert not known.normal[:8].any()  # of the laser's own unknowns it says nothing


def test_the_displacement_of_surfaces_is_found_and_leaves_open_directions_alone() -> None:
    shift, turn = np.array([0.03, -0.02, 0.05]), np.array([2e-4, -1e-4, 3e-4])
    rotation = Rotation.from_rotvec(turn)
    moved = [ObservedSurface.at(name, rotation.apply(n), rotation.apply(q) + shift) for name, (n, q) in PLANES.items()]
    np.testing.assert_allclose(displacement(moved, PLANES), np.r_[shift, turn], atol=1e-6)  # first order in the turn
    vertical = [ObservedSurface.at(name, n, q + shift) for name, (n, q) in PLANES.items() if name != "c"]
    np.testing.assert_allclose(displacement(vertical, PLANES), np.r_[shift[:2], np.zeros(4)], atol=1e-9)


def test_walls_that_hardly_lean_tell_no_height() -> None:
    """A batter of 6° does."""
    leaning = {}
    for name, lean in (("a", 2e-4), ("b", -1e-4), ("d", 3e-4)):
        n, q = PLANES[name]
        leaning[name] = (n * np.cos(lean) + np.array([0.0, 0.0, np.sin(lean)]), q)
    off = [ObservedSurface.at(name, n, q + 0.002 * np.array([1.0, 1.0, 0.0])) for name, (n, q) in leaning.items()]
    np.testing.assert_allclose(displacement(off, PLANES), [0.002, 0.002, 0, 0, 0, 0], atol=5e-4)
    batter = {name: (n * np.cos(0.1) + np.array([0.0, 0.0, np.sin(0.1)]), q) for name, (n, q) in leaning.items()}
    higher = [ObservedSurface.at(name, n, q + np.array([0.0, 0.0, 0.05])) for name, (n, q) in batter.items()]
    np.testing.assert_allclose(displacement(higher, batter), [0, 0, 0.05, 0, 0, 0], atol=1e-9)


def test_a_design_displaced_as_a_whole_is_no_misclosure() -> None:
    shift, turn = np.array([0.1, -0.2, 0.05]), Rotation.from_rotvec([0.0, 0.0, 1e-4])
    surfaces = [ObservedSurface.at(name, turn.apply(n), turn.apply(q) + shift) for name, (n, q) in PLANES.items()]
    at = State.at(np.eye(3), np.zeros(3), surfaces, "laser")
    free = np.array([np.inf] * 3 + [1e-4] * 2 + [np.inf])
    assert DesignPrior(PLANES, 4e-4, 0.002, np.zeros(6), free).pseudo_observations(at).squares < 1e-4
    fixed = np.array([0.01] * 3 + [1e-4] * 2 + [np.inf])
    expected = np.sum((shift / 0.01) ** 2)  # minus what the faces absorb
    design = DesignPrior(PLANES, 4e-4, 1e-5, np.zeros(6), fixed)
    assert design.pseudo_observations(at).squares == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_ties_draw_two_normals_together(sense: float) -> None:
    turned = Rotation.from_rotvec([0.0, 0.002, 0.001]).apply(PLANES["b"][0])
    first = ObservedSurface.at("b", PLANES["b"][0], PLANES["b"][1])
    surfaces = [first, ObservedSurface.at("e", sense * turned, np.ones(3))]
    at = State.at(np.eye(3), np.zeros(3), surfaces)
    known = ParallelPrior([("b", "e")], 1e-4).pseudo_observations(at)
    angle = np.linalg.norm(np.cross(turned, PLANES["b"][0]))
    assert known.squares == pytest.approx((angle / 1e-4) ** 2, rel=1e-3)
    step = -np.linalg.lstsq(known.normal, known.right, rcond=1e-9)[0]
    one, other = at.updated(step).surfaces
    assert np.linalg.norm(np.cross(one.normal, other.normal)) < 1e-5
