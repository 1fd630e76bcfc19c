"""Files of which a few bytes claim any number of points: refused by their headers, before anything is unpacked."""

import io
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipeline.errors import RawDataError
from pipeline.readers import e57_scans, las, table_columns
from pipeline.readers.claimed_counts import RECORDS_PER_BYTE, refuse_claim
from pipeline.readers.dispatch import raw_parts
from tests.support.files import build, e57_files
from tests.support.files.build import read, rows
from tests.support.files.e57_files import POINTS, START_S, TIMES

COUNT = 2_000_000
TIME = 1_400_000_000 * 10**9


def parquet(count: int) -> bytes:
    out = io.BytesIO()
    time = pa.array(np.full(count, TIME))
    axes = {f"{axis}_m": pa.array(np.full(count, 1.5)) for axis in "xyz"}
    pq.write_table(pa.table({"gps_ns": time} | axes), out, compression="zstd")
    return out.getvalue()


def laz(count: int) -> bytes:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 0.001)
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    data = laspy.LasData(header, laspy.ScaleAwarePointRecord.zeros(count, header=header))
    data.gps_time = np.full(count, 4e8 + 0.001)
    out = io.BytesIO()
    data.write(out, do_compress=True)
    return out.getvalue()


HOSTILE = {"las": laz, "table": parquet}


@pytest.fixture(params=HOSTILE)
def small(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, Path]:
    path = tmp_path / "a.bin"
    path.write_bytes(HOSTILE[request.param](COUNT))
    assert path.stat().st_size < COUNT / RECORDS_PER_BYTE
    return request.param, path


def refused(kind: str, path: Path, words: str, **more: Any) -> None:
    with pytest.raises(RawDataError, match=rf"a\.bin: claims {COUNT} records in .*{words}") as error:
        read("laser", path, kind, **more)
    assert "\n" not in str(error.value)


def test_more_than_the_size_makes_likely(small: tuple[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    kind, path = small
    monkeypatch.setattr(las, "decompressed_points", lambda *given: pytest.fail("unpacked"))
    monkeypatch.setattr(pq.ParquetFile, "iter_batches", lambda *given, **more: pytest.fail("unpacked"))
    refused(kind, path, rf"more than 16 a byte.*write laser\.max_records: {COUNT}")
    refused(kind, path, rf"laser\.max_records is {COUNT - 1}", max_records=COUNT - 1)


def test_the_key_lets_it_through(small: tuple[str, Path]) -> None:
    kind, path = small
    columns, dropped = read("laser", path, kind, max_records=COUNT)
    assert rows(columns) == COUNT
    assert not dropped


def test_all_scans_of_an_e57_count_together(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    scan = e57_files.Scan(POINTS | TIMES, START_S)
    e57_files.write(path, scan, scan)
    with pytest.raises(RawDataError, match=r"a\.e57: claims 6 records in \d+ bytes, laser\.max_records is 5"):
        read("laser", path, "e57", max_records=5)
    assert rows(read("laser", path, "e57", max_records=6)[0]) == 6
    assert len(e57_scans.read_scans(path, "a.e57")[0]) == 2


@pytest.mark.parametrize("sensor", ["ins", "mbes"])
def test_the_other_sensors_tables(sensor: str, tmp_path: Path) -> None:
    names = table_columns.INS_TABLE_COLUMNS if sensor == "ins" else (*table_columns.MBES_TABLE_COLUMNS, "range_m")
    columns = {name: np.full(COUNT, 5 if name in table_columns.WHOLE_NUMBERS else 5.0) for name in names}
    pq.write_table(pa.table({"gps_ns": np.full(COUNT, TIME)} | columns), tmp_path / "a.parquet", compression="zstd")
    (part,) = raw_parts(sensor, build.settings(sensor, ["a.parquet"], "table"), tmp_path)
    with pytest.raises(RawDataError, match=rf"a\.parquet: claims .* write {sensor}\.max_records"):
        next(iter(part.chunks()))


@pytest.mark.parametrize(
    ("claimed", "size"),
    [(40_000_000, 40_000_000 * 4), (36_000_000_000, 36_000_000_000 * 2), (10, 1000), (16_000, 1000), (0, 0)],
)
def test_real_sessions_pass(claimed: int, size: int) -> None:
    """40 million points of LAZ, four bytes each; ten hours at 1 MHz, two bytes each; small files."""
    refuse_claim(claimed, size, None, "laser", "a.laz")


@pytest.mark.parametrize(("claimed", "size", "most"), [(16_001, 1000, None), (-1, 1000, None), (11, 10**9, 10)])
def test_on_the_other_side(claimed: int, size: int, most: int | None) -> None:
    with pytest.raises(RawDataError, match=r"a\.laz: claims"):
        refuse_claim(claimed, size, most, "laser", "a.laz")
