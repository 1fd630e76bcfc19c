"""Is the target's pose ambiguous? What the laser saw of the ends decides, on both sides of the limit."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.stage_settings import settings_by_name, stage_config
from pipeline.config.yaml_models import parse
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.maths.target.coverage import Found, Hypothesis, Scan, dry_cells
from pipeline.maths.target.model import TargetFrame, TargetModel
from pipeline.maths.target.outlines import Outline, build_target
from pipeline.mount import Mounted
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session
from pipeline.target.result_tables import target_pose_table
from pipeline.target.rivals import BestRival, best_rival
from pipeline.target.samples import LaserSample, scan_of
from pipeline.target.surface import ClosestSurface
from stages import segment
from tests.support.effort import often
from tests.support.simulated import calibrated, made, merged
from tests.support.targets import by_letters
from tools.campaigns import CAMPAIGNS, DRIFT, scenario_of

Array = NDArray[np.float64]
SHARE = 0.3
FEW_PINGS = {"mbes": {"ping_rate_hz": 2.0}}  # quicker; the laser's points are the same
NOWHERE = np.empty((0, 3))
HERE = TargetFrame(np.eye(3), np.zeros(3))
LOWER = "left and right exchanged, half a period lower"
ORIGIN = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
PATENT = {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5, "origin": ORIGIN}


def seen(points: Array, looked_at: Array = NOWHERE) -> Scan:
    """Points as given, 3 cm below the centres of cells, and two rays to each place that was looked at."""
    toward = np.tile(looked_at, (2, 1)) - [-6.0, 0.0, 2.4]
    directions = toward / np.linalg.norm(toward, axis=1)[:, None]
    return Scan(points - [0.0, 0.0, 0.03], np.tile([-6.0, 0.0, 2.4], (len(toward), 1)), directions)


def judged(model: TargetModel, scan: Scan, share: float = SHARE) -> BestRival:
    return best_rival(scan, HERE, model, ClosestSurface(model), share)


def patent_up_to(rows: int) -> tuple[TargetModel, Scan]:
    """The patent's target, of whose wall the laser saw as many rows above 3.6 m, and no block that ends above 3.5 m.

    A rival half a period lower lacks the wall above 3.5 m. A row of its cells has 0.3 m².
    """
    model = by_letters(8.0, 3.0, 1.0, 0.5)
    cells = dry_cells(model).centres_m
    wall = np.abs(cells[:, 0]) < 1e-9
    return model, seen(cells[np.where(wall, cells[:, 2] < 3.6 + 0.1 * rows, cells[:, 2] < 3.5)])


@pytest.mark.parametrize(("rows", "ambiguous"), [(0, True), (1, True), (2, False)])
def test_the_wall_seen_above_a_lower_rival_decides(rows: int, ambiguous: bool) -> None:
    """The limit is 0.3 of the wall's 3 m by half a period: 0.45 m²."""
    found = judged(*patent_up_to(rows))
    assert found.name == LOWER
    assert found.ambiguous == ambiguous
    beside_m2 = 0.011 * rows  # the wall's last column also lies near a cell of the block beside it
    assert found.agreement_m2 - found.rival_agreement_m2 == pytest.approx(0.3 * rows, abs=beside_m2)


@pytest.mark.parametrize(("share", "ambiguous"), [(0.19, False), (0.21, True)])
def test_the_share_is_that_of_the_wall_half_a_period_high(share: float, ambiguous: bool) -> None:
    assert judged(*patent_up_to(1), share).ambiguous == ambiguous


@pytest.mark.parametrize(("looked", "ahead_m2"), [(False, 0.0), (True, 0.9)])
def test_a_wall_that_must_be_seen_and_is_not_contradicts_its_pose(looked: bool, ahead_m2: float) -> None:
    """Of a wall seen up to its top, half a period higher is excluded by its water alone, or where it was looked at."""
    model = by_letters(8.0, 3.0, 1.0, 0.5)
    cells = dry_cells(model).centres_m
    above = np.array([[0.0, y, z] for y in np.arange(-1.45, 1.5, 0.1) for z in (4.15, 4.25, 4.35)])
    rival = model.mirrored()
    scans = seen(cells), seen(cells, above)
    higher = Hypothesis(rival, TargetFrame(np.eye(3), np.array([0.0, 0.0, 0.5])), ClosestSurface(rival))
    here = Hypothesis(model, HERE, ClosestSurface(model))
    unlooked, margin = (Found(here, scan).over(higher).margin_m2 for scan in (scans[0], scans[looked]))
    assert unlooked > 0.9
    assert margin - unlooked == pytest.approx(ahead_m2, abs=0.02)


def wall(*others: Outline, repeats_m: float | None = None) -> TargetModel:
    corners = [(0.0, 1.5, -3.0), (0.0, -1.5, -3.0), (0.0, -1.5, 2.0), (0.0, 1.5, 2.0)]
    return build_target([Outline("wall", corners), *others], [], 0.0, repeats_m)


def block(low: float, high: float, side: int = 1) -> Outline:
    """A slanted face beside the wall: 0.707 m wide."""
    ends = [(0.5, side * 2.0), (0.0, side * 1.5)][::side]
    return Outline(f"block{low}{side}", [(*ends[0], low), (*ends[1], low), (*ends[1], high), (*ends[0], high)])


@pytest.mark.parametrize(
    "model",
    [wall(), wall(block(-1.0, 1.0), block(-1.0, 1.0, -1)), wall(block(-2.0, -1.0))],
    ids=["plain", "two blocks", "one block, under water"],
)
def test_a_target_that_is_the_same_mirrored_has_no_rival(model: TargetModel) -> None:
    for scan in (seen(dry_cells(model).centres_m), seen(np.array([[0.0, 0.0, 1.0]]))):
        assert judged(model, scan).name == "none"
        assert not judged(model, scan).ambiguous


