"""The instrument that a file names in its own header, in the maker's words."""

import re
from collections import Counter
from pathlib import Path

from pipeline.errors import RawDataError
from pipeline.readers import file_kind
from pipeline.readers.r2sonic_framing import bare_packets, xtf_packets
from pipeline.readers.raw_file import opened, read_at

_MODEL = slice(4, 16)  # in R2Sonic's section H0: u16 name, u16 size, then 12 letters of the model's number
_SYSTEM = (26, 32)  # "system identifier" in a LAS header: first byte, length (ASPRS, "LAS Specification 1.4 R15")


def named_instrument(path: Path, name: str, kind: file_kind.FileKind) -> str:
    """Return the instrument's name by the file's header, such as ``R2Sonic 2024``; empty if it names none.

    R2Sonic's packets hold the sonar's model number; a LAS header may hold a scanner of RIEGL. The other formats name no
    instrument.

    Parameters
    ----------
    path, name
        The file, and its name in messages.
    kind
        The file's kind.
    """
    try:
        with opened(path, name) as file:
            if kind is file_kind.LAS:
                start, length = _SYSTEM
                system = _words(read_at(file, start, length))
                return system if system.startswith("RIEGL ") else ""  # others name programs, or processes (MERGE)
            if kind not in (file_kind.XTF, file_kind.R2SONIC_PACKETS):
                return ""
            packets = (xtf_packets if kind is file_kind.XTF else bare_packets)(file, Counter())
            model = _words(next(packets, {}).get(b"H0", b"")[_MODEL])
            return f"R2Sonic {model}" if model else ""
    except RawDataError:
        return ""


def _words(text: bytes) -> str:
    r"""Return the printable ASCII words that end at the first zero byte; empty if there are other letters.

    >>> _words(b"2024" + bytes(8)), _words(b"RIEGL  VZ-400i"), _words(b"\xff")
    ('2024', 'RIEGL VZ-400i', '')
    """
    words = text.partition(b"\0")[0]
    return " ".join(words.decode("ascii").split()) if re.fullmatch(rb"[ -~]*", words) else ""
