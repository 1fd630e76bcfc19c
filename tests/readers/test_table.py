"""Tables, CSV and Parquet."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipeline.errors import PoolcalError, RawDataError
from tests.support.files.build import WEEK, read, rows

NS = 1_000_000_000
WEEK_NS = 604_800 * NS
FIRST = WEEK * WEEK_NS
INS: dict[str, list[Any]] = {
    "gps_ns": [FIRST + 1, FIRST + 5_000_002], "latitude_deg": [36.0, 36.1], "longitude_deg": [120.0, 120.1],
    "height_m": [50.0, 50.5], "roll_deg": [1.0, -1.0], "pitch_deg": [2.0, -2.0], "heading_deg": [-90.0, 359.0],
}  # fmt: skip
LASER: dict[str, list[Any]] = {"gps_ns": [FIRST, FIRST + 7], "x_m": [1.5, 2.5], "y_m": [0.0, -1.0], "z_m": [3.0, 4.0]}
MBES: dict[str, list[Any]] = {
    "gps_ns": [FIRST, FIRST], "ping": [7, 7], "beam": [0, 1], "angle_deg": [-30.0, 45.0],
    "sound_speed_m_s": [1480.0, 1480.0], "two_way_time_s": [0.01, 0.02],
}  # fmt: skip
TABLES: dict[str, dict[str, list[Any]]] = {"ins": INS, "laser": LASER, "mbes": MBES}


def text(table: dict[str, list[Any]], separator: str = ",", end: str = "\n") -> bytes:
    lines = [separator.join(table)] + [separator.join(map(str, row)) for row in zip(*table.values(), strict=True)]
    return "".join(line + end for line in lines).encode()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.table"


def write(file: Path, table: dict[str, list[Any]], kind: str) -> None:
    if kind == "csv":
        file.write_bytes(text(table))
    else:
        pq.write_table(pa.table(table), file)


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_ins(kind: str, file: Path) -> None:
    write(file, INS, kind)
    columns, dropped = read("ins", file, "table")
    assert not dropped
    assert columns["t_ns"].tolist() == INS["gps_ns"]
    assert columns["height_m"].tolist() == INS["height_m"]
    for name in ("latitude", "longitude", "roll", "pitch"):
        assert np.degrees(columns[f"{name}_rad"]) == pytest.approx(INS[f"{name}_deg"], rel=1e-15), name
    assert np.degrees(columns["azimuth_rad"]) == pytest.approx([270.0, 359.0])


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_laser(kind: str, file: Path) -> None:
    write(file, LASER, kind)
    columns, dropped = read("laser", file, "table", latency_s=0.5)
    assert not dropped
    assert columns["t_ns"].tolist() == [time - NS // 2 for time in LASER["gps_ns"]]
    assert [columns[name].tolist() for name in ("x_m", "y_m", "z_m")] == [LASER[name] for name in ("x_m", "y_m", "z_m")]


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize("by_range", [False, True])
def test_mbes(by_range: bool, kind: str, file: Path) -> None:
    table = dict(MBES)
    if by_range:
        table["range_m"] = [1480.0 * time / 2 for time in table.pop("two_way_time_s")]
    write(file, table, kind)
    columns, dropped = read("mbes", file, "table")
    assert not dropped
    assert columns["two_way_time_s"] == pytest.approx([0.01, 0.02], rel=1e-15)
    assert columns["angle_rad"] == pytest.approx(np.radians([-30.0, 45.0]), rel=1e-15)
    assert columns["ping"].tolist() == [7, 7]
    assert columns["beam"].tolist() == [0, 1]


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize("sensor", TABLES)
def test_week_and_seconds(sensor: Any, kind: str, file: Path) -> None:
    times = {"gps_week": [WEEK, WEEK], "seconds_of_week": [10.123456789, 10.25]}
    write(file, times | {name: values for name, values in TABLES[sensor].items() if name != "gps_ns"}, kind)
    columns, dropped = read(sensor, file, "table")
    assert not dropped
    assert (columns["t_ns"] - FIRST).tolist() == [10_123_456_789, 10_250_000_000]


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize(("sensor", "missing"), [(sensor, name) for sensor, table in TABLES.items() for name in table])
def test_missing_column(sensor: Any, missing: str, kind: str, file: Path) -> None:
    write(file, {name: values for name, values in TABLES[sensor].items() if name != missing}, kind)
    with pytest.raises(RawDataError, match=rf"a\.table.*{missing}"):
        read(sensor, file, "table")


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_times_as_floats_are_refused(kind: str, file: Path) -> None:
    """A double has no place for nanoseconds since 1980."""
    write(file, LASER | {"gps_ns": [FIRST + 0.5, FIRST + 1.5]}, kind)
    with pytest.raises(RawDataError, match=r"a\.table"):
        read("laser", file, "table")


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize("value", ["east", "1,5", "0x10", "--"])
def test_words_for_numbers_are_refused_or_counted(value: str, kind: str, file: Path) -> None:
    write(file, LASER | {"x_m": ["1.5", value]}, kind)
    try:
        columns, dropped = read("laser", file, "table")
    except RawDataError as error:
        assert "a.table" in str(error)
        assert "\n" not in str(error)
    else:
        assert rows(columns) == 1
        assert sum(dropped.values()) == 1


@pytest.mark.parametrize("value", ["", "nan", "NaN", "inf", "null"])
@pytest.mark.parametrize("sensor", TABLES)
def test_missing_and_infinite_values_are_counted(sensor: Any, value: str, file: Path) -> None:
    name = list(TABLES[sensor])[-1]
    file.write_bytes(text(TABLES[sensor] | {name: [TABLES[sensor][name][0], value]}))
    columns, dropped = read(sensor, file, "table")
    assert rows(columns) == 1
    assert sum(dropped.values()) == 1


@pytest.mark.parametrize("sensor", TABLES)
def test_missing_values_in_parquet(sensor: Any, file: Path) -> None:
    for name, values in TABLES[sensor].items():
        write(file, TABLES[sensor] | {name: [values[0], None]}, "parquet")
        columns, dropped = read(sensor, file, "table")
        assert rows(columns) == 1
        assert sum(dropped.values()) == 1


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf", b"# exported\n", b"\n\n"])
def test_forms_of_text(start: bytes, end: str, separator: str, file: Path) -> None:
    file.write_bytes(start + text(LASER, separator, end))
    columns, dropped = read("laser", file, "table")
    assert not dropped
    assert columns["z_m"].tolist() == [3.0, 4.0]


def test_quotes_other_columns_and_any_order(file: Path) -> None:
    first, second = f'3.0,"a, b",{FIRST},"1.5",0', f'4.0,"say ""hi""","{FIRST + 7}",2.5,-1'
    lines = ['"z_m",note,"gps_ns",x_m,"y_m"', first, second, ""]
    file.write_bytes("\n".join(lines).encode())
    columns, dropped = read("laser", file, "table")
    assert not dropped
    assert columns["x_m"].tolist() == [1.5, 2.5]
    assert columns["t_ns"].tolist() == LASER["gps_ns"]


