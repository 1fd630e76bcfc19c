"""The water's level in each pass, by readings and by the boat's own height."""

from typing import Any

import numpy as np
import pytest

from pipeline.config.quantities import Model
from pipeline.config.target import Target
from pipeline.config.yaml_models import parse
from pipeline.errors import RawDataError
from pipeline.georeference.pool_context import PoolContext
from pipeline.georeference.water_levels import water_levels
from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.maths.geometry.geodesy import PoolFrame
from pipeline.maths.geometry.trajectory import Trajectory

START_NS = int(gps_ns_from_unix_utc(np.array([1_778_302_800]), np.array([0]))[0])  # 2026-05-09T05:00:00Z
STARTS_S = np.array([100, 700, 1300])  # of passes of 100 s
FACE = {"wall": {"corners": [[0, 1, -4], [0, -1, -4], [0, -1, 2], [0, 1, 2]]}}


class Pool(Model):
    target: Target


def target(changes: Any, **more: Any) -> Target:
    place = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
    content = {"kind": "faces", "faces": FACE, "origin": place, "water_level_m": 0.5, "water_level_changes": changes}
    return parse(Pool, {"target": content | more}, "pool").target


def context() -> PoolContext:
    """A boat that rises by 0.1 mm a second, in waves of 4 s, of which a pass holds a whole number."""
    seconds = np.arange(0.0, 1500.0, 0.5)
    heights = 1.2 + 1e-4 * seconds + 0.05 * np.sin(2 * np.pi * seconds / 4.0)
    positions = np.column_stack([np.full(len(seconds), -5.0), seconds % 100, heights])
    t_ns = START_NS + np.rint(seconds * NS).astype(np.int64)
    return PoolContext(
        frame=PoolFrame.at(0.6, 2.1, 12.0, 0.0),
        trajectory=Trajectory.build(t_ns, positions, np.broadcast_to(np.eye(3), (len(seconds), 3, 3))),
        starts_ns=START_NS + STARTS_S * NS,
        ends_ns=START_NS + (STARTS_S + 100) * NS - 1,
        box_low_m=np.full(3, -10.0),
        box_high_m=np.full(3, 10.0),
    )


def test_without_changes_it_is_one_number():
    assert water_levels(target(None), context()).tolist() == [0.5, 0.5, 0.5]


def test_by_the_boats_height_it_changes_about_the_mean_of_the_passes():
    assert water_levels(target("ins"), context()) == pytest.approx([0.44, 0.5, 0.56], abs=1e-9)


def test_a_found_target_has_the_lowest_level():
    assert water_levels(target("ins", found=True), context()) == pytest.approx([0.5, 0.56, 0.62], abs=1e-9)


def test_readings_count_against_each_other_in_any_datum():
    """From 05:00 to 05:15 the staff rises by 0.9 m, and stays."""
    readings = [["2026-05-09T05:00:00Z", 340.0], ["2026-05-09T05:15:00Z", 340.9], ["2026-05-09T06:00:00Z", 340.9]]
    rises = np.array([0.15, 0.75, 0.9])  # at the middles of the passes
    assert water_levels(target(readings), context()) == pytest.approx(0.5 + rises - rises.mean(), abs=1e-3)


@pytest.mark.parametrize(("first", "last"), [("05:02:00", "06:00:00"), ("05:00:00", "05:23:00")])
def test_a_pass_that_the_readings_do_not_cover_is_refused(first: str, last: str):
    readings = [[f"2026-05-09T{first}Z", 0.0], [f"2026-05-09T{last}Z", 0.1]]
    with pytest.raises(RawDataError, match="do not cover the pass from 2026-05-09T05:"):
        water_levels(target(readings), context())
