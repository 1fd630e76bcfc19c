"""Tables of stages ingest and georeference: the recorded data, and the points in the pool frame."""

# fmt: off: the tables are laid out by hand
from pipeline.artefacts.columns import (
    BOOL,
    COUNTS,
    F64,
    I16,
    I64,
    PASS,
    T_NS,
    TEXT,
    coordinate_columns,
    float32_coordinates,
)
from pipeline.artefacts.schema import Artefact, Column

# --- ingest ----------------------------------------------------------------------------------------------------------
TRAJECTORY = Artefact(
    "ingest", "trajectory", "table", "INS solution, time ascending, unusable records left out",
    (
        T_NS,
        Column("latitude_rad", F64, "rad", "geodetic latitude, in the datum of the INS"),
        Column("longitude_rad", F64, "rad", "longitude, in the datum of the INS"),
        Column("height_m", F64, "m", "ellipsoidal height"),
        Column("roll_rad", F64, "rad", "starboard down +"),
        Column("pitch_rad", F64, "rad", "bow up +"),
        Column("azimuth_rad", F64, "rad", "heading, clockwise from true north"),
    ),
)
INS_SIGMAS = Artefact(
    "ingest", "ins_sigmas", "table", "standard deviations that the INS states, two a second; NaN: it does not say",
    (
        T_NS,
        *(Column(f"{axis}_m", F64, "m", f"of the position, {axis}") for axis in ("north", "east", "up")),
        *(Column(f"{angle}_deg", F64, "deg", f"of the {angle}") for angle in ("roll", "pitch", "heading")),
    ),
)
LASER_POINTS = Artefact(
    "ingest", "laser_points", "stream", "laser points as recorded: in the scanner's frame, or in ECEF if georeferenced",
    (T_NS, *(Column(f"{axis}_m", F64, "m", f"{axis}, frame laser (or ecef)") for axis in "xyz")),
)
SOUNDINGS = Artefact(
    "ingest", "soundings", "stream", "soundings as recorded",
    (
        T_NS,
        Column("ping", I64, "1", "ping number as recorded"),
        Column("beam", I16, "1", "beam number in the ping, from 0 at port"),
        Column("two_way_time_s", F64, "s", "two-way travel time"),
        Column("angle_rad", F64, "rad", "angle of the receive beam from the array's normal, starboard +"),
        Column("transmit_tilt_rad", F64, "rad", "along-track angle of the transmit fan from the normal, forward +"),
        Column("sound_speed_m_s", F64, "m/s", "sound speed the head worked with"),
    ),
)
PASSES = Artefact(
    "ingest", "passes", "table", "maximal intervals without gap or along-track reversal",
    (
        PASS,
        Column("start_ns", I64, "ns", "begin, GPS"),
        Column("end_ns", I64, "ns", "end, GPS"),
        Column("duration_s", F64, "s", "length in time"),
        Column("length_m", F64, "m", "along-track length, + in the direction of the target's y axis"),
        Column("speed_m_s", F64, "m/s", "mean along-track speed"),
        Column("azimuth_deg", F64, "deg", "mean heading, clockwise from true north"),
        Column("heading_swing_deg", F64, "deg", "standard deviation of the heading"),
        Column("distance_m", F64, "m", "median distance of the INS from the wall's plane while the wall is abeam"),
    ),
)
UNSOUNDED_PASSES = Artefact(
    "ingest", "unsounded_passes", "table", "times in which the boat passed the target, the laser ran and the sonar not",
    (
        Column("start_ns", I64, "ns", "the target comes abeam, GPS"),
        Column("end_ns", I64, "ns", "last time abeam, GPS"),
        Column("distance_m", F64, "m", "median distance of the INS from the wall's plane in this time"),
    ),
)
FILES = Artefact(
    "ingest", "files", "table", "quality of each raw file",
    (
        Column("sensor", TEXT, "", "ins, laser, mbes or accuracy (of the INS)"),
        Column("file", TEXT, "", "path in the session folder"),
        Column("records", I64, "1", "usable records"),
        Column("dropped", I64, "1", "records left out"),
        Column("first_ns", I64, "ns", "first usable record"),
        Column("last_ns", I64, "ns", "last usable record"),
        Column("rate_hz", F64, "Hz", "median rate of epochs (INS records, pings) or mean rate of laser points"),
        Column("sound_speed_low_m_s", F64, "m/s", "lowest sound speed recorded with the pings (NaN: no sonar file)"),
        Column("sound_speed_high_m_s", F64, "m/s", "highest"),
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
INGEST_COUNTS = Artefact("ingest", "counts", "table", "records used and left out, by reason", COUNTS)

# --- georeference ----------------------------------------------------------------------------------------------------
POSES = Artefact(
    "georeference", "poses", "table", "the trajectory in the pool frame",
    (
        T_NS,
        *coordinate_columns("pool"),
        *(Column(f"q{axis}", F64, "1", f"quaternion of R_pool_from_body, component {axis}") for axis in "wxyz"),
    ),
)
LASER_POOL = Artefact(
    "georeference", "laser_pool", "stream", "laser points near the target",
    (T_NS, PASS, *float32_coordinates("laser"), *float32_coordinates("pool")),
)
SOUNDINGS_POOL = Artefact(
    "georeference", "soundings_pool", "stream", "soundings near the target, placed with the coarse mount",
    (
        T_NS, PASS,
        Column("ping", I64, "1", "ping number as recorded"),
        Column("beam", I16, "1", "beam number"),
        *float32_coordinates("mbes"), *float32_coordinates("pool"),
    ),
)
GEOREFERENCE_COUNTS = Artefact("georeference", "counts", "table", "points used and left out, by reason", COUNTS)
