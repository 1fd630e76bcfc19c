"""Every table that a stage writes: owner, name, columns, units.

This is the only place that names a column. ``schema`` carries unit and meaning in each Parquet field's metadata, so
a file explains itself. Kinds: a *table* fits in memory; a *stream* is a folder of parts (see :mod:`pipeline.streams`).
"""

# fmt: off: the tables are laid out by hand
import pyarrow as pa

from pipeline.columns import Artefact as Artefact
from pipeline.columns import Column as Column
from pipeline.columns import Document as Document
from pipeline.columns import Provenance as Provenance
from pipeline.columns import Raw as Raw

I16, I32, I64, F32, F64, TEXT, BOOL = (
    pa.int16(), pa.int32(), pa.int64(), pa.float32(), pa.float64(), pa.string(), pa.bool_()
)
FLOATS = pa.list_(pa.float64())


def _xyz(frame: str, unit: str = "m", stem: str = "", type_: pa.DataType = F64) -> tuple[Column, ...]:
    return tuple(Column(f"{stem}{axis}_{frame}_{unit}", type_, unit, f"{axis} in frame {frame}") for axis in "xyz")


def _near(frame: str) -> tuple[Column, ...]:
    """Coordinates near target or sensor, in single precision: within 16 m that is within half a micrometre."""
    return _xyz(frame, type_=F32)


_ROTATION = tuple(
    Column(f"rotation_{axis}_deg", F64, "deg", f"rotation vector from the coarse mount, body {axis}") for axis in "xyz"
)
_MOUNT_CORRECTION = (
    *_ROTATION, *(Column(f"lever_arm_{axis}_m", F64, "m", f"lever arm correction, body {axis}") for axis in "xyz")
)
_T = Column("t_ns", I64, "ns", "GPS time: nanoseconds since 1980-01-06 00:00:00 GPS, latency removed")
_PASS = Column("pass", I16, "1", "number of the pass, from 0; -1: none (or all of them together)")
_COUNTS = (
    Column("source", TEXT, "", "stream the points came from"),
    Column("reason", TEXT, "", "why they were left out; 'used' counts what went on"),
    Column("count", I64, "1", "number of points"),
)

