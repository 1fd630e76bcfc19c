"""Evidence of every reason to reject a result, with the reason's code and words."""

from typing import Any

from pipeline.report.reason_codes import ReasonCode
from tests.support.evidence import (
    OFF,
    PASS_3,
)

REASONS: list[tuple[dict[str, Any], ReasonCode, str]] = [  # evidence, code, words
    (
        {"pose": {"ambiguous": True}},
        ReasonCode.AMBIGUOUS_TARGET_POSE,
        "'one block higher' fits the laser points nearly as well (9.00 against 10.00 m² of its faces seen, those "
        "missed deducted); let the laser see the wall's",
    ),
    (
        {"pose": {"ambiguous": True, "rival_agreement_m2": 11.0}},
        ReasonCode.AMBIGUOUS_TARGET_POSE,
        "better (11.00 against 10.00 m² of its faces seen, those missed deducted); check target.origin",
    ),
    (
        {"pose": {"ambiguous": True, "rival_agreement_m2": 11.0, "rival": "left and right exchanged"}},
        ReasonCode.AMBIGUOUS_TARGET_POSE,
        "; check the target's left and right first, then target.origin",
    ),
    (
        {"pose": {"within": False}},
        ReasonCode.TARGET_BEYOND_SEARCH,
        "no pose of the target within the search limits fits the laser points: target.origin or target.azimuth_deg is "
        "farther off",
    ),
    (
        {"mount": {"within": False}},
        ReasonCode.MOUNT_BEYOND_SEARCH,
        "no mount within 4.5° and 0.45 m of the coarse one (1.5 times segment.search_mount_deg = 3 and "
        "search_mount_m = 0.3) brings the soundings onto the target: mbes.mount is farther off than that",
    ),
    (
        {"mount": {"within": False, "rotation_z_deg": -4.6, "lever_arm_z_m": 0.6}},
        ReasonCode.MOUNT_BEYOND_SEARCH,
        "onto the target; best fits -4.60° in yaw, +0.60 m in lever arm z: mbes.mount is farther off",
    ),
    ({"mount": {"ambiguous": True}}, ReasonCode.AMBIGUOUS_MOUNT, "the soundings fit two ways (score 0.100 against 0."),
    (
        {"summary": {"rival_strength": 4.9, "rival_yaw_deg": 3.4, "rival_lever_arm_y_m": -0.315}},
        ReasonCode.AMBIGUOUS_MOUNT,
        "two mounts fit the soundings nearly as well: the other's yaw differs by +3.40°, its lever arm y by -315 mm "
        "(strength 4.9; 5 tells them apart)",
    ),
    (
        {"summary": {"reason": "the data leave 2 directions open"}},
        ReasonCode.NO_RESULT,
        "the adjustment has no result: the data leave 2 directions open; two more passes at 3 m would do",
    ),
    ({"summary": {"converged": False}}, ReasonCode.NOT_CONVERGED, "the adjustment did not converge in 6 steps"),
    (
        {"rms_m": 0.06},
        ReasonCode.NOISE_CUT_BY_GATE,
        "soundings on P2 scatter by 45 mm, and those more than 80 mm off its faces are not used",
    ),
    (
        {"value": [-0.15, 0.0, 0.07, -0.44, 0.1, 1.694]},
        ReasonCode.MOUNT_FAR_FROM_COARSE,
        "the adjustment took the mount farther from the coarse one than 4.5° and 0.45 m: -8.6° in pitch, +1.69 m in "
        "lever arm z. Measure this again. If the coarse mount was right, a wall",
    ),
    ({"count": -371}, ReasonCode.TOO_FEW_SOUNDINGS, "too few soundings lie on P2 to trust (29): sail so that the"),
    (
        {"freed": {"unknown": "rotation_z", "value": -0.0523, "sigma": 2e-3, "expected": 9e-3}},
        ReasonCode.COARSE_MOUNT_CONTRADICTED,
        "the points contradict the coarse mount: by them it should be turned by -3.0 ± 0.1° about body z (yaw), 5.8 "
        "times what its sigma and noise allow; what rests on it is wrong, too: check it, or state how uncertain it is",
    ),
    (
        {"freed": {"unknown": "lever_arm_x", "value": 0.3, "sigma": 0.02, "expected": 0.054}},
        ReasonCode.COARSE_MOUNT_CONTRADICTED,
        "by them it should be moved by +300 ± 20 mm along body x, 5.6 times what",
    ),
    (
        {"freed": {"unknown": "mbes_latency", "estimated": True, "value": 2.01e-3, "sigma": 3e-4, "expected": 5e-4}},
        ReasonCode.ESTIMATE_OFF_SETTINGS,
        "adjust.free found the sonar's clock: its latency is +2.0 ± 0.3 ms more than mbes.latency_s says: the mount "
        "is valid only with that value; correct it, in the settings and in the survey, and run again",
    ),
    (
        {"patterns": [PASS_3]},
        ReasonCode.PASSES_DISAGREE,
        "the passes do not agree: in pass 3 the sonar lies -12.0 mm off P2 against the other passes (4.0 sigma beyond "
        "3 mm, limit 3.3); likely the sonar's clock, the sound speed, or a bracket that moved",
    ),
    (
        {"patterns": [OFF | {"by": "drift", "sensor": "ins", "family": "turn_z", "mean_m": -0.002, "low": 1.0}]},
        ReasonCode.INS_DRIFT_BETWEEN_PASSES,
        "for both sensors to fit in pass 1, the INS must be wrong there by 0.115° in heading more than in the other "
        "passes (3.5 times the drift that is allowed, limit 3.3)",
    ),
    (
        {"patterns": [OFF | {"by": "face", "low": 1.0}]},
        ReasonCode.RESIDUALS_BY_FACE,
        "residuals go with face: on face P2 the sonar lies +1.0 mm off P2 (3.5 sigma",
    ),
    (
        {"patterns": [OFF]},
        ReasonCode.RESIDUALS_BY_ANGLE,
        "residuals go with angle: between receive angles 20° and 22° the sonar lies +1.0 mm off P2",
    ),
    (
        {"patterns": [OFF | {"sensor": "laser"}]},
        ReasonCode.RESIDUALS_BY_ANGLE,
        "residuals go with angle: between elevations 20° and 22° the laser lies",
    ),
    (
        {"patterns": [OFF | {"by": "height", "low": -0.3}]},
        ReasonCode.RESIDUALS_BY_HEIGHT,
        "residuals go with height: 0.3 m below the water the sonar's distance from face P2 steps by +1.0 mm, above "
        "less below (3.5 sigma beyond 3 mm, limit 3.3); likely echoes by way of the water's surface",
    ),
    (
        {"patterns": [OFF | {"by": "height", "low": 0.2, "sensor": "laser"}]},
        ReasonCode.RESIDUALS_BY_HEIGHT,
        "residuals go with height: 0.2 m above the water the laser's distance from face P2 steps by +1.0 mm, above "
        "less below (3.5 sigma beyond 3 mm, limit 3.3); likely drops",
    ),
    (
        {"patterns": [OFF | {"by": "height", "low": 3.8, "sensor": "laser"}]},
        ReasonCode.RESIDUALS_BY_HEIGHT,
        "residuals go with height: 3.8 m above the water the laser's distance from face P2 steps by +1.0 mm, above "
        "less below (3.5 sigma beyond 3 mm, limit 3.3); likely an edge beside these points",
    ),
    (
        {"patterns": [OFF | {"by": "step"}]},
        ReasonCode.RESIDUALS_STEP,
        "residuals go with angle: at a receive angle of 20° the sonar's distance from P2 steps by +1.0 mm",
    ),
    (
        {"parts": {"normalised": 4.5, "change_x": 0.0031}},
        ReasonCode.PARTS_DISAGREE,
        "without pass 2, x would be another by 3.1 mm ± 1.0 mm (4.5 sigma over all parameters): something changed",
    ),
    (
        {"parts": {"part": "without the soundings on north", "normalised": 4.5, "change_x": 3.1e-3}},
        ReasonCode.PARTS_DISAGREE,
        "without the soundings on north, x would be another by 3.1 mm ± 1.0 mm (4.5 sigma over all parameters): that",
    ),
    (
        {"parts": {"part": "near passes", "normalised": 4.5, "change_yaw": -0.05}},
        ReasonCode.PARTS_DISAGREE,
        "from the near passes alone yaw would be another by -0.050° ± 0.010°",
    ),
    (
        {"patterns": [OFF | {"by": "ping_2", "low": 1.0}]},
        ReasonCode.RESIDUALS_BY_PING,
        "residuals go with pings: in one ping of 2 (those whose number divided by 2 leaves 1) the sonar lies +1.0 mm",
    ),
    (
        {"patterns": [OFF | {"by": "distance", "normalised": -3.5}]},
        ReasonCode.RESIDUALS_BY_DISTANCE,
        "residuals go with distance: from 20 to 22 m the sonar lies",
    ),
    (
        {"patterns": [OFF | {"by": "time"}]},
        ReasonCode.RESIDUALS_BY_TIME,
        "residuals go with time: for ten seconds (GPS 20) the sonar lies",
    ),
    (
        {"freed": {"value": 6e-4}},
        ReasonCode.SUSPECTED_CAUSE,
        "likely cause of residuals (strength 6): the sound speed: it is +0.06 ± 0.01 % above that recorded",
    ),
    (
        {"freed": {"unknown": "mbes_latency", "value": 0.02}},
        ReasonCode.SUSPECTED_CAUSE,
        "the sonar's clock: its latency is +20.0 ± 0.1 ms more",
    ),
    (
        {"freed": {"unknown": "projector_z", "value": 0.119, "sigma": 0.0017}},
        ReasonCode.SUSPECTED_CAUSE,
        "the transmitter sits higher than mbes.projector_offset_m says (null: where the receiver is), by 119 ± 2 mm in",
    ),
    (
        {"freed": {"unknown": "projector_x", "value": -0.0204, "sigma": 0.0008}},
        ReasonCode.SUSPECTED_CAUSE,
        "farther to port than mbes.projector_offset_m says (null: where the receiver is), by 20.4 ± 0.8 mm in",
    ),
    (
        {"freed": {"unknown": "mbes_incidence", "value": -0.01, "sigma": 3e-4}},
        ReasonCode.SUSPECTED_CAUSE,
        "the sonar's ranges go with the angle at which it sees a face: at 45° they should be -10.0 ± 0.3 mm longer",
    ),
    (
        {"freed": {"unknown": "laser_incidence", "value": 0.01, "sigma": 3e-4}},
        ReasonCode.SUSPECTED_CAUSE,
        "the laser's ranges go with the angle at which it sees a face: at 45° they should be +10.0 ± 0.3 mm longer",
    ),
    (
        {"freed": {"unknown": "mbes_level_range", "value": -0.03, "sigma": 2e-3}},
        ReasonCode.SUSPECTED_CAUSE,
        "the sonar's ranges on horizontal faces: they should be -30 ± 2 mm longer; what it hears there may be",
    ),
    (
        {"freed": {"unknown": "steering_speed", "value": 0.002}},
        ReasonCode.SUSPECTED_CAUSE,
        "the sound speed at the arrays, which steers the beams: it is +0.20 ± 0.01 % above that of the water",
    ),
    (
        {"freed": {"unknown": "laser_rotation_y", "value": -0.01}},
        ReasonCode.SUSPECTED_CAUSE,
        "laser.mount: it should be turned by -0.573 ± 0.006° about body y (roll of the boat)",
    ),
    (
        {"freed": {"unknown": "wet_H_shift", "value": 0.02}},
        ReasonCode.SUSPECTED_CAUSE,
        "the target: its wet faces that are horizontal lie higher by +20.0 ± 0.1 mm; check its shape",
    ),
    (
        {"left_out": [{"why": "doubt"}]},
        ReasonCode.FACES_IN_DOUBT,
        "below the water the faces contradict one another. It may be this: north stands there 94 ± 9 mm farther toward",
    ),
]