def test_chinese_notes(file: Path) -> None:
    file.write_bytes(text(LASER | {"备注": ["水池", "测试"]}))
    columns, dropped = read("laser", file, "table")
    assert not dropped
    assert rows(columns) == 2


def test_rows_of_another_length_are_counted(file: Path) -> None:
    file.write_bytes(text(LASER) + b"1,2\n1,2,3,4,5,6\n" + text(LASER).split(b"\n", 1)[1])
    columns, dropped = read("laser", file, "table")
    assert rows(columns) == 4
    assert sum(dropped.values()) == 2


def test_last_line_that_was_cut(file: Path) -> None:
    """1.5 must not become 1: a last line without its end is left out."""
    file.write_bytes(text(LASER)[:-1])
    columns, dropped = read("laser", file, "table")
    assert rows(columns) == 1
    assert sum(dropped.values()) == 1


@pytest.mark.parametrize("sensor", TABLES)
def test_only_names(sensor: Any, file: Path) -> None:
    for kind in ("csv", "parquet"):
        write(file, {name: [] for name in TABLES[sensor]}, "csv")
        if kind == "parquet":
            typed = {name: pa.array(values)[:0] for name, values in TABLES[sensor].items()}
            pq.write_table(pa.table(typed), file)
        columns, dropped = read(sensor, file, "table")
        assert rows(columns) == 0
        assert not dropped


