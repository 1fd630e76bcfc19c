"""Passes with the target to port: predicted as mirrored ones, and what passing both ways gives at an uncertain wall."""

import copy
from typing import Any

import numpy as np
import pytest

from pipeline.config.plan import Plan
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.planning.assessment import assess_plan
from tests.support.docks import DOCK
from tests.support.effort import often
from tests.support.simulated import made

MOUNT = {"pitch_deg": 1.2, "yaw_deg": -2.0, "y_m": 0.20, "z_m": -2.01}
FIELD = {"point_rate_hz": 4000.0}


def sigmas(mount: dict[str, float], field_deg: tuple[float, float], *passes: dict[str, Any]) -> np.ndarray:
    """Total sigmas (6,), rad and m, at a dock whose wet faces may be off by 2 cm and 0.1°."""
    session = made(copy.deepcopy(DOCK), {"track": {"distances_m": [4.0]}}, seed=2)
    settings = copy.deepcopy(session.session)
    settings["mbes"]["mount"] = MOUNT | mount
    settings["laser"]["mount"] |= {"roll_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0}
    pool = session.pool | {"as_built": {"offset_sigma_m": 0.02, "angle_sigma_deg": 0.1}}
    plan = {
        "mbes": {"sector_deg": 150.0, "ping_rate_hz": 10.0},
        "laser": FIELD | {"field_deg": list(field_deg)},
        "passes": list(passes),
    }
    settings["mbes"]["beam_deg"] = [0.5, 1.0]
    configs = parse(PoolConfig, pool, "pool"), parse(SessionConfig, settings, "session")
    answer = assess_plan(parse(Plan, plan, "plan"), *configs)
    return np.sqrt(np.diag(answer.given.total))


def gaps(*names: str) -> list[str]:
    """Gaps in the geometry of two passes, if of the dock these walls alone are there."""
    return gaps_of({name: DOCK["target"]["faces"][name] for name in names})


def gaps_of(faces: dict[str, Any]) -> list[str]:
    """The same of any faces."""
    target = DOCK["target"] | {"faces": faces}
    session = made(DOCK | {"target": target}, {"track": {"distances_m": [4.0]}}, seed=2)
    plan = parse(Plan, {"laser": FIELD, "passes": [{"distance_m": 4.0}, {"distance_m": 7.0}]}, "plan")
    configs = parse(PoolConfig, session.pool, "pool"), parse(SessionConfig, session.session, "session")
    return assess_plan(plan, *configs).gaps


def test_of_one_wall_alone_it_is_told_where_to_go() -> None:
    assert gaps("wall")[0].startswith("both sensors see one wall alone: pitch, yaw and lever arm y rest on the boat's")
    assert not any("one wall alone" in gap for gap in gaps("wall", "north"))


@pytest.mark.parametrize(("lean_m", "told"), [(1.5, False), (2.5, True)])
def test_a_slope_beside_the_wall_tells_the_height(lean_m: float, told: bool) -> None:
    """By more than 17°: 6 m high, and its foot out by so much."""
    wall = DOCK["target"]["faces"]["wall"]
    slope = {"corners": [[-lean_m, 9, -4], [-lean_m, 3, -4], [0, 3, 2], [0, 9, 2]]}
    found = gaps_of({"wall": wall, "slope": slope})
    assert any("no horizontal face" in gap for gap in found) is not told


@pytest.mark.thorough
def test_a_mirrored_pass_is_as_good() -> None:
    """The dock is its own mirror image: so a boat that is mirrored, too, and sails back, learns the same."""
    near, far = {"distance_m": 4.0}, {"distance_m": 7.0}
    back = [one | {"course": "back"} for one in (near, far)]
    to_starboard = sigmas({"roll_deg": -48.8, "x_m": 0.3, "yaw_deg": 2.0}, (30.0, 130.0), near, far)
    to_port = sigmas({"roll_deg": 48.8, "x_m": -0.3}, (-130.0, -30.0), *back)
    np.testing.assert_allclose(to_port[:5] / to_starboard[:5], 1.0, atol=0.05)
    assert 0.75 < to_port[5] / to_starboard[5] < 1.33  # z rests on the waves alone, and these are not mirrored


@pytest.mark.parametrize("course", often(["along"], ["along", "back"]))
def test_both_ways_the_lean_of_the_wet_wall_hardly_counts(course: str) -> None:
    """One way 0.1° of wet against dry is most of 0.08° of roll; both ways it turns the roll this way and that."""
    wide = {"roll_deg": -1.8, "x_m": 0.3}, (-130.0, 130.0)
    near, far = {"distance_m": 4.0}, {"distance_m": 7.0}
    one_way = sigmas(*wide, near | {"course": course}, far | {"course": course})
    both_ways = sigmas(*wide, near, far, near | {"course": "back"}, far | {"course": "back"})
    assert np.degrees(one_way[1]) > 0.06  # roll
    assert np.degrees(both_ways[1]) < 0.02
    assert (both_ways[[0, 1, 3, 4]] < 0.5 * one_way[[0, 1, 3, 4]]).all()  # pitch, roll, x, y
