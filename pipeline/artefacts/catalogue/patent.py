"""Tables of stages angle_iterate and offsets: the patent's steps."""

# fmt: off: the tables are laid out by hand
from pipeline.artefacts.columns import BOOL, F64, I32, MOUNT_CORRECTION, PASS, ROTATION, TEXT
from pipeline.artefacts.schema import Artefact, Column

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
        *ROTATION,
    ),
)
PASS_ITERATIONS = Artefact(
    "angle_iterate", "pass_iterations", "table", "the same, pass by pass",
    (PASS, *_ITERATION, Column("weight", F64, "1", "share of the pass in the combination")),
)
_RESULT = (
    *ROTATION,
    Column("converged", BOOL, "", "step and angles stood still, or were below the threshold, within the iterations"),
    Column("iterations", I32, "1", "steps taken"),
    Column("reason", TEXT, "", "why there is no result; empty when there is"),
)
ANGLES = Artefact("angle_iterate", "angles", "table", "result of the angle iteration (one row)", _RESULT)
LITERAL_ITERATIONS = Artefact(
    "angle_iterate", "literal_iterations", "table",
    "the same word for word (patent_literal): deviations are full angles with the printed signs, all passes together",
    (*_ITERATION, *ROTATION),
)
LITERAL_ANGLES = Artefact(
    "angle_iterate", "literal_angles", "table", "result of the literal iteration (one row): the added corrections",
    _RESULT,
)

# --- offsets ---------------------------------------------------------------------------------------------------------
OFFSET_PAIRS = Artefact(
    "offsets", "offset_pairs", "table", "each pair of a dry and a wet horizontal face [0127]",
    (
        Column("method", TEXT, "", "patent_sequential, patent_alternating or patent_literal"),
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
        *MOUNT_CORRECTION,
        Column("step_deg", F64, "deg", "change of the rotation in this turn"),
        Column("step_m", F64, "m", "change of the lever arm in this turn"),
    ),
)
CORRECTIONS = Artefact(
    "offsets", "corrections", "table", "the patent's three forms: corrections to the coarse mount",
    (
        Column("method", TEXT, "", "patent_sequential, patent_alternating or patent_literal"),
        *MOUNT_CORRECTION,
        Column("converged", BOOL, "", "stood still within the iterations allowed"),
        Column("iterations", I32, "1", "turns taken"),
        Column("reason", TEXT, "", "why there is no result; empty when there is"),
    ),
)
