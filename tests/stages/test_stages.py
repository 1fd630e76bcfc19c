"""Single stages: what they drop and count, what they refuse, what makes a verdict."""

import copy
import dataclasses
import json

import numpy as np
import pytest

from pipeline.config.mount import Mount
from pipeline.errors import RawDataError
from pipeline.mount import mount_of, setting_change
from tests.support.effort import often
from tests.support.simulated import INS_HZ, QUIET, calibrated, made, through

NS = 1_000_000_000


def counts(found, stage):
    table = found[f"{stage}/counts"]
    return {(source, reason): int(number) for source, reason, _, number in table.itertuples(index=False)}


def columns(stream, name):
    return np.concatenate([part.columns[name] for part in stream.parts])


def test_every_point_is_counted_from_stage_to_stage(noisy, noisy_found):
    found = noisy_found
    georeferenced, segmented = counts(found, "georeference"), counts(found, "segment")
    for raw, source, nxt in (
        ("laser", "laser_points", "laser_pool"),
        ("mbes", "soundings", "soundings_pool"),
    ):
        total = len(getattr(noisy, raw)["t_ns"])
        assert counts(found, "ingest")[(raw, "used")] == total
        assert sum(n for (s, _), n in georeferenced.items() if s == source) == total
        assert sum(n for (s, _), n in segmented.items() if s == nxt) == georeferenced[(source, "used")]
    assert segmented[("laser_pool", "used")] == len(columns(found["segment/laser_labelled"], "face"))


