"""poolcal check on a target that is not where the config says: its height, its sides, its azimuth."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from numpy.typing import NDArray

from pipeline.checking import check_session as asked
from pipeline.checking import target_hits, track_checks, trial_findings
from pipeline.checking.file_survey import SurveyedFile, survey_files
from pipeline.checking.findings import Finding
from pipeline.checking.point_samples import PointSample, place_points, sample_points
from pipeline.checking.track import InsTrack, frame_of, joined, track_of
from pipeline.checking.trial_calibration import TrialCalibration
from pipeline.config.load import load_pool, load_session
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.maths.target.model import TargetModel
from pipeline.target.design import target_of
from pipeline.target.surface import ClosestSurface
from tests.support.checks import FINE
from tests.support.effort import often
from tests.support.places import poolcal, simulate
from tests.support.roots import SCENARIOS


@dataclass(frozen=True)
class Looked:
    """A session as ``check`` has it in hand when it asks where the points fall."""

    files: list[SurveyedFile]
    session: SessionConfig
    pool: PoolConfig
    model: TargetModel
    closest: ClosestSurface

    def samples(self, track: InsTrack, **mounts: dict[str, float]) -> list[PointSample]:
        found = []
        for sensor in ("laser", "mbes"):
            settings = getattr(self.session, sensor)
            changed = settings.model_copy(update={"mount": settings.mount.model_copy(update=mounts.get(sensor, {}))})
            some = sample_points(self.files, self.session.model_copy(update={sensor: changed}), sensor, track, 2_000)
            assert some is not None
            found.append(some)
        return found

    def track(self, pool: PoolConfig) -> InsTrack:
        ins = joined(self.files)
        frame = frame_of(ins, pool.target_place)
        assert frame is not None
        return track_of(ins, frame, self.model, self.files, pool.ingest)

    def missing(self, height_m: float = 0.0, water_m: float = 0.0, **mounts: dict[str, float]) -> list[Finding]:
        """What is said of points with the origin's height, the water level and mounts changed."""
        target = self.pool.target
        origin = target.origin.model_copy(update={"height_m": target.origin.height_m + height_m})
        changed = {"origin": origin, "water_level_m": target.water_level_m + water_m}
        pool = self.pool.model_copy(update={"target": target.model_copy(update=changed)})
        track = self.track(pool)
        return list(target_hits.points_off_target(track, self.samples(track, **mounts), self.closest, pool))


@pytest.fixture(scope="module", params=["default", "small_target", "dock"])
def looked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Looked:
    return _looked(tmp_path_factory.mktemp("heights") / "session", request.param)


@pytest.fixture(scope="module")
def blocks(tmp_path_factory: pytest.TempPathFactory) -> Looked:
    return _looked(tmp_path_factory.mktemp("blocks") / "session", "default")


def _looked(folder: Path, scenario: str) -> Looked:
    simulate(folder, base=SCENARIOS / f"{scenario}.yaml", **FINE)
    session, pool = load_session(folder), load_pool(folder / "pool.yaml")
    files, wrong = survey_files(session, folder)
    assert not wrong
    model = target_of(pool.target)
    return Looked(files, session, pool, model, ClosestSurface(model))


HEIGHTS = [-45, -20, -16, -9, -7, -5, -4.5, -4, -3, -2.5, -2, -1.5, 1.5, 2, 2.5, 3, 4, 4.5, 5, 6, 7, 11, 16, 20, 45]


def test_a_wrong_height_names_itself_and_no_mount(looked: Looked) -> None:
    """Whole and half repetitions of the target (1 m) among them: its ends tell."""
    for off in often(HEIGHTS[::3], HEIGHTS):
        (found,) = looked.missing(height_m=off)
        assert found.question == "height", (off, found)
        assert found.severity == "fault"
        assert "laser points and soundings miss the target, and both hit it" in found.words
        assert "mount" not in found.words
        number, way = found.words.split("height_m is about ")[1].split(" m ")[:2]
        assert float(number) == pytest.approx(abs(off), abs=0.4), (off, found)
        assert way.startswith("lower" if off > 0 else "higher")


def test_a_height_that_is_right_is_not_doubted(looked: Looked) -> None:
    for off in often((0.0, 0.3), (0.0, 0.3, -0.3)):
        assert looked.missing(height_m=off) == []


def test_one_sensor_alone_does_not_tell_a_height_from_its_mount(blocks: Looked) -> None:
    """The laser, turned away, hits nothing at any height."""
    mount = blocks.session.laser.mount
    found = blocks.missing(height_m=3.0, laser={"yaw_deg": mount.yaw_deg + 180.0})
    (found,) = (one for one in found if one.words.startswith("mbes"))
    assert "mbes.mount.z_m" in found.words
    height = found.words.split("; or correct target.origin.height_m (")[1].removesuffix(" in place of 15)")
    assert float(height) == pytest.approx(12.0, abs=0.4)


