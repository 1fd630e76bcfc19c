"""A target found in the laser's points of a simulated session, held against the truth of the simulator."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config.pool import PoolConfig
from pipeline.config.yaml_models import parse
from pipeline.finding.found_text import table_rows, table_text
from pipeline.finding.place import FoundPlace
from pipeline.finding.pool_file import pool_yaml
from pipeline.finding.without_drift import MOST_RECORDS
from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.maths.target.model import TargetModel
from pipeline.results.pages.place_page import place_page
from pipeline.simulation.session import SimulatedSession
from pipeline.target.design import target_of
from tests.support.docks import DOCK
from tests.support.found_places import found
from tests.support.simulated import made

TRACK: dict[str, Any] = {"track": {"distances_m": [4.0, 7.0], "half_length_m": 6.0}}


def turned(azimuth_deg: float, water_level_m: float = 0.0) -> dict[str, Any]:
    return DOCK | TRACK | {"target": DOCK["target"] | {"azimuth_deg": azimuth_deg, "water_level_m": water_level_m}}


def planes_level(pool: PoolConfig) -> tuple[PoolFrame, TargetModel]:
    """The target's frame, and its model."""
    origin, azimuth = pool.target.origin, pool.target.azimuth_deg
    assert azimuth is not None
    place = np.radians([origin.latitude_deg, origin.longitude_deg])
    return PoolFrame.at(*place, origin.height_m, float(np.radians(azimuth))), target_of(pool.target)


@pytest.mark.parametrize(("azimuth_deg", "water_level_m"), [(20.0, 0.0), (183.0, -0.4)])
def test_a_dock_is_found_where_it_is(azimuth_deg: float, water_level_m: float) -> None:
    session = made(turned(azimuth_deg, water_level_m))
    place = found(session)
    assert [face.name for face in place.faces] == ["wall-1", "wall-2", "wall-3"]
    config = parse(PoolConfig, yaml.safe_load(pool_yaml(place)), "pool")
    frame, model = planes_level(config)
    true_frame, truth = planes_level(parse(PoolConfig, session.pool, "pool"))
    for mine, true in zip(model.faces, [truth.faces[1], truth.faces[0], truth.faces[2]], strict=True):
        corners = true_frame.points_from_ecef(frame.points_to_ecef(mine.vertices_m))
        assert np.abs(corners @ true.normal - true.distance_m).max() < 0.06  # with the INS's drift
        low, high = true.vertices_m.min(axis=0) - 0.1, true.vertices_m.max(axis=0) + 0.1
        assert np.all((corners[:, :2] > low[:2]) & (corners[:, :2] < high[:2])), mine.name
        assert 1.5 < corners[:, 2].max() < 2.0
        assert corners[:, 2].min() == pytest.approx(water_level_m - 4.0, abs=0.1)
    assert config.target.azimuth_deg == pytest.approx(azimuth_deg, abs=0.3)
    there = true_frame.points_from_ecef(frame.points_to_ecef(np.zeros((1, 3))))[0]
    assert abs(there[0]) < 0.05
    level = there[2] + config.target.water_level_m
    assert level == pytest.approx(water_level_m, abs=0.05)


def turns_deg(session: SimulatedSession, place: FoundPlace) -> list[float]:
    """The angle of each face that was found from the true one."""
    frame, model = planes_level(parse(PoolConfig, yaml.safe_load(pool_yaml(place)), "pool"))
    true_frame, truth = planes_level(parse(PoolConfig, session.pool, "pool"))
    angles = []
    for mine, true in zip(model.faces, [truth.faces[1], truth.faces[0], truth.faces[2]], strict=True):
        tip, foot = true_frame.points_from_ecef(frame.points_to_ecef(np.array([mine.normal, np.zeros(3)])))
        angles.append(float(np.degrees(np.arccos(np.clip((tip - foot) @ true.normal, -1.0, 1.0)))))
    return angles


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_corner_does_not_turn_the_planes_that_meet_there(seed: int) -> None:
    """Points of the next wall lie within 6 cm of a plane as far as 8 cm behind the corner: that made 0.4°."""
    session = made(turned(20.0), seed=seed)
    assert max(turns_deg(session, found(session))) < 0.04


