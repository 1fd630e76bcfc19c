"""LAS and LAZ, byte by byte: points, scales, headers, damage, stretches and frames."""

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.artefacts.sampling import ALL, scattered
from pipeline.errors import ConfigError, PoolcalError, RawDataError
from pipeline.readers import las as reader
from pipeline.readers.dispatch import raw_parts
from tests.support.files import build
from tests.support.files.build import las, read, rows
from tests.support.files.las_files import ADJUSTED, las_points, laz_of

NAN, INF = float("nan"), float("inf")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.las"


@pytest.mark.parametrize("scale", [0.0, -0.001, NAN, INF])
def test_impossible_scale(scale: float, file: Path) -> None:
    file.write_bytes(las(las_points(3), scale=scale))
    with pytest.raises(RawDataError, match=r"a\.las.*header"):
        read("laser", file, "las")


def test_no_points(file: Path) -> None:
    file.write_bytes(las([]))
    columns, dropped = read("laser", file, "las")
    assert rows(columns) == 0
    assert not dropped


@pytest.mark.parametrize("claimed", [4, 1000, 2**32 + 5, 2**63])
def test_header_that_claims_more_than_there_is(claimed: int, file: Path) -> None:
    file.write_bytes(las(las_points(3), claimed=claimed))
    columns, dropped = read("laser", file, "las")
    assert rows(columns) == 3
    assert dropped == {"truncated": claimed - 3}


@pytest.mark.parametrize("claimed", [1000, 4_000_000_000])
def test_laz_header_that_claims_more_than_there_is(claimed: int, file: Path) -> None:
    content = bytearray(laz_of(las(las_points(50))))
    content[247:255] = struct.pack("<Q", claimed)
    file.write_bytes(content)
    try:
        columns, dropped = read("laser", file, "las")
    except RawDataError as error:
        assert "a.las" in str(error)
    else:
        assert rows(columns) <= 50
        assert rows(columns) + sum(dropped.values()) == claimed


@pytest.mark.parametrize(("offset", "value"), [(94, 60_000), (96, 2**32 - 1), (100, 2**32 - 1), (105, 0), (104, 0x3F)])
def test_damaged_header(offset: int, value: int, file: Path) -> None:
    content = bytearray(las(las_points(3)))
    size = {94: 2, 96: 4, 100: 4, 105: 2, 104: 1}[offset]
    content[offset : offset + size] = value.to_bytes(size, "little")
    file.write_bytes(content)
    with pytest.raises(RawDataError, match=r"a\.las.*copy or export it again"):
        read("laser", file, "las")


@pytest.mark.parametrize("tenth", range(1, 10))
@pytest.mark.parametrize("compress", [bytes, laz_of], ids=["las", "laz"])
def test_cut_at_each_tenth(compress, tenth: int, file: Path) -> None:
    whole = compress(las(las_points(60)))
    cut = len(whole) * tenth // 10 + 1
    file.write_bytes(whole[:cut])
    try:
        columns, dropped = read("laser", file, "las")
    except PoolcalError as error:
        assert "\n" not in str(error)
        assert compress is laz_of or cut < 375
    else:
        before = max(0, (cut - 375) // 30)
        assert columns["z_m"].tolist() == pytest.approx([1.0 + k / 1000 for k in range(before)])
        assert dropped == {"truncated": 60 - before}


@pytest.mark.parametrize(
    ("compress", "stretch"), [(bytes, 1), (bytes, 7), (bytes, 99), (bytes, 100), (bytes, 101), (laz_of, 40)]
)
def test_stretches_are_the_whole(compress, stretch: int, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file.write_bytes(compress(las(las_points(100))))
    whole, _ = read("laser", file, "las")
    monkeypatch.setattr(reader, "STRETCH_POINTS", stretch)
    parts = raw_parts("laser", build.settings("laser", [file.name], "las"), file.parent)
    assert len(parts) == -(-100 // stretch)
    assert len({part.name for part in parts}) == len(parts)
    pieces = [chunk for part in parts for chunk in part.chunks()]
    for name, values in whole.items():
        assert np.array_equal(np.concatenate([piece.columns[name] for piece in pieces]), values)
    assert not any(piece.dropped for piece in pieces)


@pytest.mark.parametrize("compress", [bytes, laz_of])
@pytest.mark.parametrize("frame", ["laser", "EPSG:4978"])
def test_a_sample_is_the_rows_that_draw_small_numbers(compress, frame: str, file: Path) -> None:
    """With one point in seven without a time, which is no usable row, drawn or not."""
    points = [(x, y, z, 0.0 if k % 7 == 0 else t) for k, (x, y, z, t) in enumerate(las_points(2000))]
    file.write_bytes(compress(las(points)))
    (part,) = raw_parts("laser", build.settings("laser", [file.name], "las", frame=frame), file.parent)
    assert isinstance(part, reader.LasPart)
    (whole,), (sample,) = part.chunks(), replace(part, limit=ALL // 4).chunks()
    drawn = scattered(whole.columns["t_ns"]) <= ALL // 4
    assert 300 < drawn.sum() < 550
    for name, values in whole.columns.items():
        np.testing.assert_array_equal(sample.columns[name], values[drawn])
    assert sample.dropped == whole.dropped == {"no time": 286}
    assert (whole.undrawn, sample.undrawn) == (0, np.count_nonzero(~drawn))


def test_stretches_of_a_cut_file_count_its_loss_once(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "STRETCH_POINTS", 20)
    file.write_bytes(las(las_points(50), claimed=90))
    columns, dropped = read("laser", file, "las")
    assert rows(columns) == 50
    assert dropped == {"truncated": 40}


# --- frames ----------------------------------------------------------------------------------------------------------
def _one(file: Path, x: float, y: float, z: float) -> None:
    file.write_bytes(las([(round(x * 1e7), round(y * 1e7), round(z * 1e7), ADJUSTED + 0.001)], scale=1e-7))


def test_geographic_frame_becomes_ecef(file: Path) -> None:
    """EPSG:4979, x = longitude, y = latitude; on the equator ECEF is known without a program."""
    _one(file, 90.0, 0.0, 10.0)
    columns, _ = read("laser", file, "las", frame="EPSG:4979")
    assert [columns[name][0] for name in ("x_m", "y_m", "z_m")] == pytest.approx([0.0, 6_378_147.0, 0.0], abs=1e-6)


def test_ecef_frame_stays(file: Path) -> None:
    _one(file, 1.5, 2.5, -3.5)
    columns, _ = read("laser", file, "las", frame="EPSG:4978")
    assert [columns[name][0] for name in ("x_m", "y_m", "z_m")] == pytest.approx([1.5, 2.5, -3.5])


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        ("EPSG:0", "EPSG:4978"),
        ("lasers", "EPSG:4978"),
        ("EPSG:32651", "height"),
        ("EPSG:4326", "height"),
        ("\0", "laser"),
    ],
)
def test_frame_that_cannot_be_used(frame: str, words: str, file: Path) -> None:
    _one(file, 1.0, 2.0, 3.0)
    with pytest.raises(ConfigError, match=rf"laser\.frame.*{words}") as error:
        read("laser", file, "las", frame=frame)
    assert "\n" not in str(error.value)


def test_points_that_the_frame_cannot_hold(file: Path) -> None:
    points = [(0, 0, 1, ADJUSTED + 0.001), (0, 2_000_000_000, 1, ADJUSTED + 0.002)]  # latitude 200 degrees
    file.write_bytes(las(points, scale=1e-7))
    columns, dropped = read("laser", file, "las", frame="EPSG:4979")
    assert rows(columns) == 1
    assert sum(dropped.values()) == 1