@pytest.mark.parametrize(("off", "said"), [(-9.0, "higher"), (9.0, "lower")])
def test_heights_of_points_that_others_placed_are_no_mount(blocks: Looked, off: float, said: str) -> None:
    """The lever arm of a laser whose points are in a CRS moves none of them."""
    track = blocks.track(blocks.pool)
    laser, mbes = blocks.samples(track)
    points = place_points(track, laser)
    rows = np.isfinite(points[:, 0])
    placed = replace(laser, t_ns=laser.t_ns[rows], points_m=points[rows] + [0.0, 0.0, off], georeferenced=True)
    (found,) = target_hits.points_off_target(track, [placed, mbes], blocks.closest, blocks.pool)
    assert found.words.startswith("laser: laser points miss the target, but hit it if they lay ")
    shift, way = found.words.split("if they lay ")[1].split(" m ")[:2]
    assert float(shift) == pytest.approx(abs(off), abs=0.4)
    assert way.startswith(said)
    assert "above sea level" in found.words
    assert "mount" not in found.words


@pytest.mark.parametrize("off", [-2.0, pytest.param(-1.0, marks=pytest.mark.thorough), 2.0])
def test_a_wrong_water_level_is_no_wrong_height(looked: Looked, off: float) -> None:
    assert looked.missing(water_m=off) == []


def test_z_of_one_mount_is_told_from_the_height(blocks: Looked) -> None:
    for sensor, z_m in (("mbes", 2.09), ("laser", -1.1)):
        (found,) = blocks.missing(**{sensor: {"z_m": z_m}})
        assert f"{sensor}.mount.z_m = {-z_m:g} in place of {z_m:g}: reverse its sign" in found.words
    (found,) = blocks.missing(mbes={"z_m": -5.09})
    assert "mbes.mount.z_m = " in found.words
    assert float(found.words.split("z_m = ")[1].split()[0]) == pytest.approx(-2.09, abs=0.4)


def test_a_lever_arm_in_centimetres(blocks: Looked) -> None:
    (found,) = [one for one in blocks.missing(mbes={"x_m": 38.0}) if "mbes" in one.words]
    assert "mbes.mount.x_m = 0.38 in place of 38: write metres" in found.words


def test_angles_in_radians(blocks: Looked) -> None:
    mount = blocks.session.mbes.mount
    keys = ("roll_deg", "pitch_deg", "yaw_deg")
    (found,) = blocks.missing(mbes={key: math.radians(getattr(mount, key)) for key in keys})
    assert f"angles of mbes.mount are in radians: write degrees, such as roll_deg: {mount.roll_deg:g}" in found.words
    (found,) = blocks.missing(mbes={"roll_deg": math.radians(mount.roll_deg)})  # one alone is no habit
    assert "radians" not in found.words


@pytest.mark.parametrize(("turn", "said"), [(90, "never passes"), (-90, "never passes"), (40, "does not sail along")])
def test_a_wrong_azimuth_is_proposed(blocks: Looked, turn: float, said: str) -> None:
    pool = blocks.pool.model_copy(update={"target": blocks.pool.target.model_copy(update={"azimuth_deg": turn})})
    (found,) = track_checks.sailing_findings(blocks.track(pool), pool.target_place)
    assert said in found.words
    assert f"target.azimuth_deg is {turn:g}" in found.words
    assert "write 0," in found.words


@pytest.mark.parametrize("turn", [-12.0, 12.0])
def test_an_azimuth_about_right_is_not_doubted(blocks: Looked, turn: float) -> None:
    pool = blocks.pool.model_copy(update={"target": blocks.pool.target.model_copy(update={"azimuth_deg": turn})})
    assert list(track_checks.sailing_findings(blocks.track(pool), pool.target_place)) == []


def test_a_target_to_port_is_not_one_from_behind(blocks: Looked) -> None:
    """Seen from behind its azimuth is wrong; to port the boat sailed the other way, or its heading is turned."""
    track = blocks.track(blocks.pool)

    def said(**changed: Any) -> str:
        legs = tuple(type(leg)(**{**leg.__dict__, **changed}) for leg in track.legs)
        turned = type(track)(track.frame, track.trajectory, legs)
        (found,) = track_checks.sailing_findings(turned, blocks.pool.target_place)
        assert found.question == "side"
        return found.words

    behind = said(distance_m=-5.0, starboard=True)
    assert "in all 2 passes the boat sails behind the target" in behind
    assert "turn target.azimuth_deg by 180° (180 in place of 0)" in behind
    port = said(starboard=False)
    assert "with the target to port, where the sonar by mbes.mount does not look: sail the other way" in port
    assert "azimuth" not in port
    assert "is the INS's heading turned by 180°?" in said(starboard=False, astern=True)


