"""Each warning, on both sides of its limit. What the warnings say is in test_wording.py."""

import pandas as pd
import pytest

from pipeline.config.session import Drift, Mbes
from pipeline.report.cast_checks import cast_warnings
from pipeline.report.drift_check import check_ins_drift, figures_disagree
from pipeline.report.noise_warnings import correlated_beams, sigmas_too_small, uneven_noise
from pipeline.report.reason_codes import ReasonCode
from pipeline.report.suspected_causes import errors_allowed_for
from pipeline.report.warnings import geometry_gaps, passes_with_one_sensor, target_off_origin, unexpected_noise
from tests.support.evidence import (
    FIGURES,
    FOUND,
    SIGMA,
    checked,
    codes,
    drift,
    drift_figures,
    families,
    gaps,
    groups,
)


@pytest.mark.parametrize(
    ("value", "known", "expected"),
    [
        (3.28e-4, True, []),  # of one parameter the limit is 3.29 sigmas
        (3.30e-4, True, [ReasonCode.ERROR_ALLOWED_FOR]),
        (-3.28e-2, True, [ReasonCode.ERROR_ALLOWED_FOR]),
        (3.30e-2, True, []),  # beyond its a-priori sigma too: a reason, and no warning
        (3.30e-4, False, []),
    ],
)
def test_an_error_that_the_mount_allows_for(value, known, expected):
    row = {"unknown": "projector_z", "estimated": False, "known": known}
    table = pd.DataFrame([row | {"value": value, "sigma": 1e-4, "expected": 1e-2}])
    found = errors_allowed_for(table, 0.001)
    assert codes(found) == expected
    place = "higher" if value > 0 else "lower"
    assert all("the survey does not yet: the transmitter sits" in one.words and place in one.words for one in found)
    of_target = errors_allowed_for(table.assign(unknown="wet_P2_shift"), 0.001)
    assert all(one.words.startswith("the mount allows for this: the target: its wet faces") for one in of_target)


def test_a_lasers_coarse_mount_may_be_as_far_off_as_its_sigma():
    row = {"unknown": "rotation_x", "estimated": False, "known": True, "value": 5e-3, "sigma": 1e-4, "expected": 5e-3}
    assert errors_allowed_for(pd.DataFrame([row]), 0.001) == []


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, []),
        ({"variance_factor": 1.99}, []),
        ({"variance_factor": 2.01}, [ReasonCode.NOISE_OFF_SIGMAS]),
        ({"variance_factor": 0.51}, []),
        ({"variance_factor": 0.49}, [ReasonCode.NOISE_OFF_SIGMAS]),
        ({"group": "ins_white", "variance_factor": 0.01}, []),
        ({"group": "ins_white", "variance_factor": 4.1}, [ReasonCode.INS_NOISE_ABOVE_SETTINGS]),
        ({"group": "ping", "variance_factor": 1.49}, []),
        ({"group": "ping", "variance_factor": 1.51}, [ReasonCode.PING_NOISE_ABOVE_SETTINGS]),
        ({"group": "ping", "variance_factor": 1.51, "sigma": 0.18}, []),
        ({"group": "ping", "variance_factor": 9.0}, [ReasonCode.PING_NOISE_ABOVE_SETTINGS]),
        ({"cut": 10}, []),
        ({"cut": 11}, [ReasonCode.MANY_OUTLIERS]),
        ({"cut": 11, "variance_factor": 9.0}, [ReasonCode.NOISE_OFF_SIGMAS, ReasonCode.MANY_OUTLIERS]),
    ],
)
def test_noise_that_is_not_as_configured(change, expected):
    assert codes([*unexpected_noise(groups(**change))]) == expected


@pytest.mark.parametrize(
    ("sensor", "factors", "sigma", "warned"),
    [
        ("mbes", {}, 0.01, 0),
        ("mbes", {"P1": 8.9, "P3": 8.9}, 0.001, 0),  # three times the sigma is usual at 45° along track
        ("mbes", {"H": 9.4}, 0.01, 1),
        ("mbes", {"H": 9.4}, 0.1, 0),  # it may be chance
        ("mbes", {"P2": 0.05}, 0.01, 0),  # a wall that is quieter than the other faces
        ("laser", {"H": 3.9}, 0.001, 0),
        ("laser", {"H": 4.4}, 0.01, 1),
    ],
)
def test_a_family_that_is_far_noisier_than_a_sensors_others(sensor, factors, sigma, warned):
    assert codes([*uneven_noise(families(sensor, sigma=sigma, **factors))]) == [
        ReasonCode.NOISE_DIFFERS_BY_FAMILY
    ] * warned  # fmt: skip


def test_a_family_alone_is_compared_with_nothing():
    assert [*uneven_noise(families("mbes", P1=50.0).head(1))] == []


@pytest.mark.parametrize(("effects", "warned"), [((1.0, 1.49), 0), ((1.0, 1.51), 1), ((1.51, 1.0), 1)])
def test_beams_that_err_alike(effects, warned):
    assert codes([*correlated_beams(families("mbes", {"P2": effects}))]) == [ReasonCode.BEAMS_CORRELATED] * warned


