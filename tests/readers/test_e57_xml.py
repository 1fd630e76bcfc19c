"""E57 files made to read this computer's files and send them away: refused before libE57Format sees them.

Which of them libE57Format would follow was seen with a server that listens: the server here hears nothing.
"""

import http.server
import struct
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.errors import RawDataError
from pipeline.readers import e57_scans
from tests.support.files.build import read, rows
from tests.support.files.e57_files import Scan, edited, write

POINTS = {"cartesianX": (1.0, 2.0), "cartesianY": (4.0, 5.0), "cartesianZ": (7.0, 8.0), "timeStamp": (0.0, 0.5)}
DECLARATION = b'<?xml version="1.0" encoding="UTF-8"?>'
NAMESPACE = b'xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0"'
SCHEMAS = b'xmlns:s="http://www.w3.org/2001/XMLSchema-instance"'
FAR = 700  # letters that push what follows onto the next page, over a checksum


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.e57"


@pytest.fixture
def content(file: Path) -> bytes:
    write(file, Scan(POINTS, 1.4e9), crs="HERE")
    return file.read_bytes()


@pytest.fixture(scope="module")
def asked() -> Iterator[tuple[str, list[str]]]:
    """The address of a server on this machine, and what it has been asked for."""
    paths: list[str] = []

    class Listener(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            paths.append(self.path)
            self.send_response(200)
            self.end_headers()

        def log_message(self, format: str, *values: object) -> None:
            """Nothing."""

    server = http.server.HTTPServer(("127.0.0.1", 0), Listener)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", paths
    server.shutdown()
    server.server_close()


def hostile(content: bytes, kind: str, address: bytes, secret: bytes) -> bytes:
    """A sound file into which somebody has put what makes an XML parser fetch."""
    external = b'<!ENTITY a SYSTEM "file://' + secret + b'">'
    put = {
        "file": (DECLARATION, DECLARATION + b"<!DOCTYPE e57Root [" + external + b"]>"),
        "http": (DECLARATION, DECLARATION + b'<!DOCTYPE e57Root SYSTEM "' + address + b'/dtd">'),
        "far": (DECLARATION, DECLARATION + b"<!--" + b"." * FAR + b'--><!DOCTYPE r SYSTEM "' + address + b'/far">'),
        "schema": (NAMESPACE, NAMESPACE + SCHEMAS + b' s:noNamespaceSchemaLocation="' + address + b'/schema"'),
        "schemas": (NAMESPACE, NAMESPACE + SCHEMAS + b' s:schemaLocation="urn:a ' + address + b'/schemas"'),
    }
    broken = edited(content, *put[kind])
    return edited(broken, b"<![CDATA[HERE]]>", b"&a;") if kind == "file" else broken


@pytest.mark.parametrize("kind", ["file", "http", "far", "schema", "schemas"])
def test_nothing_is_fetched(
    kind: str, content: bytes, file: Path, asked: tuple[str, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refused in one line, and no worker is started that could fetch anything."""
    (file.parent / "secret.txt").write_text("SECRET")
    address, paths = asked
    file.write_bytes(hostile(content, kind, address.encode(), str(file.parent / "secret.txt").encode()))
    started: list[object] = []
    monkeypatch.setattr(e57_scans, "decoded_text", lambda *given: started.append(given))
    monkeypatch.setattr(e57_scans, "decoded_batches", lambda *given: started.append(given))
    words = "(DOCTYPE|ENTITY|[sS]chemaLocation).*other files of this computer.*where the file comes from"
    with pytest.raises(RawDataError, match=rf"a\.e57: its XML part has .*{words}") as error:
        read("laser", file, "e57")
    with pytest.raises(RawDataError, match="other files of this computer"):
        e57_scans.stored_points(file, "a.e57", 0)
    assert "SECRET" not in str(error.value)
    assert "\n" not in str(error.value)
    assert not started
    assert not paths


def test_a_page_s_checksum_does_not_hide_a_word(content: bytes, file: Path) -> None:
    """Wherever the word lies, across the end of a page too: one of these places is."""
    for filler in range(600, 1024):
        broken = edited(content, DECLARATION, DECLARATION + b"<!--" + b"." * filler + b"--><!DOCTYPE r>")
        inside = broken.find(b"<!DOCTYPE")
        if inside < 0:  # cut in two by a checksum
            file.write_bytes(broken)
            with pytest.raises(RawDataError, match="'<!DOCTYPE'"):
                read("laser", file, "e57")
            return
    pytest.fail("no page ends within the word")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp037", "latin-1"])
def test_other_encodings_hide_nothing(encoding: str, content: bytes, file: Path) -> None:
    """Every letter of the XML part in another encoding, as its declaration says; é, for latin-1 to differ."""
    inside = b"".join(content[k : k + 1020] for k in range(0, len(content), 1024))
    (length,) = struct.unpack_from("<Q", inside, 32)
    start = inside.find(DECLARATION)
    xml = inside[start : start + length]
    other = xml.decode().replace("UTF-8", encoding).replace("HERE", "é")
    file.write_bytes(edited(content, xml, other.encode(encoding)))
    with pytest.raises(RawDataError, match=r"a\.e57: its XML part is not in UTF-8") as error:
        read("laser", file, "e57")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "declaration",
    [
        b'<?xml version="1.0" encoding="UTF-7"?>',
        b"<?xml version='1.0' encoding='IBM037'?>",
        b'<?xml version="1.0"\r\n encoding = "UTF-16"?>',
        b'<?xml version="1.0" encoding="UTF-8" encoding="UTF-7"?>',
        b"<?xml encoding='UTF-7'?>",
    ],
)
def test_another_encoding_is_not_even_declared(declaration: bytes, content: bytes, file: Path) -> None:
    """Letters of ASCII alone, which mean something else in the encoding declared: UTF-7 writes < as +ADw-."""
    file.write_bytes(edited(content, DECLARATION, declaration + b"+ADwAIQ-DOCTYPE"))
    with pytest.raises(RawDataError, match=r"a\.e57: its XML part is not in UTF-8"):
        read("laser", file, "e57")


@pytest.mark.parametrize(
    "declaration",
    [
        DECLARATION,
        b"",
        b'<?xml version="1.0"?>',
        b"<?xml version='1.0' encoding='utf-8' standalone='yes' ?>",
        b"\xef\xbb\xbf" + DECLARATION,
    ],
)
def test_sound_files_are_read(declaration: bytes, content: bytes, file: Path) -> None:
    file.write_bytes(edited(content, DECLARATION, declaration))
    columns, dropped = read("laser", file, "e57")
    assert rows(columns) == 2
    assert not dropped


HEADERS = {
    "XML beyond the end": (24, 2**40),
    "XML beyond any number": (24, 2**64 - 1),
    "XML in the header": (24, 0),
    "XML in a checksum": (24, 1022),
    "no XML": (32, 0),
    "XML longer than the file": (32, 100_000),
    "XML longer than anything": (32, 2**64 - 1),
    "pages of no size": (40, 0),
    "pages of another size": (40, 2048),
}


@pytest.mark.parametrize("field", HEADERS)
def test_a_header_that_lies(field: str, content: bytes, file: Path) -> None:
    at, number = HEADERS[field]
    file.write_bytes(content[:at] + struct.pack("<Q", number) + content[at + 8 :])
    with pytest.raises(RawDataError, match=r"a\.e57: its E57 header is damaged") as error:
        read("laser", file, "e57")
    assert "\n" not in str(error.value)