# --- ingest ----------------------------------------------------------------------------------------------------------
TRAJECTORY = Artefact(
    "ingest", "trajectory", "table", "INS solution, time ascending, unusable records left out",
    (
        _T,
        Column("latitude_rad", F64, "rad", "geodetic latitude, WGS 84"),
        Column("longitude_rad", F64, "rad", "longitude, WGS 84"),
        Column("height_m", F64, "m", "ellipsoidal height"),
        Column("roll_rad", F64, "rad", "starboard down +"),
        Column("pitch_rad", F64, "rad", "bow up +"),
        Column("azimuth_rad", F64, "rad", "heading, clockwise from true north"),
    ),
)
LASER_POINTS = Artefact(
    "ingest", "laser_points", "stream", "laser points as recorded: in the scanner's frame, or in ECEF if georeferenced",
    (_T, *(Column(f"{axis}_m", F64, "m", f"{axis}, frame laser (or ecef)") for axis in "xyz")),
)
SOUNDINGS = Artefact(
    "ingest", "soundings", "stream", "soundings as recorded",
    (
        _T,
        Column("ping", I64, "1", "ping number as recorded"),
        Column("beam", I16, "1", "beam number in the ping, from 0 at port"),
        Column("two_way_time_s", F64, "s", "two-way travel time"),
        Column("angle_rad", F64, "rad", "across-track angle from the array's normal, starboard +"),
        Column("sound_speed_m_s", F64, "m/s", "sound speed the head worked with"),
    ),
)
PASSES = Artefact(
    "ingest", "passes", "table", "maximal intervals without gap or along-track reversal",
    (
        _PASS,
        Column("start_ns", I64, "ns", "first moment, GPS"),
        Column("end_ns", I64, "ns", "last moment, GPS"),
        Column("duration_s", F64, "s", "length in time"),
        Column("length_m", F64, "m", "along-track length, + in the direction of the target's y axis"),
        Column("speed_m_s", F64, "m/s", "mean along-track speed"),
        Column("azimuth_deg", F64, "deg", "mean heading, clockwise from true north"),
        Column("heading_swing_deg", F64, "deg", "standard deviation of the heading"),
        Column("distance_m", F64, "m", "median distance of the INS from the wall's plane while the wall is abeam"),
    ),
)
FILES = Artefact(
    "ingest", "files", "table", "quality of each raw file",
    (
        Column("sensor", TEXT, "", "ins, laser or mbes"),
        Column("file", TEXT, "", "path in the session folder"),
        Column("records", I64, "1", "usable records"),
        Column("dropped", I64, "1", "records left out"),
        Column("first_ns", I64, "ns", "first usable record"),
        Column("last_ns", I64, "ns", "last usable record"),
        Column("rate_hz", F64, "Hz", "median rate of epochs (INS records, pings) or mean rate of laser points"),
    ),
)
GAPS = Artefact(
    "ingest", "gaps", "table", "gaps in the INS and the soundings",
    (
        Column("sensor", TEXT, "", "ins or mbes"),
        Column("start_ns", I64, "ns", "last record before the gap"),
        Column("end_ns", I64, "ns", "first record after it"),
        Column("duration_s", F64, "s", "length of the gap"),
    ),
)
POOL_FRAME = Artefact(
    "ingest", "pool_frame", "table", "the pool frame as used (azimuth as configured, or from the passes' headings)",
    (
        Column("latitude_deg", F64, "deg", "origin"),
        Column("longitude_deg", F64, "deg", "origin"),
        Column("height_m", F64, "m", "origin, ellipsoidal"),
        Column("azimuth_deg", F64, "deg", "direction of +y, clockwise from true north"),
        Column("azimuth_estimated", BOOL, "", "true: no azimuth was configured"),
    ),
)
INGEST_COUNTS = Artefact("ingest", "counts", "table", "records used and left out, by reason", _COUNTS)

# --- georeference ----------------------------------------------------------------------------------------------------
POSES = Artefact(
    "georeference", "poses", "table", "the trajectory in the pool frame",
    (
        _T,
        *_xyz("pool"),
        *(Column(f"q{axis}", F64, "1", f"quaternion of R_pool_from_body, component {axis}") for axis in "wxyz"),
    ),
)
LASER_POOL = Artefact(
    "georeference", "laser_pool", "stream", "laser points near the target",
    (_T, _PASS, *_near("laser"), *_near("pool")),
)
SOUNDINGS_POOL = Artefact(
    "georeference", "soundings_pool", "stream", "soundings near the target, placed with the coarse mount",
    (
        _T, _PASS,
        Column("ping", I64, "1", "ping number as recorded"),
        Column("beam", I16, "1", "beam number"),
        *_near("mbes"), *_near("pool"),
    ),
)
GEOREFERENCE_COUNTS = Artefact("georeference", "counts", "table", "points used and left out, by reason", _COUNTS)

