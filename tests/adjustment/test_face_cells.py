"""Cells of walls: a sounding lies in the one that its ray meets, whatever its range says; and those are left out."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pipeline.adjustment.face_cells import CELL_M, REACH, OutsideCells, codes_of, faces_of, places_of
from pipeline.maths.adjustment.observed_surface import ObservedSurface

NORMAL = np.array([-1.0, 0.0, 0.0])  # of walls at x = 0, seen from x < 0
STATE = cast(Any, SimpleNamespace(heads=("mbes",), surfaces=[ObservedSurface.at("wall", NORMAL, np.zeros(3))] * 2))
SONAR_M = np.array([-5.0, 0.0, -1.0])


class Model:
    """A model in which points in the target frame are those in the sensor's."""

    faces, height_of_face = SimpleNamespace(surface=np.array([0, 1, 0])), np.zeros(3)
    body = SimpleNamespace(
        trajectory=SimpleNamespace(track_of_point=lambda t_ns, lever_arm_m: np.tile(SONAR_M, (len(t_ns), 1))),
        lever_arm=lambda sensor, state: np.zeros(3),
    )

    def points_in_target(self, sensor: str, batch: dict[str, np.ndarray], state: Any) -> np.ndarray:
        return np.asarray(batch["place"])


def codes(place: list[list[float]], face: list[int]) -> np.ndarray:
    batch = {"place": np.array(place), "face": np.array(face), "t_ns": np.arange(len(face))}
    return codes_of(batch, cast(Any, Model()), "mbes", STATE)


@pytest.mark.parametrize("beyond", [-0.3, 0.2])
def test_a_sounding_lies_in_the_cell_that_its_ray_meets(beyond: float) -> None:
    """30 cm before the wall or 20 cm behind it, on a ray that goes down and to the side by more than a cell."""
    meets = np.array([0.0, 10.05 * CELL_M, -13.95 * CELL_M])
    off = SONAR_M + (meets - SONAR_M) * (5 + beyond) / 5
    first, second, plain = codes([meets.tolist(), off.tolist(), [0.0, *off[1:]]], [0, 0, 0])
    assert first == second
    assert plain != first  # straight back to the wall it would be another


def test_cells_are_told_apart_by_face_row_and_column() -> None:
    side = CELL_M
    places = [[0, 0.1 * side, 0.1 * side], [0, 0.9 * side, 0.9 * side]]
    others = [[0, 1.1 * side, 0.1 * side], [0, 0.1 * side, 1.1 * side], [0, -0.1 * side, 0.1 * side], places[0]]
    found = codes([*places, *others], [0, 0, 0, 0, 0, 2])
    assert found[0] == found[1]
    assert len(set(found.tolist())) == 5


def test_codes_say_face_column_and_row() -> None:
    """Columns of a wall that looks to -x count toward -y, its rows up; cells farther than 4 km away are the last."""
    places = [[0, -0.5, 0.5], [0, 0.5, 3.5], [0, -7.5, -2.5], [0, REACH + 5, -REACH - 5], [0, -REACH - 5, REACH + 5]]
    faces = [0, 2, 1, 1, 0]
    found = codes((CELL_M * np.array(places)).tolist(), faces)
    assert faces_of(found).tolist() == faces
    assert places_of(found).tolist() == [[0, 0], [-1, 3], [7, -3], [-REACH, -REACH], [REACH - 1, REACH - 1]]


def test_soundings_in_the_cells_are_left_out() -> None:
    batch = {
        "place": np.array([[0, 0.1, -0.9], [0, 0.4, -0.9], [0, 0.1, -0.9], [-0.1, 0.1 * 4.9 / 5, -1 + 0.1 * 4.9 / 5]]),
        "face": np.array([0, 0, 1, 0]),
        "t_ns": np.arange(4),
    }
    (cell,) = codes([[0, 0.1, -0.9]], [0])
    left = OutsideCells(cast(Any, Model()), STATE, "mbes", np.array([cell]))(batch)
    assert left["t_ns"].tolist() == [1, 2]
