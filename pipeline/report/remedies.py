"""What each reason and warning of a verdict mostly comes from, and what to do: for the documents and the report.

The words of a reason in calibration.json say what was found in this session. These say what such a finding usually
means, so that a crew can begin to look. A test holds this table to the list of codes.
"""

from dataclasses import dataclass

from pipeline.report.reason_codes import ReasonCode as Code


@dataclass(frozen=True)
class Remedy:
    """The usual causes of a reason or warning, and what to do; each in whole sentences."""

    cause: str
    remedy: str


REMEDIES: dict[Code, Remedy] = {
    Code.AMBIGUOUS_TARGET_POSE: Remedy(
        "The target one block higher or lower, or with its sides exchanged, fits the laser's points nearly as well. "
        "target.origin is wrong in height by e or 2 e; or a, b, c, e or target.low_side is wrong; or the laser did not "
        "see the upper end of the wall and of the blocks, which alone distinguishes one block from the next.",
        "Check origin, azimuth_deg, a, b, c, e and low_side. Scan the wall's upper edge in every pass.",
    ),
    Code.TARGET_BEYOND_SEARCH: Remedy(
        "target.origin is farther off than 0.5 m, or than 0.4 e in height, target.azimuth_deg than 3°, or a clock is "
        "wrong.",
        "Run poolcal check: it says which. Heights are ellipsoidal, not above sea level.",
    ),
    Code.MOUNT_BEYOND_SEARCH: Remedy(
        "No mount within 1.5 times the search limits (3° and 0.3 m) brings the points onto the target. A sign of the "
        "coarse mount is wrong, two axes are interchanged, the lever arm is off by a block, letters of the target or "
        "units of the soundings are wrong, or the clocks differ.",
        "Run poolcal check. Correct the sign or value that the reason names, and run again.",
    ),
    Code.AMBIGUOUS_MOUNT: Remedy(
        "A second mount fits the soundings nearly as well: mostly the coarse lever arm is a block (2 e) off. Where all "
        "walls look one way, it is the sonar turned to the other side of that way.",
        "Measure the coarse lever arm again, above all z. Where the reason says that all walls look one way, pass a "
        "wall that looks another way, too.",
    ),
    Code.NO_RESULT: Remedy(
        "The data leave some direction of the six values open.",
        "See that the wall, both slanted sides and horizontal faces were seen above and below the water. Sail more "
        "passes. Where the target's pose is ambiguous, correct that first.",
    ),
    Code.NOT_CONVERGED: Remedy(
        "Mostly a wrong target, or a coarse mount beyond its limits; at a wall, a plane that is off below the water.",
        "Check the pool's config. At a wall, strike the plane that the other reasons name, or one after the other, and "
        "run again; or make target.depth_m smaller by half a metre. Do not look at the residuals.",
    ),
    Code.MOUNT_FAR_FROM_COARSE: Remedy(
        "A wall is not where it should be below the water, and too few others hold the mount against it. Or the coarse "
        "mount is wrong by so much.",
        "Measure the coarse mount again. If it was right, no value of the result is: see what is below the water, and "
        "pass more walls, or faces that look another way.",
    ),
    Code.TOO_FEW_SOUNDINGS: Remedy(
        "Fewer than 30 soundings lie on a family of faces.",
        "See that the fan covers the target from the water to its foot: gate, sector, tilt of the head.",
    ),
    Code.NOISE_CUT_BY_GATE: Remedy(
        "The noise on a family of faces is wider than the distance up to which points are labelled. What remains has "
        "its mean where the search put the face, and would draw the result there.",
        "See what lies in front of these faces (ladders, growth, ropes), and whether the sonar's range gate is right.",
    ),
    Code.NO_PARAMETER_ESTIMABLE: Remedy(
        "The laser's passes determine none of its six values better than the coarse mount does.",
        "Survey the target (laser_fit.origin_sigma_m, azimuth_sigma_deg), or sail more passes at other distances.",
    ),
    Code.COARSE_MOUNT_CONTRADICTED: Remedy(
        "Without its coarse mount a value of the laser would differ from it by more than noise and its sigma allow. "
        "What the points determine is right all the same; the other values rest on a survey that is wrong.",
        "Survey the marks again, or give sigmas that are true.",
    ),
    Code.NO_COVARIANCE: Remedy(
        "The normal equations cannot be inverted: the data leave some direction open.",
        "As for no_result.",
    ),
    Code.SIGMA_ABOVE_LIMIT: Remedy(
        "Weak geometry, noise, or a systematic error whose sigma in the settings is large. The reason names the two "
        "largest sources.",
        "Work on the largest source: a cast for the sound speed, a survey of the wet faces (or passes both ways, if "
        "the sensors see both sides), a better laser mount, more passes at other distances. poolcal plan tells what "
        "passes would give.",
    ),
    Code.SOUNDINGS_ABOVE_LIMIT: Remedy(
        "Each value is within its own limit, but all together make soundings more uncertain than verdict.purpose "
        "allows at verdict.depth_m and verdict.swath_deg.",
        "As for sigma_above_limit; or survey with the beams nearer the vertical, or in less depth, and state that.",
    ),
    Code.FACES_IN_DOUBT: Remedy(
        "Below the water one of the walls does not go on as above, by more than as_built says. With few walls any of "
        "them may be the one, or a sensor is wrong.",
        "See what is there, and strike that face (target.strike). Pass more walls: of four or more the program finds "
        "the false one by itself.",
    ),
    Code.ESTIMATE_OFF_SETTINGS: Remedy(
        "A parameter that you named in adjust.free came out significantly different from session.yaml.",
        "Find the cause, enter the value found (mbes.latency_s, laser.latency_s, mbes.sound_speed_m_s), run again, and "
        "use it in the survey too.",
    ),
    Code.PASSES_DISAGREE: Remedy(
        "In one pass a sensor's points lie off a family of faces otherwise than in the others. Both sensors in one "
        "pass: the INS, or a clock. The sonar in all passes, differently by distance: sound speed. From one pass on: "
        "the bracket. The laser everywhere: laser.mount.",
        "Look at adjust/cells.parquet. Correct the cause, or leave the pass out and sail it again.",
    ),
    Code.INS_DRIFT_BETWEEN_PASSES: Remedy(
        "Both sensors fit only if the INS was wrong in one pass by more than its figures say. Either it was, or one "
        "sensor is off in that pass.",
        "Look at the INS's solution in that pass (RTK lost, multipath at the wall), the bracket and the clocks.",
    ),
    Code.PARTS_DISAGREE: Remedy(
        "A part of the session (without a pass, one half, near passes, far passes) gives another mount than the whole. "
        "Something changed under way: the bracket, a clock, the water, the INS's solution.",
        "Calibrate the passes apart to see which of them is wrong.",
    ),
    Code.RESIDUALS_BY_FACE: Remedy(
        "One face stands off its place, or something hangs on it.",
        "Survey it, and give it in as_built.faces.",
    ),
    Code.RESIDUALS_BY_ANGLE: Remedy(
        "The sonar or the laser errs with its angle: sound speed at the arrays, a bent beam pattern, an angle scale.",
        "Measure the sound speed at the head. See the list of hypotheses in the report.",
    ),
    Code.RESIDUALS_STEP: Remedy(
        "Transmit sectors of different tilt, if the step goes to opposite sides on faces that look forward and "
        "backward; else a sector or a detection of its own.",
        "Use the sonar's own file (.kmall, .all), which records the tilt; or one sector.",
    ),
    Code.RESIDUALS_BY_HEIGHT: Remedy(
        "Near the water: echoes by way of the surface, drops, bubbles. Farther from it: an edge beside the points, or "
        "beams wider than session.yaml says.",
        "Check water_level_m, mbes.beam_deg, aperture_m and focused.",
    ),
    Code.RESIDUALS_BY_PING: Remedy(
        "Tilts that change from ping to ping: frequency cycling, dual swath, stabilisation.",
        "Switch them off, or use the sonar's own file, which records the tilt.",
    ),
    Code.RESIDUALS_BY_DISTANCE: Remedy(
        "Sound speed, or a scale of the ranges.",
        "Measure the sound speed at the head, or take a cast.",
    ),
    Code.RESIDUALS_BY_TIME: Remedy(
        "For some seconds both sensors, or one, lie off: a jump of the INS, somebody in front of the target, a wake.",
        "Look at the time that the reason names; leave the pass out if need be.",
    ),
    Code.SUSPECTED_CAUSE: Remedy(
        "One parameter that the settings hold fixed (a clock, the sound speed, ranges, the transmitter's place, the "
        "laser's mount, a face) explains the residuals, with the value that the reason gives. Rivals that explain them "
        "nearly as well are named with it.",
        "Look there first. adjust.free: [NAME] estimates it together with the mount. Do not just enter the value: find "
        "out why it is so.",
    ),
    Code.PATENT_NO_RESULT: Remedy(
        "The form of the patent that result: names has no result.", "Use result: adjustment, the default."
    ),
    Code.PATENT_NOT_CONVERGED: Remedy(
        "The form of the patent that result: names did not converge.", "Use result: adjustment, the default."
    ),
    Code.PATENT_OFF_ADJUSTMENT: Remedy(
        "The form of the patent that result: names differs from the adjustment by more than the limits: the patent's "
        "forms are biased, or have larger noise.",
        "Use result: adjustment, the default.",
    ),
    Code.INS_DRIFT_NOT_GIVEN: Remedy(
        "ins.drift is zero. Drift that is not allowed looks like an error of the laser's mount.",
        "Give the figures of your INS first, or its preset.",
    ),
    Code.INS_DRIFT_ABOVE_SETTINGS: Remedy(
        "The INS drifts farther than its figures say: corrections lost, a filter not aligned, multipath at the wall.",
        "Look at the INS's solution; give true figures in ins.drift.",
    ),
    Code.LABELS_UNSETTLED: Remedy(
        "Labels changed to the last round: the sample of points is small, or could not be adjusted.",
        "Look at the residuals by face; correct other reasons first.",
    ),
    Code.INS_DRIFT_OFF_FIGURES: Remedy(
        "By the data the INS drifts more, or faster, than its figures say. The sigmas count with the figures found.",
        "Look at the INS's solution: corrections, alignment, multipath at the wall.",
    ),
    Code.GEOMETRY_GAP: Remedy(
        "The passes do not separate two values well, or a family of faces was hardly seen.",
        "Sail the passes that the warning names.",
    ),
    Code.NOISE_OFF_SIGMAS: Remedy(
        "The noise is more than 1.4 times, or less than 0.7 times, what session.yaml says. The sigmas of the result "
        "already count with the noise found.",
        "Harmless if the instrument is that good. Else check the target's dimensions and the sonar's settings.",
    ),
    Code.INS_NOISE_ABOVE_SETTINGS: Remedy(
        "The INS's poses jump from record to record more than ins.white says: its filter, or the laser's clock.",
        "Check the INS's output rate and filter, and the synchronisation of the scanner.",
    ),
    Code.PING_NOISE_ABOVE_SETTINGS: Remedy(
        "Whole pings are displaced: jitter of the sonar's clock, or stabilised beams. The sigmas allow for it.",
        "Synchronise the sonar by PPS; switch stabilisation off.",
    ),
    Code.NOISE_DIFFERS_BY_FAMILY: Remedy(
        "On one family of faces the noise is far larger than on the others. The sigmas allow for it.",
        "Look at the residuals of this family: growth, edges, a grazing view.",
    ),
    Code.BEAMS_CORRELATED: Remedy(
        "Neighbouring beams err alike (smoothing, wide beams). The sigmas allow for it.",
        "Switch filters of the sonar off.",
    ),
    Code.SIGMAS_OFF_SCATTER: Remedy(
        "Stretches of one second scatter more than the random sigmas say: errors that neighbouring pings share, or "
        "uneven faces.",
        "Take the random sigmas of the named values as that much larger. More passes help.",
    ),
    Code.MANY_OUTLIERS: Remedy(
        "More than 1 % of a group of observations were cut as outliers.",
        "Look at the residuals of the faces: something hangs there, or an edge is where none should be.",
    ),
    Code.TARGET_OFF_ORIGIN: Remedy(
        "The target was found more than 0.1 m or 0.1° from where it should stand: its survey, or laser.mount.",
        "If it was surveyed better than that, check laser.mount and the datum of target.origin.",
    ),
    Code.WATER_CONTRADICTED: Remedy(
        "Readings at other times than UTC, downward from the quay, or in centimetres; the INS's height without fixed "
        "RTK; or the height of the INS above the water measured wrongly.",
        "Correct target.water_by_time. A wrong level makes points of one medium those of the other, near the water.",
    ),
    Code.TARGET_FOUND: Remedy(
        "Nobody drew or surveyed the target: its faces are planes in the laser's points, continued straight down.",
        "See that each is a wall that goes on below the water, and no fender, ladder or boat; strike the others "
        "(target.strike). Look at the residuals by height, and state in as_built how the walls may stand there.",
    ),
    Code.FACE_LEFT_OUT: Remedy(
        "Below the water a wall is not the plane that it is above: a ledge, a footing, a bulge, growth; or something "
        "stands before it, such as a ladder; or near the water there is splash. The points there are left out, and the "
        "rest is adjusted without them.",
        "See what is there, at low water or with a camera. If the sigmas are too large without it, pass more walls.",
    ),
    Code.UNSEEN_FACE_ERROR: Remedy(
        "With few walls, one that is off below the water by more than `as_built` says looks like another mount. The "
        "text says by how much one could be off unnoticed, and what it would do.",
        "Look at the walls below the water (a diver, a camera, a plumb line, low tide). Pass more walls, in further "
        "directions, or the bottom. If you know how far they may be off, say so: `as_built.offset_sigma_m`.",
    ),
    Code.ROUGH_WALL: Remedy(
        "Mussels, weed, stones, joints: patches of a wall stand off its plane, and every pass sees the same patches. "
        "More soundings on them tell nothing new.",
        "Clean the wall, or pass more and longer walls. More passes of the same wall do not help.",
    ),
    Code.PASS_WITHOUT_SOUNDINGS: Remedy(
        "In a pass the laser saw the target and the sonar has no soundings on it, or none at all: a file of the sonar "
        "may be missing.",
        "See that all of the sonar's files are in the session, that it was recording and that its gate was right.",
    ),
    Code.PASS_WITHOUT_LASER: Remedy(
        "In a pass the sonar saw the target and the laser has no points on it.",
        "See that the scanner was recording.",
    ),
    Code.SOUNDINGS_OUTSIDE_PASSES: Remedy(
        "The first head did not record while a further head saw the target: a file of the first head is missing, or it "
        "was switched on later.",
        "Add the file, or list the head that recorded most first.",
    ),
    Code.LENGTH_OFF_DESIGN: Remedy(
        "By the laser's planes b or e of the target is not what the pool's config says.",
        "Measure the target; correct b or e, or give as_built.faces.",
    ),
    Code.ANGLE_OFF_DESIGN: Remedy(
        "By the laser's planes an angle between faces is not what the pool's config says.",
        "Measure the target; larger angles than some tenths of a degree want a target by its faces.",
    ),
    Code.ERROR_ALLOWED_FOR: Remedy(
        "A systematic error within its a-priori sigma shows in the points, and is allowed for in result and sigmas.",
        "Nothing need be done; look for its cause if you can.",
    ),
    Code.CAST_OF_ANOTHER_TIME: Remedy(
        "The cast was taken more than a day and a half before or after the soundings.", "Take a cast here and now."
    ),
    Code.CAST_OF_ANOTHER_PLACE: Remedy("The cast was taken far away.", "Take a cast here and now."),
    Code.CAST_OFF_HEAD_SPEED: Remedy(
        "The cast disagrees with the sound speed that was recorded at the head.",
        "Check both probes; take a cast here and now.",
    ),
    Code.RAYS_TRACED_WITH_WRONG_MOUNT: Remedy(
        "Rays were traced with a coarse mount that is more than 2° off.",
        "Enter the values found as the coarse mount, and run again.",
    ),
}