# --- segment ---------------------------------------------------------------------------------------------------------
FACES = Artefact(
    "segment", "faces", "table", "the target's faces by design, in the target frame",
    (
        Column("face", I16, "1", "number of the face"),
        Column("name", TEXT, "", "P2, P1-0 … (slanted), P1-0-top, P1-0-bottom …"),
        Column("family", TEXT, "", "P1, P2, P3: coplanar vertical faces; H: horizontal faces"),
        *_xyz("target", "1", "normal_"),
        Column("distance_m", F64, "m", "normal · x = distance on the face"),
        Column("vertices_target_m", FLOATS, "m", "corners, x y z one after another"),
    ),
)
TARGET_POSE = Artefact(
    "segment", "target_pose", "table", "the target as the laser sees it, relative to the pool frame (one row)",
    (
        Column("R_target_from_pool", FLOATS, "1", "rotation matrix, row by row"),
        *_xyz("pool", "m", "origin_"),
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
        Column("agreement_m2", F64, "m²", "area of points explained plus area of faces covered, above the water"),
        Column("rival_agreement_m2", F64, "m²", "the same for the best rival pose"),
        Column("rival", TEXT, "", "which rival pose that is"),
        Column("ambiguous", BOOL, "", "true: the rival explains the points nearly as well, or better"),
        Column("gate_m", F64, "m", "largest distance from a face at which a laser point was labelled"),
        Column("within", BOOL, "", "false: no pose within the search limits was found"),
    ),
)
PROVISIONAL_MOUNT = Artefact(
    "segment", "provisional_mount", "table", "mount found for labelling alone; nothing later starts from it (one row)",
    (
        *_MOUNT_CORRECTION,
        Column("scale_m", F64, "m", "robust scale of the soundings' distances from their faces"),
        Column("gate_m", F64, "m", "largest distance from a face at which a sounding was labelled"),
        Column("score", F64, "1", "robust share of soundings explained by the model, less the share behind it"),
        Column("rival_score", F64, "1", "the same for the best other solution (another block)"),
        Column("ambiguous", BOOL, "", "true: another solution explains the soundings nearly as well"),
        Column("within", BOOL, "", "false: no mount within the search limits was found"),
    ),
)
LASER_LABELLED = Artefact(
    "segment", "laser_labelled", "stream", "laser points on the target's dry faces",
    (
        _T, _PASS,
        Column("face", I16, "1", "number of the face"),
        *_near("laser"), *_near("target"),
        Column("cos_incidence", F32, "1", "|cosine| of the angle between ray and the face's normal"),
    ),
)
SOUNDINGS_LABELLED = Artefact(
    "segment", "soundings_labelled", "stream", "soundings on the target's wet faces",
    (
        _T, _PASS,
        Column("ping", I64, "1", "ping number as recorded"),
        Column("beam", I16, "1", "beam number"),
        Column("face", I16, "1", "number of the face"),
        *_near("mbes"),
    ),
)
SEGMENT_COUNTS = Artefact("segment", "counts", "table", "points labelled and left out, by reason", _COUNTS)

# --- fit_planes ------------------------------------------------------------------------------------------------------
PLANES = Artefact(
    "fit_planes", "planes", "table", "total least squares planes (soundings: with the coarse mount)",
    (
        Column("sensor", TEXT, "", "laser or mbes"),
        _PASS,
        Column("plane", TEXT, "", "a face, a family (P1, P2, P3) or P4 = P1 x P2 (normal only)"),
        *_xyz("target", "1", "normal_"),
        Column("distance_m", F64, "m", "normal · x = distance"),
        *_xyz("target", "m", "centroid_"),
        Column("count", I64, "1", "points"),
        Column("rms_m", F64, "m", "RMS distance of the points from the plane"),
        Column("eigenvalues_m2", FLOATS, "m²", "of the centred scatter matrix / count, ascending"),
        Column("tangents", FLOATS, "1", "unit vectors t1, t2 along which the covariance turns the normal"),
        Column("covariance", FLOATS, "rad², rad m, m²", "3 x 3 of (turn along t1, along t2, distance at the centroid)"),
    ),
)
SOUNDING_MOMENTS = Artefact(
    "fit_planes", "sounding_moments", "table", "second moments from which any mount's planes follow (maths/moments.py)",
    (
        _PASS,
        Column("face", I16, "1", "number of the face"),
        Column("count", I64, "1", "soundings"),
        Column("moments", FLOATS, "m², m, 1", "40 x 40, row by row: products of the lifted coordinates, summed"),
    ),
)

