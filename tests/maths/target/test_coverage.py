"""Coverage of a target's faces, against areas worked out by hand, on both sides of each limit."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import rotation_z
from pipeline.maths.target.coverage import Found, Hypothesis, Scan, dry_cells
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.maths.target.outlines import Outline, build_target
from pipeline.target.surface import ClosestSurface
from tests.support.targets import by_letters

Array = NDArray[np.float64]
LASER = np.array([-5.0, 0.0, 1.0])
HIGHER = np.array([0.0, 0.0, 0.5])
ROW_M2 = 0.2  # a row of cells on the wall: 2 m long, 0.1 m high


def upright(x: float, low: float, high: float, y: float = 1.0) -> list[tuple[float, float, float]]:
    return [(x, y, low), (x, -y, low), (x, -y, high), (x, y, high)]


def wall_model(*others: Outline) -> TargetModel:
    """A wall 2 m long from -1 m to 2 m: 19 rows of cells stand above 0.1 m, 3.8 m²."""
    return build_target([Outline("wall", upright(0.0, -1.0, 2.0)), *others], [], 0.0, None)


@pytest.fixture(scope="module")
def wall() -> TargetModel:
    return wall_model()


def placed(model: TargetModel, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Hypothesis:
    return Hypothesis(model, TargetFrame(np.eye(3), np.array(origin)), ClosestSurface(model))


def scan(points: Array, toward: Array, origin: Array = LASER) -> Scan:
    """These points, and rays from the origin toward those."""
    rays = toward - origin
    return Scan(points, np.tile(origin, (len(rays), 1)), rays / np.linalg.norm(rays, axis=1)[:, None])


def centres(model: TargetModel) -> Array:
    return dry_cells(model).centres_m


NOWHERE = np.empty((0, 3))
FAR = np.array([[50.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("name", "area", "within"),
    [("P2", 24.0, 1e-9), ("P1-0", 0.5 * np.sqrt(2), 1e-9), ("P3-2", 0.5 * np.sqrt(2), 1e-9), ("P1-0-top", 0.5, 0.06)],
)
def test_cells_fill_their_face(name: str, area: float, within: float) -> None:
    face = next(face for face in by_letters(8.0, 3.0, 1.0, 0.5).faces if face.name == name)
    points, area_m2 = face.cells(0.1)
    assert len(points) * area_m2 == pytest.approx(area, abs=within)
    np.testing.assert_allclose(points @ face.normal, face.distance_m, atol=1e-12)
    assert face.clearance(points).min() >= 0
    assert len(np.unique(points.round(6), axis=0)) == len(points)


def test_cells_stand_above_the_water_on_upright_faces_that_the_laser_may_see() -> None:
    wet = Outline("wet", upright(-1.0, -1.0, 1.0), seen="wet")
    level = Outline("level", [(0.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (-1.0, -1.0, 1.0), (0.0, -1.0, 1.0)])
    cells = dry_cells(wall_model(wet, level))
    assert cells.areas_m2.sum() == pytest.approx(19 * ROW_M2)
    assert cells.centres_m[:, 2].min() == pytest.approx(0.15)
    assert dry_cells(build_target([Outline("sunk", upright(0.0, -3.0, -1.0))], [], 0.0, None)).areas_m2.size == 0


def test_a_surface_counts_once_however_many_layers_of_points_lie_on_it(wall: TargetModel) -> None:
    once, off = centres(wall), np.array([0.02, 0.0, 0.0])
    twice = np.concatenate([once + off, once - off])
    for points in (once, twice):
        assert Found(placed(wall), scan(points, NOWHERE)).agreement_m2 == pytest.approx(19 * ROW_M2)


@pytest.mark.parametrize(("off_m", "rows"), [(0.059, 19), (0.061, 0)])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_point_lies_on_a_face_within_six_centimetres(wall: TargetModel, off_m: float, rows: int, side: int) -> None:
    points = centres(wall) + np.array([side * off_m, 0.0, 0.0])
    assert Found(placed(wall), scan(points, NOWHERE)).agreement_m2 == pytest.approx(rows * ROW_M2)


@pytest.mark.parametrize(("aside_m", "seen"), [(0.099, True), (0.101, False)])
def test_a_cell_is_seen_by_a_point_near_its_centre(wall: TargetModel, aside_m: float, seen: bool) -> None:
    """The foot counts: the point itself lies 5 cm before the wall."""
    cells = dry_cells(wall)
    at = cells.centres_m[200]
    one = cells.of(np.arange(len(cells.areas_m2)) == 200)
    found = placed(wall).agreement_m2(one, scan(at + np.array([[-0.05, 0.6 * aside_m, 0.8 * aside_m]]), NOWHERE))
    assert found.tolist() == pytest.approx([0.01 if seen else 0.0])


@pytest.mark.parametrize(("rays", "rows"), [(0, 0), (1, 0), (2, -19)])
def test_a_cell_without_points_is_missed_if_two_rays_meet_it(wall: TargetModel, rays: int, rows: int) -> None:
    toward = np.tile(centres(wall), (rays, 1))
    assert Found(placed(wall), scan(FAR, toward)).agreement_m2 == pytest.approx(rows * ROW_M2)


@pytest.mark.parametrize(("grazing_deg", "missed"), [(14.0, False), (16.0, True)])
def test_flat_rays_need_not_come_back(wall: TargetModel, grazing_deg: float, missed: bool) -> None:
    angle = np.radians(grazing_deg)
    at = np.array([[0.0, 0.05, 1.05]])
    origin = at[0] - 4 * np.array([np.sin(angle), np.cos(angle), 0.0])
    found = Found(placed(wall), scan(FAR, np.tile(at, (2, 1)), origin)).agreement_m2
    assert found == pytest.approx(-0.01 if missed else 0.0)


def test_what_a_face_hides_need_not_be_seen() -> None:
    """And rays from behind a face do not meet it."""
    model = wall_model(Outline("screen", upright(-0.5, -1.0, 2.0)))
    hidden = dry_cells(model).centres_m[:, 0] > -0.1
    found = placed(model).agreement_m2(dry_cells(model), scan(FAR, np.tile(centres(wall_model()), (3, 1))))
    assert found[hidden].tolist() == [0.0] * hidden.sum()
    assert found[~hidden].sum() < -1.0
    behind = scan(FAR, np.tile(centres(wall_model()), (2, 1)), np.array([5.0, 0.0, 1.0]))
    assert Found(placed(wall_model()), behind).agreement_m2 == 0.0


@pytest.mark.parametrize(("apart_m", "strip_m2"), [(0.099, 0.0), (0.101, 3.8)])
def test_hypotheses_are_compared_where_they_are_apart(wall: TargetModel, apart_m: float, strip_m2: float) -> None:
    """What was seen counts for the one, what was missed against the other: both alike."""
    rival = placed(wall, (-apart_m, 0.0, 0.0))
    points = centres(wall)
    for rays, share in ((0, 1.0), (2, 2.0)):
        compared = Found(placed(wall), scan(points, np.tile(points - [apart_m, 0, 0], (rays, 1)))).over(rival)
        assert compared.margin_m2 == pytest.approx(share * strip_m2)
        assert compared.strip_m2 == pytest.approx(strip_m2)


def test_higher_and_lower_rivals(wall: TargetModel) -> None:
    """Half a metre higher, the rival has the rows from 2.15 m on for itself, and the lowest three lie under its water.
    Half a metre lower, it lacks those from 1.65 m on. What it has below the water of the pose found does not count."""
    points, above = centres(wall), centres(wall) + HIGHER
    found = Found(placed(wall), scan(points, NOWHERE))
    assert found.over(placed(wall, (0.0, 0.0, 0.5))).margin_m2 == pytest.approx(3 * ROW_M2)
    assert found.over(placed(wall, (0.0, 0.0, -0.5))).margin_m2 == pytest.approx(4 * ROW_M2)
    looked = Found(placed(wall), scan(points, np.tile(above, (2, 1))))
    assert looked.over(placed(wall, (0.0, 0.0, 0.5))).margin_m2 == pytest.approx((3 + 4) * ROW_M2)
    assert looked.over(placed(wall, (0.0, 0.0, -0.5))).margin_m2 == pytest.approx(4 * ROW_M2)


def test_the_better_of_two_is_ahead_whichever_is_asked(wall: TargetModel) -> None:
    truth, wrong = placed(wall), placed(wall, (-0.5, 0.0, 0.0))
    seen = scan(centres(wall), np.tile(centres(wall) - [0.5, 0, 0], (2, 1)))
    ahead = Found(truth, seen).over(wrong).margin_m2
    assert ahead == pytest.approx(2 * 3.8)
    assert Found(wrong, seen).over(truth).margin_m2 == pytest.approx(-ahead)


def turned(about_rad: float, origin: tuple[float, float, float]) -> Callable[[Array], Array]:
    R = rotation_z(about_rad)
    return lambda points: points @ R + np.array(origin)


def test_a_turned_pool_changes_nothing(wall: TargetModel) -> None:
    into_pool = turned(np.radians(163.0), (0.3, -0.3, 0.15))
    points, rays = centres(wall), np.tile(centres(wall) + HIGHER, (2, 1))
    frame = TargetFrame(rotation_z(np.radians(163.0)), np.array([0.3, -0.3, 0.15]))
    higher = TargetFrame(frame.R_target_from_pool, frame.origin_pool_m + HIGHER)
    np.testing.assert_allclose(frame.points_to_pool(points), into_pool(points), atol=1e-12)
    np.testing.assert_allclose(frame.points_from_pool(frame.points_to_pool(points)), points, atol=1e-12)
    surface = ClosestSurface(wall)
    seen = scan(into_pool(points), into_pool(rays), into_pool(LASER[None])[0])
    found = Found(Hypothesis(wall, frame, surface), seen)
    assert found.agreement_m2 == pytest.approx(3.8)
    assert found.over(Hypothesis(wall, higher, surface)).margin_m2 == pytest.approx(7 * ROW_M2)
