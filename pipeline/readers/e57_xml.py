"""Checks of an E57 file's header and XML part, made before libE57Format opens the file.

libE57Format's XML parser follows references in the XML: to an external document type, to external entities, and to the
schemas of ``schemaLocation``. With these references a malicious file could read other files of the computer and send
them over the network. A file with any of them is refused; no scanner writes them. Only UTF-8 is accepted, so that
another encoding cannot hide a reference.

Offsets in the header (little-endian): 8 u32 x 2 version, 16 u64 size of the file, 24 u64 byte at which the XML part
begins, 32 u64 length of the XML part, 40 u64 size of a page. A page has 1024 bytes, and its last four are a checksum.
The beginning of the XML part counts the checksums before it; its length does not count them (ASTM E2807, 6.2).
"""

import re
import struct
from pathlib import Path

from pipeline.errors import RawDataError
from pipeline.readers.decoder_process import REMEDY
from pipeline.readers.raw_file import opened, read_at, size_of

_HEADER = struct.Struct("<8s2I4Q")
MAX_XML = 1 << 26
_PAGE, _CONTENT = 1024, 1020
FETCHING = re.compile(rb"<!DOCTYPE|<!ENTITY|schemaLocation", re.IGNORECASE)
_QUOTED = rb"""\s*=\s*(?:"%s"|'%s')"""
_ENCODING = rb"(?i:utf-8|us-ascii)"
DECLARATION = re.compile(
    rb"<\?xml\s+version" + _QUOTED % (rb"1\.[01]", rb"1\.[01]")
    + rb"(?:\s+encoding" + _QUOTED % (_ENCODING, _ENCODING) + rb")?"
    + rb"(?:\s+standalone" + _QUOTED % (b"(?:yes|no)", b"(?:yes|no)") + rb")?\s*\?>"
)  # fmt: skip


def check_header_and_xml(path: Path, name: str) -> int:
    """Check the file's header and XML part, and return its size in bytes.

    Raises
    ------
    RawDataError
        The file is cut off, its header is damaged, or its XML part has an external reference or is not in UTF-8.
    """
    with opened(path, name) as file:
        size = size_of(file)
        _, _, _, claimed, start, length, page = _HEADER.unpack(file.read(_HEADER.size).ljust(_HEADER.size, b"\0"))
        if claimed > size:
            raise RawDataError(f"{name}: is cut off: {size} of {claimed} bytes; {REMEDY}")
        first, skipped = divmod(start, _PAGE)
        pages = -(-(skipped + length) // _CONTENT)
        sound = page == _PAGE and _HEADER.size <= start and skipped < _CONTENT and 0 < length <= MAX_XML
        if not sound or (first + pages) * _PAGE > size:
            raise RawDataError(f"{name}: its E57 header is damaged; {REMEDY}")
        stored = read_at(file, first * _PAGE, pages * _PAGE)
    content = b"".join(stored[at : at + _CONTENT] for at in range(0, len(stored), _PAGE))
    _refuse_fetching(content[skipped : skipped + length], name)
    return size


def _refuse_fetching(xml: bytes, name: str) -> None:
    reference = FETCHING.search(xml)
    if reference is not None:
        raise RawDataError(
            f"{name}: its XML part has {reference[0].decode()!r}, by which it could read other files of this computer "
            "and send them away; no scanner writes that: find out where the file comes from, and export it again"
        )
    text = xml.removeprefix(b"\xef\xbb\xbf")
    if not _is_utf8(text) or (text.startswith(b"<?xml") and DECLARATION.match(text) is None):
        raise RawDataError(f"{name}: its XML part is not in UTF-8, as E57 requires; {REMEDY}")


def _is_utf8(xml: bytes) -> bool:
    try:
        return "\0" not in xml.decode("utf-8")
    except UnicodeDecodeError:
        return False
