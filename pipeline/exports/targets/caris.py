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
    "CARIS help, CreateVesselFile (Transducer, SVP) and Vessel Editor (axes; Δ values are added; Error is subtracted; "
    "names and 1 sigma of TPU Values); NOAA Field Procedures Manual 4.2.3.8 (the sigmas of a patch test belong in the "
    "MRU's alignment)",
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
        "Newer editors have, in place of Transducer 1, the bathymetry sensor's unit XYZ, or Transmitter and Receiver: "
        "the same angles in both.",
        "TPU Values, 1 sigma: MRU Align StdDev Gyro: sigma of Yaw; MRU Align StdDev Roll/Pitch: the larger one of Roll "
        "and Pitch; Offset X, Offset Y, Offset Z (Other Standard Deviations): sigma of X, Y, Z. Trans Roll (Sensor "
        "Offsets) is the Roll above; MRU to Trans and Navigation To Trans count from the MRU and from the antenna.",
    ),
)
TARGET = _SHEET.target("caris", "CARIS HIPS vessel editor", CONVENTION)
