"""Tables of stages segment and fit_planes: the target, the points on its faces, and their planes."""

# fmt: off: the tables are laid out by hand
from pipeline.artefacts.columns import (
    BOOL,
    COUNTS,
    F32,
    F64,
    FLOATS,
    I16,
    I64,
    MOUNT_CORRECTION,
    PASS,
    T_NS,
    TEXT,
    coordinate_columns,
    float32_coordinates,
)
from pipeline.artefacts.schema import Artefact, Column

# --- segment ---------------------------------------------------------------------------------------------------------
FACES = Artefact(
    "segment", "faces", "table", "the target's faces by design, in the target frame",
    (
        Column("face", I16, "1", "number of the face"),
        Column("name", TEXT, "", "P2, P1-0 … (slanted), P1-0-top, P1-0-bottom …, or as the pool's config has it"),
        Column("family", TEXT, "", "faces parallel at known distances: P1, P2, P3 (one plane each), H (horizontal) …"),
        Column("sense", F64, "1", "+1: its normal is its family's; -1: the opposite"),
        Column("offset_m", F64, "m", "from the family's plane, along the family's normal"),
        Column("one_plane", BOOL, "", "no face of the family stands off its plane"),
        *coordinate_columns("target", "1", "normal_"),
        Column("distance_m", F64, "m", "normal · x = distance on the face"),
        Column("vertices_target_m", FLOATS, "m", "corners, x y z one after another"),
    ),
)
WATER_LEVELS = Artefact(
    "segment", "water_levels", "table", "the water's level in each pass",
    (
        PASS,
        Column("level_m", F64, "m", "height of the water, target frame, mean over the pass"),
        Column("ins_m", F64, "m", "height of the INS, target frame, mean over the pass"),
    ),
)
TARGET_POSE = Artefact(
    "segment", "target_pose", "table", "the target as the laser sees it, relative to the pool frame (one row)",
    (
        Column("R_target_from_pool", FLOATS, "1", "rotation matrix, row by row"),
        *coordinate_columns("pool", "m", "origin_"),
        Column("azimuth_correction_deg", F64, "deg", "true azimuth minus configured azimuth, clockwise +"),
        Column("tilt_x_deg", F64, "deg", "target tilted about its x axis (not applied: a check)"),
        Column("tilt_y_deg", F64, "deg", "target tilted about its y axis (not applied: a check)"),
        Column("sigma_x_m", F64, "m", "standard deviation"), Column("sigma_y_m", F64, "m", "standard deviation"),
        Column("sigma_z_m", F64, "m", "standard deviation"),
        Column("sigma_azimuth_deg", F64, "deg", "standard deviation"),
        Column("sigma_tilt_x_deg", F64, "deg", "standard deviation"),
        Column("sigma_tilt_y_deg", F64, "deg", "standard deviation"),
        Column("rms_m", F64, "m", "RMS distance of the laser points used from the model"),
        Column("points", I64, "1", "laser points used"),
        Column("agreement_m2", F64, "m²", "upright dry faces: area seen, less area missed though looked at"),
        Column("rival_agreement_m2", F64, "m²", "of the best rival pose: the same less the margin over it"),
        Column("rival", TEXT, "", "which rival pose that is"),
        Column("ambiguous", BOOL, "", "true: the rival agrees with the points nearly as well, or better"),
        Column("gate_m", F64, "m", "largest distance from a face at which a laser point was labelled"),
        Column("within", BOOL, "", "false: no pose within the search limits was found"),
    ),
)
PROVISIONAL_MOUNT = Artefact(
    "segment", "provisional_mount", "table", "mount found for labelling alone; nothing later starts from it (one row)",
    (
        *MOUNT_CORRECTION,
        Column("scale_m", F64, "m", "robust scale of the soundings' distances from their faces"),
        Column("gate_m", F64, "m", "largest distance from a face at which a sounding was labelled"),
        Column("score", F64, "1", "robust share of soundings explained by the model, less the share behind it"),
        Column("rival_score", F64, "1", "the same for the best other solution (another block)"),
        Column("ambiguous", BOOL, "", "true: another solution explains the soundings nearly as well"),
        Column("within", BOOL, "", "false: no mount within the search limits was found"),
        Column("label_change", F64, "1", "share of a sample's labels that the last adjustment changed; NaN: none did"),
    ),
)
EDGE_WEIGHT = Column("edge_weight", F32, "1", "weight by the distance from edges: 0 at the limits, 1 beyond the ramp")
LASER_LABELLED = Artefact(
    "segment", "laser_labelled", "stream", "laser points on the target's dry faces",
    (
        T_NS, PASS,
        Column("face", I16, "1", "number of the face"),
        *float32_coordinates("laser"), *float32_coordinates("target"),
        Column("cos_incidence", F32, "1", "|cosine| of the angle between ray and the face's normal"),
        EDGE_WEIGHT,
    ),
)
SOUNDINGS_LABELLED = Artefact(
    "segment", "soundings_labelled", "stream", "soundings on the target's wet faces",
    (
        T_NS, PASS,
        Column("ping", I64, "1", "ping number as recorded"),
        Column("beam", I16, "1", "beam number"),
        Column("face", I16, "1", "number of the face"),
        *float32_coordinates("mbes"),
        EDGE_WEIGHT,
    ),
)
SEGMENT_COUNTS = Artefact("segment", "counts", "table", "points labelled and left out, by reason", COUNTS)

# --- fit_planes ------------------------------------------------------------------------------------------------------
PLANES = Artefact(
    "fit_planes", "planes", "table", "planes fitted with errors in all coordinates (soundings: with the coarse mount)",
    (
        Column("sensor", TEXT, "", "laser or mbes"),
        PASS,
        Column("plane", TEXT, "", "a face, a family (P1, P2, P3) or P4 = P1 x P2 (normal only)"),
        *coordinate_columns("target", "1", "normal_"),
        Column("distance_m", F64, "m", "normal · x = distance"),
        *coordinate_columns("target", "m", "centroid_"),
        Column("count", I64, "1", "points"),
        Column("rms_m", F64, "m", "RMS distance of the points from the plane"),
        Column("eigenvalues_m2", FLOATS, "m²", "of the centred scatter matrix / count, ascending"),
        Column("tangents", FLOATS, "1", "unit vectors t1, t2 along which the covariance turns the normal"),
        Column("covariance", FLOATS, "rad², rad m, m²", "3 x 3 of (turn along t1, along t2, distance at the centroid)"),
    ),
)
SOUNDING_MOMENTS = Artefact(
    "fit_planes", "sounding_moments", "table", "second moments from which any mount's planes follow",
    (
        PASS,
        Column("face", I16, "1", "number of the face"),
        Column("count", I64, "1", "soundings"),
        Column("moments", FLOATS, "m², m, 1", "40 x 40, row by row: products of the lifted coordinates, summed"),
    ),
)