@pytest.mark.parametrize("content", [b"", b"\n", b"\xef\xbb\xbf", b"\n\n\n", b"x_m", b"gps_ns,x_m,y_m,z_m"])
def test_empty(content: bytes, file: Path) -> None:
    file.write_bytes(content)
    with pytest.raises(RawDataError, match=r"a\.table"):
        read("laser", file, "table")


@pytest.mark.parametrize("column", ["gps_ns", "seconds_of_week", "latitude_deg", "longitude_deg"])
def test_single_precision_in_parquet(column: str, file: Path) -> None:
    table: dict[str, Any] = dict(INS)
    if column == "seconds_of_week":
        del table["gps_ns"]
        table |= {"gps_week": [WEEK, WEEK], "seconds_of_week": [10.0, 10.5]}
    table[column] = pa.array(np.array(table[column], np.float64 if column == "gps_ns" else np.float32))
    pq.write_table(pa.table(table), file)
    with pytest.raises(RawDataError, match=rf"a\.table.*{column}"):
        read("ins", file, "table")


def test_single_precision_in_text(file: Path) -> None:
    """Digits as a program prints them that kept positions as float32."""
    latitude = (36 + np.arange(500) * 1e-6).astype(np.float32).astype(float)
    table = {name: [values[0]] * 500 for name, values in INS.items()}
    table |= {"gps_ns": [FIRST + k for k in range(500)], "latitude_deg": latitude.tolist()}
    file.write_bytes(text(table))
    with pytest.raises(RawDataError, match=r"a\.table.*float32"):
        read("ins", file, "table")


WRONG: list[tuple[Any, str, Any]] = [
    ("ins", "gps_ns", -5), ("ins", "gps_ns", 0), ("ins", "gps_ns", 2**62), ("ins", "latitude_deg", 91.0),
    ("ins", "latitude_deg", -90.0), ("ins", "roll_deg", 200.0), ("ins", "pitch_deg", 91.0), ("ins", "height_m", 1e7),
    ("mbes", "beam", -1), ("mbes", "beam", 40_000), ("mbes", "sound_speed_m_s", 340.0), ("mbes", "two_way_time_s", 0.0),
    ("mbes", "two_way_time_s", -0.1), ("mbes", "angle_deg", 170.0), ("laser", "gps_ns", 99),
]  # fmt: skip


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize(("sensor", "name", "value"), WRONG)
def test_impossible_values_are_counted(sensor: Any, name: str, value: Any, kind: str, file: Path) -> None:
    write(file, TABLES[sensor] | {name: [TABLES[sensor][name][0], value]}, kind)
    columns, dropped = read(sensor, file, "table")
    assert rows(columns) == 1
    assert sum(dropped.values()) == 1


def test_a_few_steps_back_are_left_out_and_many_refused(file: Path) -> None:
    times = list(range(FIRST, FIRST + 1000))
    for swapped, there in ((5, True), (500, False)):
        order = times[:500] + times[500 - swapped : 500] + times[500:]
        write(file, {name: [values[0]] * len(order) for name, values in INS.items()} | {"gps_ns": order}, "csv")
        if there:
            columns, dropped = read("ins", file, "table")
            assert rows(columns) == 1000
            assert sum(dropped.values()) == swapped
        else:
            with pytest.raises(RawDataError, match="backwards"):
                read("ins", file, "table")


@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize("tenth", range(1, 10))
def test_cut_at_each_tenth(tenth: int, kind: str, file: Path) -> None:
    table = {"gps_ns": [FIRST + k for k in range(100)], "x_m": [k / 8 for k in range(100)]}
    write(file, table | {"y_m": [0.5] * 100, "z_m": [1.5] * 100}, kind)
    whole = file.read_bytes()
    cut = len(whole) * tenth // 10
    file.write_bytes(whole[:cut])
    try:
        columns, _ = read("laser", file, "table")
    except PoolcalError as error:
        assert kind == "parquet"
        assert "\n" not in str(error)
    else:
        count = rows(columns)
        assert count == whole[:cut].count(b"\n") - 1
        assert columns["x_m"].tolist() == table["x_m"][:count]
