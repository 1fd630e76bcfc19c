"""CARIS HIPS: a sheet for the vessel editor.

X starboard, Y to the bow, Z into the water: left-handed, so the angles are by words: pitch bow up +, roll starboard
down +, yaw clockwise +. The order of rotations is not stated anywhere that was found, nor how HIPS puts together the
angles of SVP and of Transducer 1.
"""

from pipeline.exports.convention import SFD, Convention
from pipeline.exports.sheet import Sheet

CONVENTION = Convention(
    SFD,
    (1, 1, -1),
    None,
    "official",
    "CARIS help, CreateVesselFile (Transducer, SVP) and Vessel Editor (axes; Δ values are added; Error is subtracted)",
)
_SHEET = Sheet(
    groups=(
        ("Vessel editor, Swath 1 (Transducer 1) and SVP 1: offsets, the same in both", {"x": "X", "y": "Y", "z": "Z"}),
        (
            "Mounting angles: Swath 1 for a head near level; SVP 1 for one that is mounted with a tilt (then Swath 1: "
            "0)",
            {"pitch": "Pitch", "roll": "Roll", "yaw": "Yaw"},
        ),
    ),
    zeros=(
        "Must be zero: Δ Pitch, Δ Roll, Δ Yaw of newer vessel files (they are added), and the 'Error' of the sensors "
        "Gyro, "
        "Pitch and Roll (it is subtracted)."
    ),
    notes=(
        "Observations of HIPS's pitch and roll sensors have other signs than these offsets: enter nothing there.",
        "SVP's angles serve HIPS's own sound velocity correction, for large mounting angles. How HIPS puts the angles "
        "of SVP "
        "and Swath together is not documented in what was found: check a line of known depth.",
        "TPU, standard deviations (1 sigma): MRU Align. StdDev gyro: sigma of Yaw; MRU Align. StdDev roll/pitch: the "
        "larger "
        "one of Roll and Pitch; offsets X, Y, Z of the transducer: sigma of X, Y, Z.",
    ),
)
TARGET = _SHEET.target("caris", "CARIS HIPS vessel editor", CONVENTION)
