"""Tables of stages adjust and report: the adjustment, and the calibration with its documents."""

# fmt: off: the tables are laid out by hand
from pipeline.artefacts.columns import (
    BOOL,
    F32,
    F64,
    I16,
    I32,
    I64,
    PASS,
    T_NS,
    TEXT,
    coordinate_columns,
    float32_coordinates,
)
from pipeline.artefacts.schema import Artefact, Column, Document

# --- adjust ----------------------------------------------------------------------------------------------------------
ESTIMATE = Artefact(
    "adjust", "estimate", "table", "every parameter that was estimated",
    (
        Column("unknown", TEXT, "", "rotation_x … lever_arm_z; turn_1, turn_2, shift of surfaces; of adjust.free"),
        Column("value", F64, "rad or m", "estimate (rotation: vector from coarse; surfaces: from the laser's planes)"),
        Column("sigma", F64, "rad or m", "standard deviation from the sensors' and the INS's noise"),
        Column("sigma_total", F64, "rad or m", "the same with the consider parameters"),
        Column("slots_ratio", F64, "1", "mount: variance by the scatter of slots of a second / sigma²; else NaN"),
        Column("slots_dof", F64, "1", "effective number of these slots: slots_ratio scatters as χ² / number"),
    ),
)
COVARIANCE = Artefact(
    "adjust", "covariance", "table", "covariance and correlation of the mount parameters",
    (
        Column("row", TEXT, "", "unknown"), Column("column", TEXT, "", "unknown"),
        Column("covariance", F64, "rad², rad m, m²", "from noise"), Column("correlation", F64, "1", "of noise alone"),
        Column("covariance_total", F64, "rad², rad m, m²", "with the consider parameters"),
    ),
)
GEOMETRY = Artefact(
    "adjust", "geometry", "table", "weaknesses of the passes, and a remedy; empty if the laser is calibrated",
    (
        Column("kind", TEXT, "", "gap or remedy"),
        Column("words", TEXT, "", "the gap or the remedy in words"),
    ),
)
PARTS = Artefact(
    "adjust", "parts", "table", "change of the mount if only a part of the session is used, against the whole",
    (
        Column("part", TEXT, "", "without pass n; first half, second half (of the passes); near passes, far passes; at "
               "unsurveyed walls: without the soundings on a family"),
        Column("passes", TEXT, "", "numbers of the passes that are used"),
        Column("normalised", F64, "1", "normal deviate of all changes together"),
        Column("dof", I64, "1", "number of directions in which the part can differ from the whole"),
        *(
            Column(f"{kind}_{name}", F64, "deg" if name in ("roll", "pitch", "yaw") else "m", words)
            for name in ("roll", "pitch", "yaw", "x", "y", "z")
            for kind, words in (("change", "value of the part less that of the whole"),
                                ("sigma", "standard deviation of the change, with the consider parameters"))
        ),
    ),
)
DRIFT = Artefact(
    "adjust", "drift", "table", "slow errors of the recorded poses, at knots: to be added to the recorded ones",
    (
        T_NS, *coordinate_columns("target"),
        *(Column(f"turn_{axis}_target_deg", F64, "deg", f"about target {axis}") for axis in "xyz"),
    ),
)
DRIFT_FIGURES = Artefact(
    "adjust", "drift_figures", "table", "the drift's figures: as configured, and by data and configured ones together",
    (
        Column("figure", TEXT, "", "horizontal_m, vertical_m, roll_pitch_deg, heading_deg, time_constant_s"),
        Column("configured", F64, "m, deg or s", "by ins.drift or the INS's files"),
        Column("estimated", F64, "m, deg or s", "by the likelihood of the data, with ins.drift_within as prior"),
        Column("sigma_log", F64, "1", "standard deviation of the natural logarithm of estimated (0: not estimated)"),
        Column("deviation", F64, "1",
               "log(estimated / configured) in sigmas of what ins.drift_within allows (0: not estimated)"),
    ),
)
FREED = Artefact(
    "adjust", "freed", "table", "single-parameter test of each additional parameter, and the effect of its error",
    (
        Column("unknown", TEXT, "", "parameter of a sensor, of a family's wet faces, or shift of a face (face_NAME); "
               "surfaces_...: errors in what is known of the surfaces beforehand, without a test"),
        Column("estimated", BOOL, "", "named in adjust.free: value and total sigma are those of the solution"),
        Column("known", BOOL, "", "estimated with its a-priori sigma as prior information"),
        Column("considered", F64, "rad, m, s, 1 or 1/s", "its a-priori sigma"),
        Column("value", F64, "rad, m, s, 1 or 1/s",
               "its estimate from the points alone, without its a-priori sigma (NaN: not determined)"),
        Column("sigma", F64, "rad, m, s, 1 or 1/s", "standard deviation of this estimate"),
        Column("expected", F64, "rad, m, s, 1 or 1/s", "its standard deviation if all a-priori errors hold"),
        Column("strength", F64, "1", "root of the fall of the least sum of squares if it is freed"),
        Column("by_session", F64, "1",
               "strength with the drift as configured, if a parameter or set explains more than any drift (else NaN)"),
        *(
            Column(f"effect_{kind}_{axis}", F64, unit, "change of the mount by an error of one a-priori sigma")
            for kind, unit in (("rotation", "rad"), ("lever_arm", "m")) for axis in "xyz"
        ),
    ),
)
HEAD_EFFECTS = Artefact(
    "adjust", "head_effects", "table", "effects on the mounts of further heads, for each parameter of freed",
    (
        Column("head", TEXT, "", "mbes_2, ..."),
        *(column for column in FREED.columns if column.name == "unknown" or column.name.startswith("effect_")),
    ),
)
SETS = Artefact(
    "adjust", "sets", "table", "joint test of each set of parameters that may all be wrong at once",
    (
        Column("set", TEXT, "", "wet_shifts, wet_turns, wet_bows or mbes_detection"),
        Column("parameters", TEXT, "", "those of its parameters that the points determine, separated by blanks"),
        Column("fall", F64, "1", "fall of the least sum of squares if all are freed"),
        Column("dof", I64, "", "degrees of freedom of the fall"),
        Column("strength", F64, "1", "normal deviate that is as improbable as the fall"),
        Column("by_session", F64, "1",
               "strength with the drift as configured, if a parameter or set explains more than any drift (else NaN)"),
    ),
)
LEFT_OUT = Artefact(
    "adjust", "left_out", "table",
    "unsurveyed faces, heights or squares of them, whose points are left out; faces in doubt",
    (
        Column("family", TEXT, "", "family of faces"),
        Column("why", TEXT, "", "mixed: squares in which many soundings lie off the wall; few: too few soundings; "
               "scatter: they fill the gate; step: they stand off those at other heights; off: the others contradict "
               "them; doubt: one of these is wrong, and all are used"),
        Column("points", I64, "", "number of the sensor's points"),
        Column("sensor", TEXT, "", "laser or mbes"),
        Column("low_m", F64, "m", "height above the water from which on they are left out (-inf: from the lowest)"),
        Column("high_m", F64, "m", "height up to which they are (inf: to the highest)"),
        Column("unknown", TEXT, "", "its parameter that is farthest off"),
        Column("value", F64, "rad or m",
               "by how much, if the other faces are as they are known to be; step: by how much they stand off"),
        Column("sigma", F64, "rad or m", "standard deviation of it"),
        Column("area_m2", F64, "m²", "mixed: area of the squares (else NaN)"),
        Column("share", F64, "1", "mixed: of the face's soundings, those in the squares (else NaN)"),
    ),
)
SURFACES = Artefact(
    "adjust", "surfaces", "table", "the adjusted surfaces, shared by both sensors",
    (
        Column("family", TEXT, "", "P1, P2, P3 or H"),
        *coordinate_columns("target", "1", "normal_"),
        Column("distance_m", F64, "m", "normal · x = distance; H: shift against the design heights"),
        Column("laser_points", I64, "1", "observations"), Column("soundings", I64, "1", "observations"),
    ),
)
GROUPS = Artefact(
    "adjust", "groups", "table", "variance factors of the noise: of families together, of common errors, by family",
    (
        Column("group", TEXT, "",
               "families together: laser, mbes_vertical, mbes_horizontal; common to an epoch: ins_white (laser), ping; "
               "one family: sensor:family"),
        Column("count", I64, "1", "observations; ins_white, ping: epochs"),
        Column("variance_factor", F64, "1", "estimated variance / variance expected from the session's sigmas"),
        Column("scale", F64, "1", "robust scale of residual / its expected sigma, the INS's noise included"),
        Column("cut", I64, "1", "observations whose weight became zero"),
        Column("reduced", I64, "1", "observations whose weight was reduced"),
        Column("sensor", TEXT, "", "laser or mbes"), Column("family", TEXT, "", "P1, P2, P3 or H; else empty"),
        Column("sigma", F64, "1", "standard deviation of the variance factor"),
        Column("patch_m", F64, "m", "by family, at unsurveyed walls: RMS by which patches stand off (roughness)"),
        Column("mean_effect", F64, "1", "sonar, by family: variance of a ping's mean / that of independent beams"),
        Column("slope_effect", F64, "1", "the same of its slope; both are 1 where they are not certainly larger"),
    ),
)
CELLS = Artefact(
    "adjust", "cells", "table", "mean residual of each sensor on each surface in each pass",
    (
        Column("sensor", TEXT, "", "laser or mbes"), Column("family", TEXT, "", "P1, P2, P3 or H"), PASS,
        Column("count", I64, "1", "observations"), Column("mean_m", F64, "m", "weighted mean residual"),
        Column("rms_m", F64, "m", "RMS residual"),
        Column("sigma_mean_m", F64, "m", "standard deviation of the mean, from the scatter of its time slots"),
        Column("normalised", F64, "1", "of the difference from other passes, as in patterns (NaN: too few time slots)"),
        Column("largest", F64, "1", "largest |residual| / its expected sigma, among those with a weight"),
        Column("redundancy", F64, "1", "observations, less a shift and turn in each interval between INS records"),
        Column("variance_factor", F64, "1", "of the scatter within these intervals / that of this sensor and family"),
    ),
)
PATTERNS = Artefact(
    "adjust", "patterns", "table", "mean residuals by one variable at a time, in bins of enough time slots",
    (
        Column("by", TEXT, "",
               "face, angle (2 degrees), distance (1 m), time (10 s); differences: step, height, pass, ping_2 to 4, "
               "drift"),
        Column("sensor", TEXT, "", "laser or mbes; drift: ins"),
        Column("family", TEXT, "", "P1, P2, P3 or H; height: the face; drift: turn_x, turn_y or turn_z, about target "
               "axes"),
        Column("low", F64, "1, deg, m or s",
               "number of the face or pass, lower edge of the bin (time: GPS seconds); step, height: where it is; "
               "ping_n: the remainder of the ping's number divided by n"),
        Column("width", F64, "1, deg, m or s", "of the bin"),
        Column("count", I64, "1", "observations (of two means the fewer); drift: knots"),
        Column("mean_m", F64, "m (drift: rad)",
               "weighted mean residual; step: of the 4 degrees from there on less that of the 4 before; pass, ping_n: "
               "of these less that of all others; drift: the same of the estimated drift"),
        Column("sigma_mean_m", F64, "m (drift: rad)",
               "its standard deviation, from the scatter of time slots; drift: by the figures of ins.drift"),
        Column("dof", F64, "1", "degrees of freedom of this standard deviation"),
        Column("tolerated_m", F64, "m", "tolerance: adjust.test_tolerance_m, more on a rough wall; drift: 0"),
        Column("normalised", F64, "1", "normal deviate of the part beyond the tolerance (drift: of all of it), signed"),
    ),
)
RESIDUALS = Artefact(
    "adjust", "residuals", "table", "residuals of all points, or of evenly taken ones in a long session",
    (
        Column("sensor", TEXT, "", "laser or mbes"), T_NS, PASS,
        Column("face", I16, "1", "number of the face"),
        *float32_coordinates("target"),
        *coordinate_columns("target", "m", "coarse_", F32),
        Column("range_m", F32, "m", "distance from the sensor"),
        Column("angle_deg", F32, "deg", "sonar: across track, starboard +; laser: above the scanner's xy plane"),
        Column("residual_m", F32, "m", "distance from the adjusted surface along its normal (toward the boat, or up)"),
        Column("coarse_residual_m", F32, "m", "the same with the coarse mount (laser: as residual_m)"),
        Column("weight", F32, "1", "robust weight: 1 in full, 0 cut"),
    ),
)
RESIDUAL_BINS = Artefact(
    "adjust", "residual_bins", "table", "mean residuals along one variable at a time, of the points in residuals",
    (
        Column("sensor", TEXT, "", "laser or mbes"), Column("family", TEXT, "", "P1, P2, P3 or H"),
        PASS,
        Column("by", TEXT, "", "angle (degrees), range (m) or time (s)"),
        Column("low", F64, "deg, m or s", "lower edge of the bin; time: GPS seconds since 1980-01-06"),
        Column("width", F64, "deg, m or s", "of the bin"),
        Column("count", I64, "1", "points"),
        Column("mean_m", F64, "m", "mean residual, robust weights"),
        Column("rms_m", F64, "m", "RMS residual, robust weights"),
    ),
)
RESIDUAL_MAP = Artefact(
    "adjust", "residual_map", "table", "mean residuals by square cell of each face, of the points in residuals",
    (
        Column("sensor", TEXT, "", "laser or mbes"), Column("face", I16, "1", "number of the face"),
        *float32_coordinates("target"),
        Column("size_m", F64, "m", "side of the cell whose centre x, y, z is"),
        Column("count", I64, "1", "points"),
        Column("mean_m", F64, "m", "mean residual, robust weights"),
        Column("rms_m", F64, "m", "RMS residual, robust weights"),
    ),
)
ADJUST_SUMMARY = Artefact(
    "adjust", "summary", "table", "the adjustment as a whole (one row)",
    (
        Column("converged", BOOL, "", "the step became negligible"), Column("iterations", I32, "1", "steps"),
        Column("observations", I64, "1", "observations"), Column("redundancy", F64, "1", "observations - unknowns"),
        Column("sigma0", F64, "1", "root of the variance factor over all groups, session sigmas"),
        Column("between", F64, "1", "variance between epochs / expected from all noise: 1 if epochs and sensors agree"),
        Column("between_dof", F64, "1", "its degrees of freedom"),
        Column("condition", F64, "1", "condition number of the scaled normal matrix"),
        Column("rank_deficiency", I32, "1", "directions of the parameters that the data do not determine"),
        Column("weakest", TEXT, "", "the two mount parameters with the strongest correlation, in words"),
        Column("rival_strength", F64, "1", "root of the excess of another minimum's sum of squares; NaN: none"),
        Column("rival_yaw_deg", F64, "deg", "its mount less the result's, rotation about z"),
        Column("rival_lever_arm_y_m", F64, "m", "the same, lever arm y"),
        Column("test_statistic", F64, "1", "consistency of passes: largest |normalised| in patterns by pass or drift"),
        Column("test_dof", I32, "1", "number of these rows"),
        Column("test_limit", F64, "1", "limit of it at the test's level, for all rows of patterns together"),
        Column("test_passed", BOOL, "", "statistic <= limit"),
        Column("reason", TEXT, "", "why there is no result; empty if there is one"),
    ),
)

