"""Applanix POS MV: sensor 1 with respect to the reference point, a sheet.

The maker's angles bring the reference frame to the sensor's: first about z, then about the turned y, then about the
twice turned x: R_reference_from_sensor = Rz(Z) · Ry(Y) · Rx(X) in forward, starboard, down.
"""

from pipeline.exports.convention import FRD, Convention
from pipeline.exports.sheet import Sheet

_SHEET = Sheet(
    groups=(
        (
            "Settings, Installation, where sensor 1 stands: Ref. to Sensor 1 Lever Arm",
            {"x": "Lever arm X", "y": "Lever arm Y", "z": "Lever arm Z"},
        ),
        ("Sensor 1 Frame w.r.t. Ref. Frame", {"roll": "Angle X", "pitch": "Angle Y", "yaw": "Angle Z"}),
    ),
    zeros=(
        "Once only: if POS MV outputs position and attitude at sensor 1, the processing program must have a zero "
        "mount; if "
        "the mount is in the processing program, leave sensor 1 as it was."
    ),
    notes=(
        "This changes what POS MV outputs for sensor 1 (such as heave at the head), not how soundings are computed.",
        "POSPac's SBET stays at the point that its export was told.",
        "Order in the dialog: X, Y, Z of the angles are roll, pitch, heading; they turn about Z first.",
    ),
)
CONVENTION = Convention(
    FRD,
    (1, 1, -1),
    "YPR",
    "official",
    "POS MV V5 guide, pp. 2-27 and 2-31; Applanix ICD 004089, messages 20 and 120",
)
TARGET = _SHEET.target("posmv", "Applanix POS MV", CONVENTION, writes="entry sheet, sensor 1", sensor=None)
