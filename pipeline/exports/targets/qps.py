"""QPS Qinsy and Qimera: sheets, for their files are their own.

Both compose x' = H · P · R · x, heading about z, pitch about the turned x, roll about the turned y; heading + to
starboard.
"""

from dataclasses import replace

from pipeline.exports.convention import SFU, Convention
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import written
from pipeline.exports.sheet import DECIMALS, Sheet
from pipeline.exports.target import Options, Target

ORDER_SOURCE = "QPS, How-to Qinsy sign conventions and How-to Qinsy rotation matrices (signs, order)"
AXES_SOURCE = (
    "heights are up there in words, X and Y in a drawing alone; NORBIT iWBMS manual 10.4.3, p. 91: X+ starboard, "
    "Y+ forward, Z+ up"
)
QIMERA_SOURCE = f"Qinsy's, by the same maker, taken to hold in Qimera, whose manual does not state them: {ORDER_SOURCE}"
CONVENTION = Convention(SFU, (1, 1, -1), "YPR", "secondary", f"{ORDER_SOURCE}; {AXES_SOURCE}")
OF_QIMERA = replace(CONVENTION, source=f"{QIMERA_SOURCE}; {AXES_SOURCE}")
POSITION = {"x": "X", "y": "Y", "z": "Z"}
ANGLES = {"roll": "Roll", "pitch": "Pitch", "yaw": "Heading"}


def _arrays(target: Target, mounting: Mounting, _: Options) -> list[str]:
    """Return what stands for transmitter and receiver, where the editor has them apart.

    The lever arm is the receiver's, but with the transmitter's y where Kongsberg's files tell both (``split``).
    """
    if mounting.projector_offset_m is None and mounting.split:
        return [
            "If the editor has transmitter and receiver apart, the position above is of neither (forward of the",
            "transmitter, starboard and up of the receiver): export again with --projector-offset.",
        ]
    if mounting.projector_offset_m is None:
        return [
            "If the editor has transmitter and receiver apart: the same angles in both; the position above is the",
            "receiver's. For the transmitter's export again with --projector-offset (0 0 0: both at one point).",
        ]
    places = [target.convention.numbers(mounted).by_role() for mounted in mounting.arrays()]
    transmitter, receiver = (
        ", ".join(f"{name} {written(place[role], DECIMALS)}" for role, name in POSITION.items()) for place in places
    )
    return [
        "If the editor has transmitter and receiver apart: the same angles in both.",
        f"Transmitter, m: {transmitter}. Receiver, m: {receiver}.",
    ]


def _as_in_qimera(target: Target, mounting: Mounting, options: Options) -> list[str]:
    """Return what must stand in the editor beside the values: the two arrays, and the INS as the values count on it."""
    ins = "at 0, 0, 0 there, without angles of their own"
    if not mounting.frame.is_ins:
        ins = "there as the INS does by --ins-point and --ins-turn (below)"
    return [*_arrays(target, mounting, options), f"The values hold if position and motion sensor stand {ins}."]


_QINSY = Sheet(
    groups=(
        ("Template, object (vessel): node of the sonar, e.g. MBES", POSITION),
        ("Template, system (multibeam echosounder): mounting angles", ANGLES),
    ),
    zeros="Must be zero: other corrections of roll, pitch and heading at the multibeam, as of an earlier patch test.",
    notes=(
        "The INS's node stands at the INS's point; its own mounting angles stay as they are.",
        "Sigmas: enter them as the SD of the node and of the mounting angles (1 sigma).",
    ),
)
_QIMERA = Sheet(
    groups=(
        ("Vessel editor, sonar: location offsets", POSITION),
        ("Vessel editor, sonar: mounting angles", ANGLES),
    ),
    zeros="Must be zero: the calibration (patch test) results of the same sonar that Qimera's own tool has stored.",
    notes=(
        "Loading a session replaces what stands in the vessel editor: enter the values after the import.",
    ),
    extra=_as_in_qimera,
)
QINSY = _QINSY.target("qinsy", "QPS Qinsy", CONVENTION)
QIMERA = _QIMERA.target("qimera", "QPS Qimera", OF_QIMERA)
