"""The patent word for word on simulated sessions without noise: how far its printed steps come."""

import json

import numpy as np
import pytest

from tests.support.simulated import QUIET, calibrated, made

TARGET = {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5}
ORIGIN = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}


def true_lever_arm(session):
    mount = session.truth["mbes"]["mount"]
    return {key: mount[key] for key in ("x_m", "y_m", "z_m")}


def test_with_the_true_lever_arm_it_converges_to_the_stretch_of_its_matrix_and_stalls_there(quiet):
    """As derived in maths/patent/literal_angles.py: wrong by the size of t², and a cycle in which pitch changes by
    1/√3 of roll. The form that composes rotations and compares components has neither."""
    pool = {"angle_iterate": {"literal_threshold_deg": 1e-6}}
    found = calibrated(quiet, "angle_iterate", mount=true_lever_arm(quiet), pool=pool)
    literal, sequential = (found[f"angle_iterate/{name}"].iloc[0] for name in ("literal_angles", "angles"))
    names = [f"rotation_{axis}_deg" for axis in "xyz"]
    right = sequential[names].to_numpy(dtype=float)  # the truth, to 1e-4°: tests/stages/test_recovery.py
    t = np.radians(np.linalg.norm(right))
    error = np.radians(np.abs(literal[names].to_numpy(dtype=float) - right))
    assert not literal["converged"]
    assert literal["reason"] == ""
    assert 0.1 * t**2 < error.max() < t**2
    rows = found["angle_iterate/literal_iterations"]
    steps = np.diff(rows[names[:2]].to_numpy()[-4:], axis=0)
    np.testing.assert_allclose(steps[0], -steps[1], atol=0.1 * np.abs(steps).max())
    assert steps[0, 0] / steps[0, 1] == pytest.approx(-1 / np.sqrt(3), rel=0.1)
    assert rows["angle_P2_deg"].iloc[-1] < np.degrees(t**2 / 4)


def test_above_the_stall_it_is_converged(quiet_found):
    """With the usual threshold, and with the coarse lever arm, which the text leaves as it is."""
    angles = quiet_found["angle_iterate/literal_angles"].iloc[0]
    assert angles["converged"]
    assert 1 <= angles["iterations"] <= 10


@pytest.fixture(scope="module")
def by_azimuth(errors_of):
    """The errors of each method by the pool's azimuth, in degrees and mm; the sessions differ in nothing else."""
    errors = {}
    for azimuth_deg in (0.0, 90.0, 163.0):
        session = made(QUIET, {"target": TARGET | {"azimuth_deg": azimuth_deg, "origin": ORIGIN}}, seed=5)
        pool = {"angle_iterate": {"literal_threshold_deg": 0.1}}
        methods = json.loads(calibrated(session, pool=pool)["report/calibration.json"])["methods"]
        assert methods["patent_literal"]["converged"]
        errors[azimuth_deg] = {name: errors_of(block, session.truth) for name, block in methods.items()}
    return errors


@pytest.mark.thorough
def test_the_angles_do_not_know_north(by_azimuth):
    at_north = by_azimuth[0.0]["patent_literal"]
    for azimuth_deg in (90.0, 163.0):
        np.testing.assert_allclose(by_azimuth[azimuth_deg]["patent_literal"][:3], at_north[:3], atol=1e-3)
    assert 0.01 < np.abs(at_north[:3]).max() < 0.5


@pytest.mark.thorough
def test_the_lever_arm_is_wrong_off_north(by_azimuth):
    """At 0° y has the whole x error in it, 80 mm, and no more; off north the differences belong to other axes."""
    x, y, z = by_azimuth[0.0]["patent_literal"][3:]
    assert abs(x) < 10
    assert abs(abs(y) - 80) < 30
    assert abs(z) < 10
    for azimuth_deg in (90.0, 163.0):
        assert np.linalg.norm(by_azimuth[azimuth_deg]["patent_literal"][3:5]) > 200
        assert np.abs(by_azimuth[azimuth_deg]["patent_alternating"][3:]).max() < 0.01