@pytest.mark.parametrize(
    ("ratio", "slots", "warned"),
    [
        (1.44, 1e6, 0),  # a fifth in sigma
        (1.46, 1e6, 1),
        (2.5, 10.0, 0),  # ten slots may scatter so
        (2.5, 100.0, 1),
        (0.3, 100.0, 0),  # sigmas that are too large do no harm
        (0.0, 0.0, 0),  # nothing left of the slots
    ],
)
def test_sigmas_that_slots_of_time_contradict(ratio, slots, warned):
    found = codes([*sigmas_too_small(checked(rotation_z=(ratio, slots)), 0.001)])
    assert found == [ReasonCode.SIGMAS_OFF_SCATTER] * warned


@pytest.mark.parametrize(
    ("change", "warned"),
    [({}, False), ({"offset_m": [0.0, -0.11, 0.0]}, True), ({"tilt_deg": [0.0, 0.11]}, True)],
)
def test_a_target_far_from_where_it_was_surveyed(change, warned):
    assert codes(target_off_origin(FOUND | change)) == [ReasonCode.TARGET_OFF_ORIGIN] * warned


def test_each_gap_in_the_geometry_is_a_warning():
    assert geometry_gaps(gaps(), SIGMA) == []
    assert codes(geometry_gaps(gaps("one pass alone", "no wall"), SIGMA)) == [ReasonCode.GEOMETRY_GAP] * 2
    assert [gap.words for gap in geometry_gaps(gaps("one pass alone"), None)] == ["one pass alone"]


def test_a_pass_that_one_sensor_missed_is_said():
    rows = [(0, 9000, 400), (1, 0, 0), (2, 8000, 0), (5, 8000, 0), (6, 0, 300)]
    passes = [{"pass": k, "laser_points": laser, "soundings": sonar} for k, laser, sonar in rows]
    both = [ReasonCode.PASS_WITHOUT_SOUNDINGS, ReasonCode.PASS_WITHOUT_LASER]
    assert codes([*passes_with_one_sensor(passes)]) == both
    assert [*passes_with_one_sensor(passes[:2])] == []


@pytest.mark.parametrize(("sigmas", "far"), [(1.19, False), (1.21, True)])
def test_an_ins_that_drifts_farther_than_its_figures(sigmas, far):
    vertical = Drift(**dict.fromkeys(FIGURES, 0.0) | {"vertical_m": 0.02})
    for figures in (Drift(), vertical):
        check = check_ins_drift(drift(sigmas), figures)
        assert (check is not None and check.code == ReasonCode.INS_DRIFT_ABOVE_SETTINGS) == far
    assert check_ins_drift(drift(sigmas).iloc[:0], Drift()) is None


@pytest.mark.parametrize(
    ("changes", "warned"),
    [
        ({}, False),
        ({"time_constant_s": (20.0, -1.99)}, False),
        ({"time_constant_s": (20.0, -2.01)}, True),
        ({"time_constant_s": (2000.0, 5.0)}, False),  # a slower drift is no fault
        ({"horizontal_m": (0.05, 2.01)}, True),
        ({"heading_deg": (0.1, 2.01)}, True),
        ({"heading_deg": (0.001, -5.0)}, False),
    ],
)
def test_an_ins_that_drifts_more_or_faster_than_its_figures(changes, warned):
    check = figures_disagree(drift_figures(**changes), "the INS's files say")
    assert (check is not None and check.code == ReasonCode.INS_DRIFT_OFF_FIGURES) == warned
    assert check is None or "than the INS's files say" in check.words


CAST = ((0.0, 1500.0), (5.0, 1501.0))


@pytest.mark.parametrize(
    ("cast", "recorded_m_s", "turn_deg", "expected"),
    [
        (CAST, 1500.0, [0.0, 1.9, 1.0], [ReasonCode.RAYS_TRACED_WITH_WRONG_MOUNT]),
        (CAST, 1500.0, [0.0, 1.9, 0.5], []),
        (CAST, 1500.0, None, []),
        (CAST, 1504.1, None, [ReasonCode.CAST_OFF_HEAD_SPEED]),
        (CAST, 1503.9, None, []),
        (CAST, 1496.9, None, [ReasonCode.CAST_OFF_HEAD_SPEED]),
        (CAST, float("nan"), None, []),
        (None, 1470.0, [0.0, 3.0, 0.7], []),
    ],
)
def test_a_cast_of_other_water_and_rays_bent_with_a_wrong_mount(cast, recorded_m_s, turn_deg, expected):
    files = pd.DataFrame({"sound_speed_low_m_s": [recorded_m_s], "sound_speed_high_m_s": [recorded_m_s]})
    warnings = cast_warnings(Mbes.model_construct(svp=cast), files, {"rotation_vector_deg": turn_deg})
    assert codes([*warnings]) == expected