# --- report ----------------------------------------------------------------------------------------------------------
CALIBRATION = Artefact(
    "report", "calibration", "table", "mount by method: totals that replace the coarse mount, and corrections",
    (
        Column("method", TEXT, "", "patent_sequential, patent_alternating, patent_literal, adjustment"),
        Column("parameter", TEXT, "", "roll, pitch, yaw, x, y, z"),
        Column("unit", TEXT, "", "deg or m"),
        Column("coarse", F64, "deg or m", "mount as configured"), Column("total", F64, "deg or m", "calibrated mount"),
        Column("change", F64, "deg or m", "total - coarse: the difference of the mount's settings"),
        Column("correction", F64, "deg or m", "rotation vector (about the same body axis) or lever arm correction"),
        Column("sigma", F64, "deg or m", "standard deviation of the correction"),
        Column("sigma_random", F64, "deg or m", "standard deviation of the calibrated mount's setting, from noise"),
        Column("sigma_total", F64, "deg or m", "the same with the consider parameters"),
        Column("low_95", F64, "deg or m", "lower end of the 95 % interval by sigma_total"),
        Column("high_95", F64, "deg or m", "upper end of the 95 % interval"),
    ),
)
CLOSING = Artefact(
    "report", "closing", "table", "agreement of the sonar's planes with the laser's, over all passes, with each mount",
    (
        Column("mount", TEXT, "", "coarse, patent_sequential, patent_alternating, patent_literal, adjustment"),
        Column("plane", TEXT, "", "P1, P2 or P3"),
        Column("angle_deg", F64, "deg", "between the two sensors' normals"),
        Column("distance_m", F64, "m", "of the soundings' centroid from the laser's plane, + toward the boat"),
        Column("rms_m", F64, "m", "RMS distance of the soundings from their own plane"),
        Column("soundings", I64, "1", "number of them"),
        Column("laser_points", I64, "1", "number of them"),
    ),
)

CALIBRATION_JSON = Document("report", "calibration.json")
CALIBRATION_YAML = Document("report", "calibration.yaml")