def test_a_symmetric_target_that_repeats_may_stand_a_period_lower() -> None:
    model = wall(block(0.2, 0.7), block(0.2, 0.7, -1), block(1.2, 1.7), block(1.2, 1.7, -1), repeats_m=1.0)
    cells = dry_cells(model).centres_m
    assert not judged(model, seen(cells)).ambiguous
    low = judged(model, seen(cells[cells[:, 2] < 1.0]))
    assert (low.name, low.ambiguous) == ("one period lower", True)


def test_one_small_block_tells_left_from_right_if_it_is_seen() -> None:
    """It has 0.35 m², less than 0.3 of the wall half a period high."""
    model = wall(block(0.5, 1.0))
    cells = dry_cells(model).centres_m
    found = judged(model, seen(cells))
    assert found.name == "left and right exchanged"
    assert found.rival_agreement_m2 > 5.0
    assert found.agreement_m2 - found.rival_agreement_m2 < SHARE * 3.0 * 0.5
    assert not found.ambiguous
    assert judged(model, seen(cells[cells[:, 0] < 0.01])).ambiguous


def test_a_scanner_also_looked_where_nothing_came_back() -> None:
    """From two places it got one point each: the rays are each direction from each place, turned with the boat."""
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    track = Trajectory(
        np.array([0, 10]), np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0]]), np.stack([np.eye(3)] * 2), np.zeros((2, 3))
    )
    points = np.array([[5.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    sample = LaserSample(np.empty((0, 3)), np.empty((2, 3)), np.array([0, 5]), points)
    scan = scan_of(sample, track, Mounted(quarter, np.array([0.0, 0.0, 0.5])))
    rays = {tuple(row) for row in np.hstack([scan.origins_m, scan.directions]).round(9).tolist()}
    assert rays == {(x, 0.0, 1.5, *way) for x in (0.0, 2.0) for way in ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}
    none = LaserSample(np.empty((0, 3)), np.empty((0, 3)), np.empty(0, dtype=np.int64), np.empty((0, 3)))
    assert scan_of(none, track, Mounted(quarter, np.zeros(3))).directions.shape == (0, 3)


def pose_of(session: SimulatedSession) -> pd.Series:
    """The row of target_pose, by the searches of stage segment alone."""
    found = calibrated(session, "georeference")
    parsed = parse(PoolConfig, session.pool, "pool"), parse(SessionConfig, session.session, "session")
    config = stage_config(segment.Config, settings_by_name(*parsed))
    inputs = {key.rpartition("/")[2]: found[key] for key in sorted(found)}  # counts: those of georeference
    names = [field.name for field in fields(segment.Inputs)]
    target = segment.search(segment.Inputs(**{name: inputs[name] for name in names}), config).target
    return target_pose_table(target).iloc[0]


def margin_m2(pose: pd.Series) -> float:
    return float(pose["agreement_m2"] - pose["rival_agreement_m2"])


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [9045, 9000, 9001])
def test_twelve_passes_with_drift_are_not_ambiguous(seed: int) -> None:
    """In 9045 the laser's points of the back wall lay beside a rival's uppermost block."""
    campaign = next(one for one in CAMPAIGNS if one.name == "twelve passes, INS drift")
    scenario = merged(scenario_of(campaign, seed - campaign.first_seed), FEW_PINGS)
    pose = pose_of(simulate_session(parse(Scenario, scenario, campaign.name), seed))
    assert not pose["ambiguous"]
    assert margin_m2(pose) > 1.0


@pytest.mark.parametrize(("uppermost_deg", "ambiguous"), [(92.0, True), (78.0, False)])
def test_the_scanner_must_look_at_the_upper_end(uppermost_deg: float, ambiguous: bool) -> None:
    """From 2.4 m above the water, 4 to 8 m away: up to the water's line of sight, or 12° above it."""
    session = made({"laser": {"field_deg": [uppermost_deg, 130.0]}, "ins": DRIFT}, FEW_PINGS, seed=1)
    assert pose_of(session)["ambiguous"] == ambiguous


@pytest.mark.parametrize(
    "scenario",
    [
        {"target": PATENT | {"azimuth_deg": 163.0, "low_side": "north"}},
        {"surroundings": {"origin_error_m": [-0.3, 0.3, -0.15], "azimuth_error_deg": 3.0}},
        {"surroundings": {"back_wall": False}, "track": {"distances_m": [6.0]}},
        pytest.param({"laser": {"coarse_angle_deg": 0.5}}, marks=pytest.mark.thorough),
    ],
    ids=["turned", "origin off", "sky behind, one pass", "laser's mount off"],
)
def test_good_sessions_are_not_ambiguous(scenario: dict[str, Any]) -> None:
    pose = pose_of(made({"ins": DRIFT}, FEW_PINGS, scenario, seed=2))
    assert not pose["ambiguous"]
    assert margin_m2(pose) > 1.0


@pytest.mark.parametrize("higher_m", often([-1.0, 0.5], [-1.0, -0.5, 0.5, 1.0]))
def test_a_wrong_height_is_seen(higher_m: float) -> None:
    """Half a period off, a pose with left and right as they are fits nowhere: some rival is better."""
    origin = ORIGIN | {"height_m": 12.0 + higher_m}
    session = made(FEW_PINGS, seed=1)
    pose = pose_of(replace(session, pool=session.pool | {"target": session.pool["target"] | {"origin": origin}}))
    assert pose["ambiguous"]
    assert margin_m2(pose) < 0
