"""The water's level in each pass, by readings and by the boat's own height; what contradicts it."""

from typing import Any

import numpy as np
import pytest

from pipeline.artefacts.water_levels import contradiction, uncovered, water_levels
from pipeline.config.quantities import Model
from pipeline.config.target import Target
from pipeline.config.yaml_models import parse
from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.maths.geometry.trajectory import Trajectory

START_NS = int(gps_ns_from_unix_utc(np.array([1_778_302_800]), np.array([0]))[0])  # 2026-05-09T05:00:00Z
STARTS_S = np.array([100, 700, 1300])  # of passes of 100 s
FACE = {"wall": {"corners": [[0, 1, -4], [0, -1, -4], [0, -1, 2], [0, 1, 2]]}}
READINGS = [["2026-05-09T05:00:00Z", 340.0], ["2026-05-09T05:15:00Z", 340.9], ["2026-05-09T06:00:00Z", 340.9]]


class Pool(Model):
    target: Target


def target(**by_time: Any) -> Target:
    place = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
    content = {"kind": "faces", "faces": FACE, "origin": place, "water_level_m": 0.5, "water_by_time": by_time or None}
    return parse(Pool, {"target": content}, "pool").target


def levels(of: Target, starts_s: np.ndarray = STARTS_S, long_s: float = 100.0, hole: bool = False) -> Any:
    """A boat that rises by 0.1 mm a second, in waves of 4 s, of which a pass holds a whole number."""
    seconds = np.arange(0.0, 1500.0, 0.5)
    seconds = seconds[(seconds < 700) | (seconds > 900)] if hole else seconds
    heights = 1.2 + 1e-4 * seconds + 0.05 * np.sin(2 * np.pi * seconds / 4.0)
    positions = np.column_stack([np.full(len(seconds), -5.0), seconds % 100, heights])
    t_ns = START_NS + np.rint(seconds * NS).astype(np.int64)
    trajectory = Trajectory.build(t_ns, positions, np.broadcast_to(np.eye(3), (len(seconds), 3, 3)))
    starts_ns = START_NS + starts_s * NS
    return water_levels(of, trajectory, starts_ns, starts_ns + round(long_s * NS) - 1)


def test_without_changes_it_is_one_number():
    level_m, ins_m = levels(target())
    assert level_m.tolist() == [0.5, 0.5, 0.5]
    assert ins_m == pytest.approx([1.215, 1.275, 1.335], abs=1e-4)


def test_by_the_boats_height_it_is_so_far_below_the_ins():
    level_m, _ = levels(target(ins_above_water_m=0.7))
    assert level_m == pytest.approx([0.515, 0.575, 0.635], abs=1e-4)


def test_by_readings_it_is_the_given_level_at_the_first_and_rises_with_them():
    """From 05:00 to 05:15 a staff in another datum rises by 0.9 m, and stays."""
    level_m, _ = levels(target(readings=READINGS))
    assert level_m == pytest.approx([0.5 + 0.15, 0.5 + 0.75, 0.5 + 0.9], abs=1e-3)


@pytest.mark.parametrize("by_time", [{"ins_above_water_m": 0.7}, {"readings": READINGS}], ids=["ins", "readings"])
def test_a_pass_has_its_level_whatever_other_passes_there_are(by_time: dict[str, Any]):
    """Heads of a sonar, and parts of a session, have passes of their own."""
    together, _ = levels(target(**by_time))
    alone = [levels(target(**by_time), STARTS_S[k : k + 1])[0][0] for k in range(3)]
    assert together.tolist() == alone


def test_a_pass_without_a_pose_has_that_of_the_nearest():
    level_m, ins_m = levels(target(ins_above_water_m=0.7), hole=True, long_s=0.2)
    assert np.isfinite(level_m).all()
    assert ins_m[1] == pytest.approx(1.2 + 1e-4 * 900.5, abs=0.06)
    assert levels(target(ins_above_water_m=0.7), np.array([1600]))[0] == pytest.approx([1.2 + 0.15 - 0.7], abs=0.06)
    assert len(levels(target(ins_above_water_m=0.7), np.empty(0, dtype=np.int64))[0]) == 0


@pytest.mark.parametrize(("start_s", "end_s", "words"), [(-59, 3659, ""), (-61, 100, "do not"), (100, 3661, "do not")])
def test_readings_cover_a_pass_to_a_minute(start_s: int, end_s: int, words: str):
    by_time = target(readings=READINGS).water_by_time
    assert by_time is not None
    assert by_time.readings is not None
    told = uncovered(by_time.readings, [START_NS + start_s * NS], [START_NS + end_s * NS])
    assert told.startswith("target.water_by_time.readings, from 2026-05-09T05:00:00Z to" if words else words)
    assert words in told


STANDS = [([0.1, 0.2], 0), ([0.79, 1.4], 0), ([0.81, 1.4], 1), ([-0.4, 0.21], 0), ([-0.4, 0.19], 1)]


@pytest.mark.parametrize(("level_m", "told"), STANDS)
def test_the_height_of_the_ins_is_held_against_the_given_level(level_m: list[float], told: int):
    """The given one, 0.5 m, may lie 0.3 m outside those of the passes."""
    names = ["pass 0", "pass 1"]
    words = contradiction(target(ins_above_water_m=0.7), np.array(level_m), np.zeros(2), names, 0.1)
    assert len(words) == told
    assert all("water_level_m says +0.50 m: measure the height of the INS above the water" in one for one in words)


@pytest.mark.parametrize(("boat_m", "told"), [([1.0, 1.3], 0), ([1.0, 1.21], 0), ([1.0, 1.19], 1), ([1.3, 1.0], 1)])
def test_readings_are_held_against_the_boat(boat_m: list[float], told: int):
    level_m = np.array([0.5, 0.8])
    words = contradiction(target(readings=READINGS), level_m, np.array(boat_m), ["pass 0", "pass 1"], 0.1)
    assert len(words) == told
    rise_m = boat_m[1] - boat_m[0]
    expected = "from pass 0 to pass 1 the water rises by +0.30 m by target.water_by_time.readings, and the boat by "
    assert all(one.startswith(f"{expected}{rise_m:+.2f} m") for one in words)
