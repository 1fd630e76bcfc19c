"""Each reason to reject, and nothing else."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pipeline.adjustment.pattern_tests import passes_test, pattern_tests
from pipeline.config.pool import Verdict
from pipeline.config.session import Drift, Mbes
from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.report.cast_checks import cast_doubts
from pipeline.report.verdict import Evidence, Settings, drift_doubt, one_eyed, reasons, warnings

SIGMA = {"roll_deg": 0.002, "pitch_deg": 0.005, "yaw_deg": 0.006, "x_m": 1e-4, "y_m": 6e-4, "z_m": 3e-4}
LEVEL = 0.001
ZERO = {"rotation_vector_deg": [0.8, -0.8, 0.8], "lever_arm_m": [0.1, 0.1, 0.1]}


ADJUSTED = Settings(Verdict(), LEVEL, 0.003, "adjustment", (4.5, 0.45), "", "target.a, b, c, e and low_side")
IN_TURN = replace(ADJUSTED, chosen="patent_alternating")
LIMITS = ((0.006, 6e-4), (0.0059, 5.9e-4))  # either side of SIGMA's largest
FIGURES = ("horizontal_m", "vertical_m", "roll_pitch_deg", "heading_deg")
DRIFTS = "the INS drifts at least 1.2 times as far as ins.drift says: "
OFF = {"normalised": 3.5}  # beyond the limit of one row, 3.29
PASS_3 = {"by": "pass", "low": 3.0, "mean_m": -0.012, "normalised": -4.0}
CLOCK = {"sigma": 3e-4, "considered": 4e-4}


def methods(**patent):
    adjustment = {"sigma_mount_total": SIGMA, "correction": ZERO}
    return {"adjustment": adjustment, "patent_alternating": {"sigma_mount": None, "correction": ZERO | patent}}


def evidence(pose=None, mount=None, summary=None, alternating=None, held=None, bin_=None, count=500):
    pose_row = {
        "ambiguous": False,
        "rival": "one block higher",
        "rival_agreement_m2": 9.0,
        "agreement_m2": 10.0,
        "within": True,
    }
    mount_row = {"ambiguous": False, "rival_score": 0.1, "score": 0.4, "within": True}
    mount_row |= {f"rotation_{axis}_deg": 4.4 for axis in "xyz"} | {f"lever_arm_{axis}_m": 0.44 for axis in "xyz"}
    summary_row = {
        "reason": "",
        "converged": True,
        "iterations": 6,
    }
    row = {"method": "patent_alternating", "reason": "", "converged": True, "iterations": 9}
    cells = pd.DataFrame(
        {
            "sensor": ["laser", "mbes", "mbes"],
            "family": ["P1", "P2", "P2"],
            "pass": [0, 3, 4],
            "count": [5000, 400, count],
        }
    )
    nothing = {"unknown": "sound_speed", "estimated": False, "considered": 1e-4, "value": 2e-4, "sigma": 1e-4}
    bins = {"by": "angle", "sensor": "mbes", "family": "P2", "low": 20.0, "width": 2.0, "mean_m": 0.001}
    return Evidence(
        pd.DataFrame({"name": ["P1-0", "P2"]}),
        pd.DataFrame([pose_row | (pose or {})]),
        pd.DataFrame([mount_row | (mount or {})]),
        pd.DataFrame([row | (alternating or {})]),
        pd.DataFrame([summary_row | (summary or {})]),
        cells,
        pd.DataFrame([("remedy", "two more passes at 3 m would do")], columns=["kind", "words"]),
        pd.DataFrame([nothing | (held or {})]),
        pd.DataFrame([bins | {"normalised": 0.3} | one for one in bin_ or [{}]]),
    )


def judged(found):
    return reasons(found, methods(), ADJUSTED)


def test_a_good_session_has_no_reason():
    assert judged(evidence()) == []
    assert reasons(evidence(), methods(), IN_TURN) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"pose": {"ambiguous": True}},
            "'one block higher' fits the laser points nearly as well (9.00 against 10.00 m²)",
        ),
        (
            {"pose": {"ambiguous": True, "rival_agreement_m2": 11.0}},
            "better (11.00 against 10.00 m²); check target.origin",
        ),
        ({"mount": {"ambiguous": True}}, "the soundings fit two ways"),
        ({"mount": {"within": False}}, "no mount within 4.5° and 0.45 m of the coarse one brings the soundings onto"),
        (
            {"mount": {"within": False, "rotation_z_deg": -4.6, "lever_arm_z_m": 0.6}},
            "onto the target; best fits -4.60° in yaw, +0.60 m in lever arm z: mbes.mount is farther off",
        ),
        ({"bin_": [OFF | {"by": "face", "low": 1.0}]}, "residuals go with face: on face P2 the sonar lies +1.0 mm"),
        ({"pose": {"within": False}}, "target.origin or target.azimuth_deg is farther off"),
        (
            {"summary": {"reason": "the data leave 2 directions open"}},
            "no result: the data leave 2 directions open; two more passes at 3 m would do",
        ),
        ({"count": -371}, "only 29 soundings lie on P2"),
        ({"bin_": [OFF]}, "residuals go with angle: between receive angles 20° and 22° the sonar lies +1.0 mm off P2"),
        ({"bin_": [OFF | {"sensor": "laser"}]}, "between elevations 20° and 22° the laser lies"),
        ({"bin_": [OFF | {"by": "distance", "normalised": -3.5}]}, "from 20 to 22 m the sonar lies"),
        ({"bin_": [OFF | {"by": "time"}]}, "for ten seconds (GPS 20) the sonar lies"),
        ({"bin_": [OFF | {"by": "step"}]}, "at a receive angle of 20° the sonar's distance from P2 steps by +1.0 mm"),
        (
            {"bin_": [OFF | {"by": "drift", "sensor": "ins", "family": "turn_z", "mean_m": -0.002, "low": 1.0}]},
            "pass 1, the INS must be wrong there by 0.115° in heading more than in the other passes (3.5",
        ),
        ({"held": {"value": 6e-4}}, "the sound speed: it is +0.06 ± 0.01 % above that recorded"),
        ({"held": {"unknown": "mbes_latency", "value": 0.02}}, "the sonar's clock: its latency is +20.0 ± 0.1 ms more"),
        ({"held": {"unknown": "laser_rotation_y", "value": -0.01}}, "it should be turned by -0.573 ± 0.006° about"),
        ({"held": {"unknown": "wet_H_shift", "value": 0.02}}, "that are horizontal lie higher by +20.0 ± 0.1 mm"),
        ({"summary": {"converged": False}}, "did not converge in 6 steps"),
        ({"bin_": [PASS_3]}, "in pass 3 the sonar lies -12.0 mm off P2 against the other passes (4.0 sigma"),
    ],
)
def test_each_evidence_is_one_reason(change, words):
    found = judged(evidence(**change))
    assert len(found) == 1
    assert words in found[0]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"mount": {"rotation_z_deg": -4.6}}, True),
        ({"mount": {"rotation_z_deg": -4.6, "lever_arm_z_m": 0.6}}, False),
        ({"mount": {}}, False),
        ({"mount": {"rotation_z_deg": -4.6, "ambiguous": True}}, False),
        ({"mount": {"rotation_z_deg": -4.6}, "pose": {"ambiguous": True}}, False),
        ({"mount": {"rotation_z_deg": -4.6}, "pose": {"within": False}}, False),
    ],
)
def test_angles_to_enter_are_told_only_where_nothing_else_is_in_doubt(change, told):
    found = evidence(**change | {"mount": change["mount"] | {"within": False}})
    words = reasons(found, methods(), replace(ADJUSTED, asked="; enter these angles"))
    assert any("; enter these angles" in one for one in words) == told
    assert any("no mount within" in one for one in words)


def test_where_labels_are_in_doubt_nothing_else_is_judged():
    doubtful = evidence(pose={"ambiguous": True}, summary={"converged": False}, bin_=[PASS_3])
    assert len(reasons(doubtful, methods(), replace(ADJUSTED, limits=Verdict(max_sigma_deg=1e-6)))) == 1


def test_sigmas_are_held_to_both_limits():
    wide, narrow = (replace(ADJUSTED, limits=Verdict(max_sigma_deg=d, max_sigma_m=m)) for d, m in LIMITS)
    assert reasons(evidence(), methods(), wide) == []
    found = reasons(evidence(), methods(), narrow)
    assert [reason.split(" is ")[0] for reason in found] == ["total sigma of yaw", "total sigma of lever arm y"]


@pytest.mark.parametrize(
    ("alternating", "patent", "words"),
    [
        ({"reason": "the sonar sees no horizontal face"}, {}, "patent_alternating has no result: the sonar sees"),
        ({"converged": False}, {}, "did not converge in 9 turns"),
        ({}, {"rotation_vector_deg": [0.8, -0.8, 0.86]}, "differs from the adjustment by +0.0600° in yaw"),
        ({}, {"lever_arm_m": [0.1, 0.094, 0.1]}, "differs from the adjustment by -0.0060 m in lever arm y"),
    ],
)
def test_a_patent_form_as_the_result_is_held_to_the_adjustment(alternating, patent, words):
    one = evidence(alternating=alternating)
    assert reasons(one, methods(**patent), ADJUSTED) == []
    found = reasons(one, methods(**patent), IN_TURN)
    assert len(found) == 1
    assert words in found[0]


def test_both_sensors_off_together_is_the_ins():
    for laser, expected in ((-0.011, "and the laser -11.0 mm off P2"), (0.011, "sonar lies -12.0 mm off P2")):
        (reason,) = judged(evidence(bin_=[PASS_3, PASS_3 | {"sensor": "laser", "mean_m": laser, "normalised": -2.0}]))
        assert expected in reason
        assert ("drift of the INS" in reason) == (laser < 0)


def groups(**changes):
    row = {"group": "mbes_horizontal", "count": 1000, "variance_factor": 1.0, "cut": 0}
    return pd.DataFrame([row | changes])


FOUND = {"offset_m": [0.0, 0.05, -0.09], "tilt_deg": [0.05, -0.05]}


@pytest.mark.parametrize(
    ("change", "pose", "words"),
    [
        ({}, {}, None),
        ({"variance_factor": 1.99}, {}, None),
        ({"variance_factor": 2.01}, {}, "soundings on horizontal faces scatter 1.4 times as much"),
        ({"variance_factor": 0.49}, {}, "less noise"),
        ({"group": "ins_white", "variance_factor": 0.01}, {}, None),
        ({"group": "ins_white", "variance_factor": 4.1}, {}, "from record to record 2.0 times as much"),
        ({"group": "ping", "variance_factor": 3.9}, {}, None),
        ({"group": "ping", "variance_factor": 9.0}, {}, "whole pings scatter 3.0 times"),
        ({"cut": 10}, {}, None),
        ({"cut": 11}, {}, "1.1 % of soundings on horizontal faces were cut"),
        ({}, {"offset_m": [0.0, -0.11, 0.0]}, "check laser.mount"),
        ({}, {"tilt_deg": [0.0, 0.11]}, "out of plumb by +0.00° and +0.11°"),
    ],
)
def test_what_wants_to_be_looked_at(change, pose, words):
    none = pd.DataFrame([], columns=["kind", "words"])
    found = warnings(groups(**change), FOUND | pose, none, SIGMA)
    assert len(found) == (0 if words is None else 1)
    assert words is None or words in found[0]


def test_a_gap_in_the_geometry_is_said_with_what_it_comes_to():
    gaps = pd.DataFrame([("gap", "one pass alone"), ("remedy", "two more")], columns=["kind", "words"])
    (words,) = warnings(groups(), FOUND, gaps, SIGMA)
    assert words == "one pass alone; total sigmas are up to 0.006° (yaw) and 0.6 mm (lever arm y)"
    assert warnings(groups(), FOUND, gaps, None) == ["one pass alone"]


def test_both_sides_of_four_sigmas():
    """Noise and what is considered count together."""
    near, far = ({"value": value, "sigma": 3e-4, "considered": 4e-4} for value in (1.99e-3, 2.01e-3))
    assert judged(evidence(held=near)) == []
    assert len(judged(evidence(held=far))) == 1


@pytest.mark.parametrize(("value", "far"), [(1.99e-3, False), (2.01e-3, True)])
def test_what_was_freed_and_is_not_as_the_session_says(value, far):
    found = judged(evidence(held={"unknown": "mbes_latency", "estimated": True, "value": value} | CLOCK))
    assert len(found) == far
    assert not far or "its latency is +2.0 ± 0.3 ms more than mbes.latency_s says: the mount holds with" in found[0]


def test_what_was_freed_where_there_is_no_result():
    nothing = {"unknown": "mbes_latency", "estimated": True, "considered": 4e-4, "value": 0.0, "sigma": np.nan}
    assert judged(evidence(held=nothing)) == []


def test_of_several_causes_the_most_telling_is_named():
    sigmas = (("mbes_range", 1e-3), ("laser_range", 1e-4))
    one, other = ({"unknown": name, "estimated": False, "considered": 0.0, "sigma": sigma} for name, sigma in sigmas)
    both = replace(evidence(), freed=pd.DataFrame([one | {"value": 0.01}, other | {"value": 0.002}]))
    (reason,) = judged(both)
    assert "20 sigma): the laser's ranges: they should be +2.0 ± 0.1 mm longer; 1 other" in reason


def test_a_pass_that_one_sensor_missed_is_said():
    rows = [(0, 9000, 400), (1, 0, 0), (2, 8000, 0), (5, 8000, 0), (6, 0, 300)]
    passes = [{"pass": k, "laser_points": laser, "soundings": sonar} for k, laser, sonar in rows]
    sonar, laser = one_eyed(passes)
    assert sonar.startswith("passes 2, 5: the laser saw the target, and there are no soundings on it")
    assert laser.startswith("pass 6: the sonar saw")
    assert one_eyed(passes[:2]) == []


def test_an_ins_that_is_conceded_no_drift_is_looked_at_first():
    still = replace(ADJUSTED, drift_doubt=drift_doubt(drift(1.0), Drift(**dict.fromkeys(FIGURES, 0.0))))
    assert reasons(evidence(), methods(), still) == []
    found = reasons(evidence(bin_=[OFF], held={"value": 6e-4}), methods(), still)
    assert found[1].startswith("ins.drift concedes the INS no drift at all")
    assert found[2].startswith("likely cause of residuals (6 sigma)")
    assert len(judged(evidence(bin_=[PASS_3]))) == 1


def drift(sigmas):
    """As large as that in every component, of knots here and there."""
    values = {"x": 0.015, "y": 0.015, "z": 0.02}, {"x": 0.01, "y": 0.01, "z": 0.03}
    columns = {f"{axis}_target_m": value for axis, value in values[0].items()}
    columns |= {f"turn_{axis}_target_deg": value for axis, value in values[1].items()}
    return pd.DataFrame([{name: sign * sigmas * value for name, value in columns.items()} for sign in (1, -1, -1)])


@pytest.mark.parametrize(("sigmas", "far"), [(1.19, False), (1.21, True)])
def test_an_ins_that_drifts_farther_than_its_figures(sigmas, far):
    doubt = drift_doubt(drift(sigmas), Drift())
    assert doubt.startswith(DRIFTS) if far else doubt == ""
    vertical = drift_doubt(drift(sigmas), Drift(**dict.fromkeys(FIGURES, 0.0) | {"vertical_m": 0.02}))
    assert bool(vertical) == far
    assert drift_doubt(drift(sigmas).iloc[:0], Drift()) == ""


def table(*rows):
    return pd.DataFrame([{"by": by, "normalised": normalised} for by, normalised in rows])


def test_all_variables_have_one_limit():
    """Šidák over all three rows, not over those of a variable."""
    limit = joint_limit(3, LEVEL)
    assert limit == pytest.approx(3.588, abs=0.001)
    just, beyond = 0.999 * limit, -1.001 * limit
    angle, face = pattern_tests(table(("angle", just), ("angle", 0.0), ("face", beyond)), LEVEL)
    assert angle == {"by": "angle", "statistic": just, "dof": 2, "limit": limit, "passed": True}
    assert (face["statistic"], face["dof"], face["passed"]) == (-beyond, 1, False)


def test_the_consistency_of_passes_is_of_residuals_and_of_drift():
    agreed = passes_test(table(("pass", 1.0), ("drift", -3.0), ("face", 9.0)), LEVEL)
    assert (agreed["statistic"], agreed["dof"], agreed["passed"]) == (3.0, 2, True)
    assert agreed["limit"] == joint_limit(3, LEVEL)
    assert not passes_test(table(("pass", 1.0), ("drift", -3.7)), LEVEL)["passed"]
    alone = passes_test(table(("face", 9.0)), LEVEL)
    assert (alone["statistic"], alone["dof"], alone["passed"]) == (0.0, 0, True)


def test_what_lies_farthest_off_comes_first():
    """A step of ten millimetres shows by angle as well: named once, by what shows it best."""
    bins = [{"normalised": 6.0}, {"by": "step", "normalised": -15.0, "mean_m": -0.0101}, PASS_3 | {"normalised": -5.0}]
    first, second = judged(evidence(bin_=bins))
    assert "steps by -10.1 mm (15.0 sigma beyond 3 mm, limit 3.6)" in first
    assert first.endswith("; residuals by angle lie beyond it too")
    assert second.startswith("the passes do not agree")


@pytest.mark.parametrize(
    ("family", "mean_m", "low", "tilted"),
    [("P3", 0.013, 20.0, True), ("P3", 0.013, 23.0, True), ("P3", 0.013, 24.0, False), ("P3", -0.013, 20.0, False)],
)
def test_steps_to_both_sides_are_transmit_sectors(family, mean_m, low, tilted):
    step = {"by": "step", "normalised": -15.0, "mean_m": -0.014, "family": "P1"}
    other = step | {"family": family, "mean_m": mean_m, "low": low, "normalised": 9.0}
    (reason,) = judged(evidence(bin_=[step, other]))
    assert ("P1 steps by -14.0 mm, and from P3 by +13.0 mm (15.0" in reason) == tilted
    assert ("transmit sectors of different tilt" in reason) == tilted


def test_a_cause_of_all_points_is_told_apart_from_what_is_off_by_itself():
    held = {"value": 6e-4}
    assert "likely cause of residuals (6 sigma)" in judged(evidence(bin_=[OFF], held=held))[1]
    words = "likely cause of residuals, unless the face, step, pass or ping named above is itself the cause (6 sigma)"
    assert words in judged(evidence(bin_=[OFF | {"by": "step"}], held=held))[1]


@pytest.mark.parametrize(
    ("cast", "recorded_m_s", "turn_deg", "words"),
    [
        (((0.0, 1500.0), (5.0, 1501.0)), 1500.0, [0.0, 1.9, 1.0], ["2.1° off"]),
        (((0.0, 1500.0), (5.0, 1501.0)), 1500.0, [0.0, 1.9, 0.5], []),
        (((0.0, 1500.0), (5.0, 1501.0)), 1500.0, None, []),
        (((0.0, 1500.0), (5.0, 1501.0)), 1504.1, None, ["the head recorded 1504.1"]),
        (((0.0, 1500.0), (5.0, 1501.0)), 1503.9, None, []),
        (((0.0, 1500.0), (5.0, 1501.0)), 1496.9, None, ["the head recorded 1496.9"]),
        (((0.0, 1500.0), (5.0, 1501.0)), float("nan"), None, []),
        (None, 1470.0, [0.0, 3.0, 0.7], []),
    ],
)
def test_a_cast_of_other_water_and_rays_bent_with_a_wrong_mount(cast, recorded_m_s, turn_deg, words):
    files = pd.DataFrame({"sound_speed_low_m_s": [recorded_m_s], "sound_speed_high_m_s": [recorded_m_s]})
    found = cast_doubts(Mbes.model_construct(svp=cast), files, {"rotation_vector_deg": turn_deg})
    assert len(found) == len(words)
    assert all(one in said for one, said in zip(words, found, strict=True))
