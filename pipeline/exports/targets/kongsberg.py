"""Kongsberg: a sheet for SIS, and the installation text of .kmall (#IIP) and of .all.

The vessel's axes are forward, starboard, down; an array is turned by Rz(H) · Ry(P) · Rx(R). Groups of #IIP end with a
comma, their parameters with a semicolon; .all has S1X=…, the transmitter first, the receiver second.

A transmitter that is mounted looking aft stands in SIS with a heading near 180°. With R_tx = R · Rz(180°), and because
Ry(p) Rx(r) Rz(180°) = Rz(180°) Ry(-p) Rx(-r), its numbers are then -R, -P, H + 180°. (So has it a file of an EM 2042:
transmitter 0.017, 0.430, 178.080 beside receiver -0.017, -0.430, 358.080.)
"""

import re

from pipeline.errors import ConfigError
from pipeline.exports.convention import FRD, Convention
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of, one, written_for
from pipeline.exports.sheet import Sheet
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted

DECIMALS = 9
LETTERS = {"x": "X", "y": "Y", "z": "Z", "roll": "R", "pitch": "P", "yaw": "H"}
_GROUP = re.compile(r"TRAI_(?:RX|HD)(\d):([^,\n]*)[,\n]")
_FLAT = re.compile(r"\bS2([XYZRPH])=([^,\n]*)[,\n]")


def _extra(target: Target, mounting: Mounting, options: Options) -> list[str]:
    """Return the installation texts, and what to know of the transmitter."""
    groups, flat = [], []
    for place, (name, mounted) in enumerate(zip(("TX", "RX"), mounting.arrays(), strict=True), start=1):
        values = target.convention.numbers(mounted).by_role()
        parts = {
            letter: written_for(target.convention, role, values[role], DECIMALS) for role, letter in LETTERS.items()
        }
        groups.append(
            f"TRAI_{name}1:N={place};" + ";".join(f"{letter}={value}" for letter, value in parts.items()) + ","
        )
        flat += [f"S{place}{letter}={value}," for letter, value in parts.items()]
    return [
        "The same as text of #IIP (.kmall), transmitter TX1 and receiver RX1:",
        *groups,
        "and as in the installation datagram of .all (S1 transmitter, S2 receiver):",
        "".join(flat),
    ]


def _read(target: Target, text: str, where: str, _: Options) -> Mounted:
    """Return the receiver's mount from a text that contains #IIP's groups, or .all's entries."""
    found = _GROUP.findall(text)
    if len({name for name, _ in found}) > 1:
        raise ConfigError(f"{where}: has two heads or receivers; leave one, for poolcal reads one head at a time")
    if found:
        group = one(found, "receivers", where)[1]
        entries = [tuple(part.split("=", 1)) for part in group.split(";") if "=" in part]
    else:
        entries = _FLAT.findall(text)
    if not entries:
        raise ConfigError(f"{where}: has no TRAI_RX1:, TRAI_HD1: or S2X= with the receiver; is it the text, and whole?")
    values = {}
    for role, letter in LETTERS.items():
        given = {value for name, value in entries if name == letter}
        if len(given) != 1:
            raise ConfigError(f"{where}: {letter} of the receiver is there {len(given)} times; correct the text")
        values[role] = number(given.pop(), letter, where)
    return target.convention.mounted(numbers_of(values))


def _receiver(mounting: Mounting) -> Mounted:
    _, receiver = mounting.arrays()
    return receiver


_SHEET = Sheet(
    groups=(
        ("SIS, Installation parameters: location of the receiver, RX 1 (TX 1: see below)",
         {"x": "Forward (X)", "y": "Starboard (Y)", "z": "Downward (Z)"}),
        ("SIS, Installation parameters: angles of TX 1 and of RX 1 alike",
         {"roll": "Roll (R)", "pitch": "Pitch (P)", "yaw": "Heading (H)"}),
    ),
    zeros=(
        "Once only: if patch-test results stand at the motion sensor (ATTI_1 R, P, H), the heads must keep their old "
        "values; "
        "with these values at the heads, the motion sensor's own must be those of its alignment alone."
    ),
    notes=(
        "A transmitter mounted looking aft has a heading near 180: enter for it -R, -P and H + 180.",
        "SIS adds the inner offsets of each array (IX, ICX and so on) itself: poolcal's place is the acoustic centre; "
        "subtract them.",
        "Tilts of transmit sectors that the files record are not in these values. A fixed tilt of the fan that the "
        "files do "
        "not record is part of the pitch and yaw found: subtract it from what goes to SIS.",
        "The waterline (EMXI:SWLZ) stays as it is. Never rewrite recorded files.",
    ),
    extra=_extra,
    of=_receiver,
)  # fmt: skip
CONVENTION = Convention(
    FRD,
    (1, 1, -1),
    "YPR",
    "secondary",
    "Kongsberg .kmall format, rev. J (axes, signs); the order is that of Kluster's and MB-System's code, not of the "
    "maker's text",
    zero_to_360=True,
)
TARGET = _SHEET.target("kongsberg", "Kongsberg SIS", CONVENTION, writes="entry sheet, #IIP and .all text", read=_read)