DRIFT: dict[str, Any] = {
    "ins": {
        "drift": {"horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03}
        | {"time_constant_s": 200.0}
    }
}


@pytest.mark.parametrize(("seed", "records"), [(1, MOST_RECORDS), (2, MOST_RECORDS), (2, 1000)])
def test_the_drift_makes_no_wall_uneven(seed: int, records: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """records: most from which the drift is taken; of this session all, or a sixth."""
    session = made(turned(20.0), DRIFT, seed=seed)
    monkeypatch.setattr("pipeline.finding.without_drift.MOST_RECORDS", records)

    def uneven_m() -> float:
        place = found(session)
        assert len(place.faces) == 3
        assert max(turns_deg(session, place)) < 0.3  # a part of the drift is as if a wall were turned
        return max(face.plane.flat.uneven_m for face in place.faces)

    without = uneven_m()
    monkeypatch.setattr("pipeline.finding.find.track_without_drift", lambda points, *_: points.context.trajectory)
    assert without < 0.001
    assert 1.5 * without < uneven_m()


def test_the_screen_says_what_serves_and_why_the_rest_does_not() -> None:
    said = table_text(found(made(turned(20.0))))
    assert "3 faces of" in said
    assert "With 3 faces nobody can tell which is wrong" in said
    rows = {line.split()[0]: line.split() for line in said.splitlines() if line.lstrip().startswith("wall-")}
    assert [float(word) for word in rows["wall-2"][1:3]] == pytest.approx([110.0, 5.5], abs=2.0)  # +x, right of 20°
    assert float(rows["wall-1"][1]) > 110.0 > float(rows["wall-3"][1])  # wall-1 astern, wall-3 ahead
    assert "wall-2" in said


def test_what_stands_before_a_wall_is_kept_where_the_boat_sees_it() -> None:
    """A board of 5 cm, 0.8 to 1.5 m from the wall's end at y = 3. The boat passes toward +y, the wall to starboard:
    that end is the left one."""
    board = {"name": "board", "low_m": [-0.05, 1.5, 0.4], "high_m": [0.0, 2.2, 1.4]}
    session = made(turned(20.0), {"surroundings": {"back_wall": False, "boxes": [board]}})
    place = found(session)
    (wall,) = [face for face in place.faces if face.name == "wall-2"]
    along, height, off = wall.plane.sample_m.T
    before = (off > 0.03) & (height - place.level_m > 0.6) & (height - place.level_m < 1.2)
    assert before.sum() > 10
    assert 1.0 < np.median(along[before]) - along.min() < 1.2  # 1.15 from the end; the kept points begin inside it
    np.testing.assert_allclose(np.median(off[before]), 0.05, atol=0.005)
    assert np.median(np.abs(off[~before])) < 0.008


def test_the_page_names_each_face_and_says_why_others_do_not_serve() -> None:
    place = found(made(turned(20.0)))
    page = place_page(place, "harbour <wall>")
    assert page.startswith("<!doctype html>")
    four = replace(place, faces=(*place.faces, place.faces[0]))
    assert "nobody can tell" not in place_page(four, "harbour") + table_text(four)
    assert "harbour &lt;wall&gt;: <span>3 faces of" in page
    assert "With 3 faces nobody can tell which is wrong" in page
    assert page.count("<img") == 2
    for row in table_rows(place):
        assert all(f">{cell}</td>" in page for cell in row if cell)
    assert "strike: [wall-1]" in page
    assert "masks: { wall-1: [{along_m: [0.5, 1.0], height_m: [-1.0, 1.0]}] }" in page
    nothing = replace(place, faces=())
    assert place_page(nothing, "harbour").count("<img") == 1


@pytest.mark.parametrize(
    ("toward_m", "along_m", "hidden"), [(2.0, 0.0, "wall-2"), (0.1, 0.0, ""), (-2.0, 0.0, ""), (2.0, 20.0, "")]
)
def test_what_hides_a_wall_is_told_beside_it(toward_m: float, along_m: float, hidden: str) -> None:
    """A moored boat's side, as long as the wall, before it, in it, behind it, and past its end."""
    place = found(made(turned(20.0)))
    (wall,) = [face.plane for face in place.faces if face.name == "wall-2"]
    outline_m = 0.2 * (wall.outline_m - wall.middle_m) + wall.middle_m + [along_m, 0.0]
    side = replace(wall, refused="smaller than 1 m", distance_m=wall.distance_m + toward_m, outline_m=outline_m)
    *_, row = table_rows(replace(place, planes=(*place.planes, side)))
    assert row[-1] == f"refused: smaller than 1 m{f'; before {hidden}' if hidden else ''}"