# --- angle_iterate ---------------------------------------------------------------------------------------------------
_ITERATION = (
    Column("iteration", I32, "1", "from 0, the coarse mount"),
    *(
        Column(f"deviation_{axis}_deg", F64, "deg", f"{axis} of the MBES planes relative to the laser's, signed")
        for axis in ("pitch", "roll", "yaw")
    ),
    *(
        Column(f"cosine_{axis}_{sensor}", F64, "1", f"the patent's cosine for {axis} [0112-0117], {sensor}")
        for axis in ("roll", "yaw", "pitch")
        for sensor in ("laser", "mbes")
    ),
    *(Column(f"angle_P{k}_deg", F64, "deg", f"angle between the sensors' normals of P{k}") for k in (1, 2, 3, 4)),
)
ITERATIONS = Artefact(
    "angle_iterate", "iterations", "table", "the patent's angle iteration; deviations combined over the passes",
    (
        *_ITERATION,
        Column("step_deg", F64, "deg", "length of the rotation composed onto the correction after this row"),
        *_ROTATION,
    ),
)
PASS_ITERATIONS = Artefact(
    "angle_iterate", "pass_iterations", "table", "the same, pass by pass",
    (_PASS, *_ITERATION, Column("weight", F64, "1", "share of the pass in the combination")),
)
ANGLES = Artefact(
    "angle_iterate", "angles", "table", "result of the angle iteration (one row)",
    (
        *_ROTATION,
        Column("converged", BOOL, "", "step and angles stood still within the iterations allowed"),
        Column("iterations", I32, "1", "steps taken"),
        Column("reason", TEXT, "", "why there is no result; empty when there is"),
    ),
)

# --- offsets ---------------------------------------------------------------------------------------------------------
OFFSET_PAIRS = Artefact(
    "offsets", "offset_pairs", "table", "each pair of a dry and a wet horizontal face [0127]",
    (
        Column("method", TEXT, "", "patent_sequential or patent_alternating"),
        Column("dry_face", TEXT, "", "face seen by the laser"), Column("wet_face", TEXT, "", "face seen by the MBES"),
        Column("measured_m", F64, "m", "z_dry - z_wet as measured"),
        Column("design_m", F64, "m", "z_dry - z_wet by design"),
        Column("dz_m", F64, "m", "measured - design: the correction, target z"),
        Column("weight", F64, "1", "share of the pair in the mean"),
    ),
)
ALTERNATION = Artefact(
    "offsets", "alternation", "table", "angles and offsets in turn, until both stand still",
    (
        Column("iteration", I32, "1", "turn"),
        *_MOUNT_CORRECTION,
        Column("step_deg", F64, "deg", "change of the rotation in this turn"),
        Column("step_m", F64, "m", "change of the lever arm in this turn"),
    ),
)
CORRECTIONS = Artefact(
    "offsets", "corrections", "table", "the patent's two forms: corrections to the coarse mount",
    (
        Column("method", TEXT, "", "patent_sequential or patent_alternating"),
        *_MOUNT_CORRECTION,
        Column("converged", BOOL, "", "stood still within the iterations allowed"),
        Column("iterations", I32, "1", "turns taken"),
        Column("reason", TEXT, "", "why there is no result; empty when there is"),
    ),
)

