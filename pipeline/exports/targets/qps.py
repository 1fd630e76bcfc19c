"""QPS Qinsy and Qimera: sheets, for their files are their own.

Both compose x' = H · P · R · x, heading about z, pitch about the turned x, roll about the turned y; heading + to
starboard.
"""

from pipeline.exports.convention import SFU, Convention
from pipeline.exports.sheet import Sheet

ORDER_SOURCE = "QPS, How-to Qinsy sign conventions and How-to Qinsy rotation matrices (signs, order)"
AXES_SOURCE = (
    "heights are up there in words, X and Y in a drawing alone; NORBIT iWBMS manual 10.4.3, p. 91: X+ starboard, "
    "Y+ forward, Z+ up"
)
CONVENTION = Convention(SFU, (1, 1, -1), "YPR", "secondary", f"{ORDER_SOURCE}; {AXES_SOURCE}")
POSITION = {"x": "X", "y": "Y", "z": "Z"}
ANGLES = {"roll": "Roll", "pitch": "Pitch", "yaw": "Heading"}

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
        "A head of two arrays has a transmitter and a receiver: enter the same angles in both.",
    ),
)
QINSY = _QINSY.target("qinsy", "QPS Qinsy", CONVENTION)
QIMERA = _QIMERA.target("qimera", "QPS Qimera", CONVENTION)
