"""LAZ is unpacked in a process of its own: a damaged file may end that process, never this one."""

import io
import struct
from pathlib import Path

import laspy
import numpy as np
import pytest

from pipeline.artefacts.streams import Chunk
from pipeline.config.mount import Mount
from pipeline.config.session import Laser
from pipeline.errors import RawDataError
from pipeline.readers import laz
from pipeline.readers.dispatch import raw_parts

COUNT = 120_000  # more than two of LASzip's chunks of 50,000
LEVEL = Mount(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, x_m=0.0, y_m=0.0, z_m=0.0)


@pytest.fixture(scope="module")
def content() -> bytes:
    """A LAZ file, point format 6, adjusted standard time."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 0.001)
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    points = laspy.LasData(header)
    points.points = laspy.ScaleAwarePointRecord.zeros(COUNT, header=header)
    points.x = np.arange(COUNT) % 1000 * 0.01
    points.gps_time = 3e8 + np.arange(COUNT) * 1.0001e-4
    stream = io.BytesIO()
    points.write(stream, do_compress=True)
    return stream.getvalue()


def read(path: Path, data: bytes) -> list[Chunk]:
    path.write_bytes(data)
    settings = Laser(files=[path.name], format="las", mount=LEVEL)
    return [chunk for part in raw_parts("laser", settings, path.parent) for chunk in part.chunks()]


def offset_of(content: bytes) -> int:
    return int(struct.unpack_from("<I", content, 96)[0])


def test_points_come_through_whole(content: bytes, tmp_path: Path) -> None:
    chunks = read(tmp_path / "a.laz", content)
    assert not any(chunk.dropped for chunk in chunks)
    t_ns = np.concatenate([chunk.columns["t_ns"] for chunk in chunks])
    x_m = np.concatenate([chunk.columns["x_m"] for chunk in chunks])
    expected_ns = 1_300_000_000 * 10**9 + np.arange(COUNT) * 100_010
    assert np.abs(t_ns - expected_ns).max() <= 30  # what a double has at 3e8 s
    assert np.abs(x_m - np.arange(COUNT) % 1000 * 0.01).max() < 1e-9


def test_stretches_of_one_file_are_its_points_in_order(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = np.concatenate([chunk.columns["t_ns"] for chunk in read(tmp_path / "a.laz", content)])
    monkeypatch.setattr("pipeline.readers.las.STRETCH_POINTS", 70_001)
    settings = Laser(files=["a.laz"], format="las", mount=LEVEL)
    parts = raw_parts("laser", settings, tmp_path)
    assert [part.name for part in parts] == ["a.laz#0", "a.laz#1"]
    pieces = [[chunk.columns["t_ns"] for chunk in part.chunks()] for part in parts]
    assert [sum(map(len, piece)) for piece in pieces] == [70_001, COUNT - 70_001]
    assert np.array_equal(np.concatenate([values for piece in pieces for values in piece]), whole)


@pytest.mark.parametrize("tenth", range(1, 10))
def test_cut_off(tenth: int, content: bytes, tmp_path: Path) -> None:
    with pytest.raises(RawDataError, match=r"a\.laz: .*copy"):
        read(tmp_path / "a.laz", content[: len(content) * tenth // 10])


@pytest.mark.parametrize("chunks", [0xFFFFFFFF, 4_000_000])
def test_table_that_claims_billions_of_chunks(chunks: int, content: bytes, tmp_path: Path) -> None:
    """lazrs would allocate 64 GB for it and be killed."""
    table = struct.unpack_from("<q", content, offset_of(content))[0]
    data = content[: table + 4] + struct.pack("<I", chunks) + content[table + 8 :]
    with pytest.raises(RawDataError, match="chunk table is damaged"):
        read(tmp_path / "a.laz", data)


def test_layer_that_claims_gigabytes(content: bytes, tmp_path: Path) -> None:
    """Sizes of layers stand behind the first chunk's first point and its count; memory there is limited."""
    at = offset_of(content) + 8 + 30 + 4
    with pytest.raises(RawDataError, match="is damaged"):
        read(tmp_path / "a.laz", content[:at] + b"\xff\xff\xff\xf0" * 9 + content[at + 36 :])


def test_header_and_laszip_record_that_disagree_on_the_size_of_a_point(content: bytes, tmp_path: Path) -> None:
    """Else each point would be read from the bytes of its neighbour."""
    (size,) = struct.unpack_from("<H", content, 105)
    data = content[:105] + struct.pack("<H", size + 2) + content[107:]
    with pytest.raises(RawDataError, match=r"a\.laz: is damaged.*another size"):
        read(tmp_path / "a.laz", data)


def test_header_that_claims_more_points(content: bytes, tmp_path: Path) -> None:
    """Not more parts than the chunks have room for."""
    data = content[:247] + struct.pack("<Q", 2**60) + content[255:]
    (tmp_path / "a.laz").write_bytes(data)
    settings = Laser(files=["a.laz"], format="las", mount=LEVEL)
    assert len(raw_parts("laser", settings, tmp_path)) == 1


@pytest.mark.parametrize(
    "program",
    [
        "import os; os.abort()",
        "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)",
        "raise SystemExit",
        "print(1)",
    ],
)
def test_end_of_the_worker_is_an_error_of_the_file(
    program: str, content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    worker = tmp_path / "worker.py"
    worker.write_text(program)
    monkeypatch.setattr(laz, "LAZ_WORKER", worker)
    with pytest.raises(RawDataError, match=r"a\.laz: is damaged"):
        read(tmp_path / "a.laz", content)


def test_worker_ends_with_its_reader(content: bytes, tmp_path: Path) -> None:
    """Whoever stops half-way leaves no process behind (and no warning)."""
    (tmp_path / "a.laz").write_bytes(content)
    settings = Laser(files=["a.laz"], format="las", mount=LEVEL)
    (part,) = raw_parts("laser", settings, tmp_path)
    chunks = part.chunks()
    assert len(next(chunks).columns["t_ns"])
    chunks.close()


def test_where_a_wide_pipe_is_not_allowed_a_small_one_will_do(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise PermissionError("the user's pipes are full")

    monkeypatch.setattr("pipeline.readers.decoder_process.fcntl.fcntl", refused)
    assert sum(len(chunk.columns["t_ns"]) for chunk in read(tmp_path / "a.laz", content)) == COUNT