# --- adjust ----------------------------------------------------------------------------------------------------------
ESTIMATE = Artefact(
    "adjust", "estimate", "table", "every unknown of the adjustment",
    (
        Column("unknown", TEXT, "", "rotation_x … lever_arm_z, then each surface's turn_1, turn_2, shift"),
        Column("value", F64, "rad or m", "estimate (rotation: vector from coarse; surfaces: from the laser's planes)"),
        Column("sigma", F64, "rad or m", "standard deviation, noise common to a moment included"),
        Column("sigma_formal", F64, "rad or m", "standard deviation from independent observations"),
    ),
)
COVARIANCE = Artefact(
    "adjust", "covariance", "table", "covariance and correlation of the six",
    (
        Column("row", TEXT, "", "unknown"), Column("column", TEXT, "", "unknown"),
        Column("covariance", F64, "rad², rad m, m²", "covariance"), Column("correlation", F64, "1", "correlation"),
    ),
)
SURFACES = Artefact(
    "adjust", "surfaces", "table", "the adjusted surfaces, shared by both sensors",
    (
        Column("family", TEXT, "", "P1, P2, P3 or H"),
        *_xyz("target", "1", "normal_"),
        Column("distance_m", F64, "m", "normal · x = distance; H: shift against the design heights"),
        Column("laser_points", I64, "1", "observations"), Column("soundings", I64, "1", "observations"),
    ),
)
GROUPS = Artefact(
    "adjust", "groups", "table", "variance factors by group of observations",
    (
        Column("group", TEXT, "", "laser, mbes_vertical, mbes_horizontal"),
        Column("count", I64, "1", "observations"), Column("redundancy", F64, "1", "their redundancy"),
        Column("variance_factor", F64, "1", "estimated variance / variance expected from the session's sigmas"),
        Column("rms_normalised", F64, "1", "weighted RMS of residual / sigma"),
        Column("cut", I64, "1", "observations whose weight became zero"),
        Column("reduced", I64, "1", "observations whose weight was reduced"),
    ),
)
CELLS = Artefact(
    "adjust", "cells", "table", "mean residual of each sensor on each surface in each pass",
    (
        Column("sensor", TEXT, "", "laser or mbes"), Column("family", TEXT, "", "P1, P2, P3 or H"), _PASS,
        Column("count", I64, "1", "observations"), Column("mean_m", F64, "m", "weighted mean residual"),
        Column("rms_m", F64, "m", "RMS residual"),
        Column("sigma_mean_m", F64, "m", "standard deviation of the mean from the scatter of its moments"),
        Column("normalised", F64, "1", "mean / root(sigma_mean² + tolerance²)"),
    ),
)
ADJUST_SUMMARY = Artefact(
    "adjust", "summary", "table", "the adjustment as a whole (one row)",
    (
        Column("converged", BOOL, "", "the step became negligible"), Column("iterations", I32, "1", "steps"),
        Column("observations", I64, "1", "observations"), Column("redundancy", F64, "1", "observations - unknowns"),
        Column("sigma0", F64, "1", "root of the variance factor over all groups, session sigmas"),
        Column("condition", F64, "1", "condition number of the scaled normal matrix"),
        Column("rank_deficiency", I32, "1", "unknown directions that the data leave open"),
        Column("weakest", TEXT, "", "the weakest direction in words"),
        Column("test_statistic", F64, "1", "consistency of the cells: sum of their squared normalised means"),
        Column("test_dof", I32, "1", "degrees of freedom"), Column("test_limit", F64, "1", "limit at the test's level"),
        Column("test_passed", BOOL, "", "statistic <= limit"),
        Column("reason", TEXT, "", "why there is no result; empty when there is"),
    ),
)

# --- report ----------------------------------------------------------------------------------------------------------
CALIBRATION = Artefact(
    "report", "calibration", "table", "each method's six values: totals that replace the coarse mount, and corrections",
    (
        Column("method", TEXT, "", "patent_sequential, patent_alternating, adjustment"),
        Column("parameter", TEXT, "", "roll, pitch, yaw, x, y, z"),
        Column("unit", TEXT, "", "deg or m"),
        Column("coarse", F64, "deg or m", "mount as configured"), Column("total", F64, "deg or m", "calibrated mount"),
        Column("change", F64, "deg or m", "total - coarse: the difference of the mount's settings"),
        Column("correction", F64, "deg or m", "rotation vector (about the same body axis) or lever arm correction"),
        Column("sigma", F64, "deg or m", "standard deviation of the correction"),
    ),
)

CALIBRATION_JSON = Document("report", "calibration.json")
CALIBRATION_YAML = Document("report", "calibration.yaml")

ALL: tuple[Artefact, ...] = tuple(value for value in list(globals().values()) if isinstance(value, Artefact))