def _pose(z_m: float = 0.0, ambiguous: bool = True, within: bool = True) -> pd.DataFrame:
    row = {"R_target_from_pool": np.eye(3).ravel().tolist(), "ambiguous": ambiguous, "within": within}
    row |= {"origin_x_pool_m": 0.0, "origin_y_pool_m": 0.0, "origin_z_pool_m": z_m, "azimuth_correction_deg": 0.0}
    return pd.DataFrame([row])


def _other_pose(looked: Looked, pose: pd.DataFrame, **target: Any) -> list[Finding]:
    pool = looked.pool.model_copy(update={"target": looked.pool.target.model_copy(update=target)})
    track = looked.track(pool)
    return list(trial_findings.pose_findings(track, looked.samples(track)[0], pose, target_of(pool.target), pool))


@pytest.mark.parametrize("off", [-1.0, -0.5, 0.5, 1.0])
def test_a_height_wrong_by_a_block_or_half_a_repetition(blocks: Looked, off: float) -> None:
    origin = blocks.pool.target.origin
    wrong = origin.model_copy(update={"height_m": origin.height_m + off})
    (found,) = _other_pose(blocks, _pose(), origin=wrong)
    assert found.question == "height"
    way = "lower" if off > 0 else "higher"
    assert f"target.origin.height_m {abs(off):.1f} m {way} (12.0 in place of {12 + off:g})" in found.words


def test_exchanged_sides(blocks: Looked) -> None:
    (found,) = _other_pose(blocks, _pose(), low_side="north")
    assert found.question == "sides"
    assert "write target.low_side: south" in found.words


def test_a_pose_found_right_is_not_doubted(blocks: Looked) -> None:
    """Nor one that the calibration found a little off the origin given."""
    assert _other_pose(blocks, _pose(ambiguous=False)) == []
    origin = blocks.pool.target.origin
    lower = origin.model_copy(update={"height_m": origin.height_m - 0.2})
    assert _other_pose(blocks, _pose(0.2, ambiguous=False), origin=lower) == []


@pytest.mark.parametrize(("as_found", "questions"), [(0.96, []), (0.94, ["sides"])])
def test_sides_are_exchanged_where_that_fits_clearly_better(
    blocks: Looked, monkeypatch: pytest.MonkeyPatch, as_found: float, questions: list[str]
) -> None:
    """Sides of which too little was seen fit either way, and chance makes one of them the better."""
    of_both = iter([as_found, 1.0])

    def profile(*_: object) -> NDArray[np.float64]:
        return next(of_both) * np.exp(-((trial_findings.SHIFTS_M / 0.1) ** 2))

    monkeypatch.setattr(trial_findings, "profile", profile)
    assert [one.question for one in _other_pose(blocks, _pose(ambiguous=False))] == questions


def test_a_pose_beyond_what_is_searched(blocks: Looked) -> None:
    (found,) = _other_pose(blocks, _pose(0.0, ambiguous=False, within=False))
    assert found.question == "origin"
    assert "more than segment.search_... allow" in found.words


def test_run_points_to_check_where_nothing_hits(tmp_path: Path) -> None:
    folder = simulate(tmp_path / "session", **{"mbes": {"ping_rate_hz": 4.0}, "ins": {"rate_hz": 50.0}})
    content = yaml.safe_load((folder / "session.yaml").read_text())
    content["mbes"]["mount"]["roll_deg"] *= -1
    (folder / "session.yaml").write_text(yaml.safe_dump(content))
    told = poolcal("run", folder, "--config", folder / "pool.yaml", "--run", tmp_path / "run", "--jobs", 1)
    assert told.status == 2
    assert "poolcal check tells which sign, clock or height" in told.err


def test_what_follows_from_a_wrong_pose_is_not_said(blocks: Looked, monkeypatch: pytest.MonkeyPatch) -> None:
    """Faces without soundings are not reported where the target does not stand as configured."""
    pool = blocks.pool.model_copy(update={"target": blocks.pool.target.model_copy(update={"low_side": "north"})})
    monkeypatch.setattr(asked, "survey_files", lambda *_: (blocks.files, []))

    def trial(*_: object) -> TrialCalibration:
        return TrialCalibration(target_pose=_pose())

    found = asked.check_session(Path("."), blocks.session, pool, trial)
    assert [one.question for one in found.findings] == ["sides"]