def test_points_in_holes_of_the_ins_are_not_interpolated_over(quiet):
    t = quiet.ins["t_ns"]
    middle = int(quiet.laser["t_ns"][len(quiet.laser["t_ns"]) // 8])
    hole = (t > middle) & (t < middle + 2 * NS)
    found = calibrated(quiet, "georeference", raw={"ins": {k: v[~hole] for k, v in quiet.ins.items()}})
    lost = counts(found, "georeference")
    assert lost[("laser_points", "hole in the INS")] > 1000
    inside = columns(found["georeference/laser_pool"], "t_ns")
    assert not np.any((inside > middle + 10_000_000) & (inside < middle + 2 * NS - 10_000_000))
    assert len(found["ingest/passes"]) == 4  # two seconds end no pass


def test_repeated_and_unordered_ins_records_are_sorted_out(quiet):
    order = np.random.default_rng(0).permutation(len(quiet.ins["t_ns"]))
    doubled = {k: np.concatenate([v[order], v[:100]]) for k, v in quiet.ins.items()}
    found = calibrated(quiet, "ingest", raw={"ins": doubled})
    np.testing.assert_array_equal(found["ingest/trajectory"]["t_ns"].to_numpy(), quiet.ins["t_ns"])
    assert counts(found, "ingest")[("ins", "repeated time")] == 100


def test_passes_and_quality_are_recorded(noisy_found):
    found = noisy_found
    passes = found["ingest/passes"]
    assert len(passes) == 4
    np.testing.assert_allclose(passes["speed_m_s"], 0.4, atol=0.03)
    np.testing.assert_allclose(passes["distance_m"], [4, 8, 5, 7], atol=0.1)  # to the wall, however long the pass
    assert set(found["ingest/gaps"]["sensor"]) == {"ins", "mbes"}
    assert len(found["ingest/gaps"]) == 6
    rates = found["ingest/files"].set_index("sensor")["rate_hz"]
    assert rates["ins"] == pytest.approx(INS_HZ, rel=1e-3)
    assert rates["mbes"] == pytest.approx(10, rel=1e-2)


def test_a_pass_that_only_the_laser_recorded_is_kept_in_mind(quiet):
    """All of a pass's soundings away, or all but a few; a pass of which half is there has its row in ``passes``."""
    passes, t = calibrated(quiet, "ingest")["ingest/passes"], quiet.mbes["t_ns"]
    for number, lost_share, expected in ((0, 1.0, 1), (1, 1.0, 1), (3, 1.0, 1), (1, 0.5, 0)):
        start, end = passes.loc[number, ["start_ns", "end_ns"]]
        kept = (t < start) | (t > start + lost_share * (end - start))
        found = calibrated(quiet, "ingest", raw={"mbes": {k: v[kept] for k, v in quiet.mbes.items()}})
        unsounded = found["ingest/unsounded_passes"]
        assert len(unsounded) == expected
        assert ((unsounded["start_ns"] + unsounded["end_ns"]) // 2).between(start, end).all()
        np.testing.assert_allclose(unsounded["distance_m"], [passes.loc[number, "distance_m"]] * expected, atol=0.1)


def test_in_a_whole_session_no_pass_lacks_soundings(quiet_found):
    assert quiet_found["ingest/unsounded_passes"].empty


@pytest.mark.parametrize(
    ("sensor", "shift_s", "words"),
    [
        ("laser", 86_400, "no time overlap"),
        ("mbes", -604_800, "1 week apart: check gps_week"),
        ("mbes", 7_200, "clocks"),
    ],
)
def test_clocks_that_do_not_meet_are_refused(quiet, sensor, shift_s, words):
    moved = {**getattr(quiet, sensor), "t_ns": getattr(quiet, sensor)["t_ns"] + shift_s * NS}
    with pytest.raises(RawDataError, match=words):
        calibrated(quiet, "ingest", raw={sensor: moved})


def test_nothing_near_the_target_is_refused_with_the_counts(quiet):
    far = {"target": {"origin": {"latitude_deg": 36.01, "longitude_deg": 120.1, "height_m": 12.0}}}
    with pytest.raises(RawDataError, match=r"laser: no point within 1\.5 m of the target \(.*outside the box"):
        calibrated(quiet, "georeference", pool=far)


def test_a_sonar_looking_away_is_refused(quiet):
    with pytest.raises(RawDataError, match="mbes: no point"):
        calibrated(quiet, "segment", mount={"roll_deg": 48.8})


def test_an_unseen_top_makes_the_registration_ambiguous(quiet, quiet_found):
    """Without the ends of the stacks and the wall's top, one block higher is as good: rejected, not guessed."""
    pool = quiet_found["georeference/laser_pool"]
    low = set(columns(pool, "t_ns")[columns(pool, "z_pool_m") < 2.2].tolist())
    keep = np.array([t in low for t in quiet.laser["t_ns"].tolist()])
    result = calibrated(quiet, raw={"laser": {k: v[keep] for k, v in quiet.laser.items()}})
    calibration = json.loads(result["report/calibration.json"])
    assert result["segment/target_pose"]["ambiguous"].iloc[0]
    assert calibration["verdict"] == "rejected"
    assert any("ambiguous" in reason for reason in calibration["reasons"])


@pytest.mark.thorough
def test_a_stack_shifted_onto_the_floor_is_no_rival():
    """Met in a campaign: 0.7 m up, the floor passes for tops of blocks, and more soundings are explained than by the
    truth; but others then lie behind faces."""
    target = {"a": 6.0, "b": 2.4, "c": 0.8, "e": 0.4, "azimuth_deg": 0.0}
    target["origin"] = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
    coarse = {"roll_deg": 2.5, "pitch_deg": -2.5, "yaw_deg": -2.5, "x_m": -0.25, "y_m": 0.25, "z_m": 0.25}
    session = made(
        {"target": target, "track": {"distances_m": [4.0, 8.0, 5.0, 7.0, 4.5, 6.0]}, "mbes": {"coarse_error": coarse}},
        {"ins": QUIET["ins"], "laser": {"point_rate_hz": 5000.0, "outlier_share": 0.0, "water_return_share": 0.0}},
        {"mbes": {"ping_rate_hz": 20.0, "point_beams": True, "corner_share": 0.0, "outlier_share": 0.0}},
        {"mbes": {"surface_share": 0.0}},
        seed=4549,
    )
    found = calibrated(session, "segment")["segment/provisional_mount"].iloc[0]
    assert found["lever_arm_z_m"] == pytest.approx(-0.25, abs=0.01)
    assert found["rival_score"] < 0.95 * found["score"]


def test_a_swapped_low_side_is_seen(quiet):
    found = calibrated(quiet, "segment", pool={"target": {"low_side": "north"}})
    pose = found["segment/target_pose"].iloc[0]
    assert pose["ambiguous"]
    assert "left and right exchanged" in pose["rival"]


@pytest.mark.thorough
def test_a_tilted_target_is_reported_and_does_no_harm(errors_of):
    session = made(QUIET, {"surroundings": {"tilt_deg": [0.2, -0.3]}}, seed=4)
    found = calibrated(session)
    pose = found["segment/target_pose"].iloc[0]
    assert pose["tilt_x_deg"] == pytest.approx(0.2, abs=0.01)
    assert pose["tilt_y_deg"] == pytest.approx(-0.3, abs=0.01)
    block = json.loads(found["report/calibration.json"])["methods"]["adjustment"]
    error = np.abs(errors_of(block, session.truth))
    assert error[:3].max() < 5e-4
    assert error[3:].max() < 0.05


@pytest.mark.parametrize("wrong_deg", often([-0.5], [0.05, -0.5]))
def test_the_pose_found_is_right_within_its_sigma(wrong_deg):
    """Also where the wall runs along the sides of the voxels that it is searched with."""
    found = calibrated(made({"surroundings": {"azimuth_error_deg": wrong_deg}}, seed=5), "segment")
    pose = found["segment/target_pose"].iloc[0]
    for name, true, sigma in (
        ("azimuth_correction_deg", -wrong_deg, "sigma_azimuth_deg"),
        ("origin_x_pool_m", 0.0, "sigma_x_m"),
        ("origin_y_pool_m", 0.0, "sigma_y_m"),
        ("tilt_x_deg", 0.0, "sigma_tilt_x_deg"),
        ("tilt_y_deg", 0.0, "sigma_tilt_y_deg"),
    ):
        # The laser's noise and the INS's white noise; the latter is common to the points of a record.
        assert abs(pose[name] - true) < 6 * pose[sigma], (name, pose[name], pose[sigma])


@pytest.mark.thorough
def test_good_laser_points_on_a_tilted_target_keep_their_weight():
    found = calibrated(made({"surroundings": {"tilt_deg": [0.3, 0.0]}}, seed=6))
    laser = found["adjust/groups"].set_index("group").loc["laser"]
    assert laser["cut"] < 0.002 * laser["count"]
    assert json.loads(found["report/calibration.json"])["verdict"] == "accepted"


def test_a_single_pass_is_weak_and_says_so(noisy, noisy_found):
    end = noisy_found["ingest/passes"]["end_ns"][0]
    first = {name: values[noisy.mbes["t_ns"] <= end] for name, values in noisy.mbes.items()}
    result = json.loads(calibrated(noisy, raw={"mbes": first})["report/calibration.json"])
    assert "one pass alone has soundings" in result["geometry"]["advice"]
    whole = json.loads(noisy_found["report/calibration.json"])
    (angles, arm), (best_angles, best_arm) = (
        [np.array(one["mbes"]["sigma_total"][name]) for name in ("rotation_vector_deg", "lever_arm_m")]
        for one in (result, whole)
    )
    assert (angles > 1.1 * best_angles).all()
    assert (arm > 1.05 * best_arm).all()
    assert angles[2] > 5 * best_angles[2]  # yaw: one distance does not tell it from y


def test_a_head_mounted_the_other_way_round_changes_by_the_short_way():
    coarse = mount_of(Mount(roll_deg=0.0, pitch_deg=0.0, yaw_deg=179.9, x_m=0.0, y_m=0.0, z_m=0.0)).settings()
    total = mount_of(Mount(roll_deg=0.0, pitch_deg=0.0, yaw_deg=-179.6, x_m=0.0, y_m=0.0, z_m=0.0)).settings()
    assert setting_change(total, coarse, "yaw_deg") == pytest.approx(0.5)
    assert setting_change(coarse, total, "yaw_deg") == pytest.approx(-0.5)
    turned = mount_of(Mount(roll_deg=0.0, pitch_deg=177.7, yaw_deg=0.0, x_m=0.0, y_m=0.0, z_m=0.0)).settings()
    assert abs(turned["pitch_deg"]) <= 90


def test_sigma_limits_reject_and_name_the_parameter(noisy, noisy_found):
    limits = {"verdict": {"max_sigma_deg": 1e-4, "max_sigma_m": 1e-6}}
    found = calibrated(noisy, pool=limits, known=through("adjust", noisy_found))
    result = json.loads(found["report/calibration.json"])
    assert result["verdict"] == "rejected"
    assert sum("sigma of" in reason for reason in result["reasons"]) == 6
    assert result["mbes"]["covariance"] is not None


@pytest.mark.thorough
def test_wrong_sigmas_alone_reject_nothing(noisy, noisy_found, errors_of):
    """Five times too small, five times too large: the variance factors say so, and the result moves by less than a
    sigma (beams that are said to stray more keep further from the edges: other points)."""
    session = dataclasses.replace(noisy, session=copy.deepcopy(noisy.session))
    reference = json.loads(noisy_found["report/calibration.json"])
    for factor in (0.2, 5.0):
        session.session["laser"]["range_sigma_m"] = 0.005 * factor
        session.session["mbes"] |= {"range_sigma_m": 0.008 / factor, "angle_sigma_deg": 0.06 / factor}
        found = calibrated(session)
        result = json.loads(found["report/calibration.json"])
        assert result["verdict"] == "accepted", result["reasons"]
        groups = found["adjust/groups"].set_index("group")["variance_factor"]
        assert groups["mbes_vertical"] == pytest.approx(factor**2, rel=0.15)
        moved = np.abs(errors_of(result["mbes"], session.truth) - errors_of(reference["mbes"], session.truth))
        sigma = np.sqrt(np.diag(reference["mbes"]["covariance"])) / np.array([np.pi / 180] * 3 + [1e-3] * 3)
        assert (moved / sigma).max() < 1


def test_the_wall_alone_gives_nulls_and_a_reason(quiet, quiet_found):
    """Rank-deficient: rejected with nulls, never an error."""
    labelled = quiet_found["segment/soundings_labelled"]
    t, beam, face = (columns(labelled, name) for name in ("t_ns", "beam", "face"))
    wall = set(zip(t[face == 0].tolist(), beam[face == 0].tolist(), strict=True))
    keep = np.array([key in wall for key in zip(*(quiet.mbes[n].tolist() for n in ("t_ns", "beam")), strict=True)])
    result = calibrated(quiet, raw={"mbes": {k: v[keep] for k, v in quiet.mbes.items()}})
    calibration = json.loads(result["report/calibration.json"])
    assert calibration["verdict"] == "rejected"
    assert calibration["mbes"]["R_body_from_mbes"] is None
    assert calibration["mbes"]["sigma"] is None
    assert any("no result" in reason for reason in calibration["reasons"])
    assert calibration["methods"]["patent_alternating"]["mount"] is None
