"""Times of LAS and LAZ: adjusted standard time, seconds of the week, and headers whose flag is wrong."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.config.session import Ins, Laser, SessionConfig
from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.dispatch import raw_parts
from tests.support.files import build
from tests.support.files.build import WEEK, las, read, rows
from tests.support.files.las_files import ADJUSTED, las_points, laz_of

NS = 1_000_000_000
WEEK_NS = 604_800 * NS
NAN, INF = float("nan"), float("inf")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.las"


@pytest.mark.parametrize("compress", [bytes, laz_of], ids=["las", "laz"])
def test_adjusted_standard_time(compress, file: Path) -> None:
    file.write_bytes(compress(las([(1, -2, 3, ADJUSTED + 0.25), (2**31 - 1, -(2**31), 0, ADJUSTED + 0.5)])))
    columns, dropped = read("laser", file, "las")
    assert not dropped
    assert columns["t_ns"].tolist() == [1_400_000_000 * NS + NS // 4, 1_400_000_000 * NS + NS // 2]
    assert columns["x_m"] == pytest.approx([0.001, 2_147_483.647], rel=1e-15)
    assert columns["y_m"] == pytest.approx([-0.002, -2_147_483.648], rel=1e-15)
    assert columns["z_m"] == pytest.approx([0.003, 0.0], rel=1e-15)


def test_adjusted_time_needs_no_week(file: Path) -> None:
    file.write_bytes(las(las_points(3)))
    columns, _ = read("laser", file, "las", gps_week=1234)
    assert columns["t_ns"][0] // NS == 1_400_000_000


@pytest.mark.parametrize("compress", [bytes, laz_of], ids=["las", "laz"])
def test_week_seconds(compress, file: Path) -> None:
    file.write_bytes(compress(las([(0, 0, 1, 1000.25), (0, 0, 2, 1000.375)], adjusted=False)))
    columns, dropped = read("laser", file, "las", gps_week=WEEK)
    assert not dropped
    assert (columns["t_ns"] - WEEK * WEEK_NS).tolist() == [1000 * NS + NS // 4, 1000 * NS + 3 * NS // 8]


def test_week_seconds_without_week(file: Path) -> None:
    file.write_bytes(las(las_points(3, 1000.001), adjusted=False))
    with pytest.raises(ConfigError, match=r"laser\.gps_week.*a\.las.*GPS week"):
        read("laser", file, "las")


def test_week_seconds_over_the_end_of_the_week(file: Path) -> None:
    times = [604_799.25, 604_799.5, 0.125, 0.375]
    file.write_bytes(las([(0, 0, 1, time) for time in times], adjusted=False))
    columns, _ = read("laser", file, "las", gps_week=WEEK)
    assert np.diff(columns["t_ns"]).tolist() == [NS // 4, NS * 5 // 8, NS // 4]


def test_files_on_both_sides_of_the_end_of_the_week(tmp_path: Path) -> None:
    """gps_week is the first file's; the second begins in the next."""
    (tmp_path / "a.las").write_bytes(las(las_points(3, 604_790.0), adjusted=False))
    (tmp_path / "b.las").write_bytes(las(las_points(3, 5.0), adjusted=False))
    settings = build.settings("laser", ["*.las"], "las", gps_week=WEEK)
    starts = [next(part.chunks()).columns["t_ns"][0] for part in raw_parts("laser", settings, tmp_path)]
    assert [int(start) - WEEK * WEEK_NS for start in starts] == [604_790 * NS, 604_805 * NS]


@pytest.mark.parametrize("latency_s", [0.02, -0.1])
def test_latency_is_taken_off(latency_s: float, file: Path) -> None:
    file.write_bytes(las([(0, 0, 1, ADJUSTED + 1.0)]))
    columns, _ = read("laser", file, "las", latency_s=latency_s)
    assert columns["t_ns"][0] == 1_400_000_001 * NS - round(latency_s * NS)


def test_flag_that_contradicts_the_times(file: Path) -> None:
    file.write_bytes(las(las_points(3), adjusted=False))
    with pytest.raises(RawDataError, match=r"a\.las.*seconds of GPS week.*export"):
        read("laser", file, "las", gps_week=WEEK)
    file.write_bytes(las(las_points(3, 345_600.001), adjusted=True))
    with pytest.raises(RawDataError, match=r"a\.las.*adjusted standard.*export"):
        read("laser", file, "las")


# --- laser.time: where the header's flag is wrong ---------------------------------------------------------------------
@pytest.mark.parametrize("compress", [bytes, laz_of], ids=["las", "laz"])
@pytest.mark.parametrize("flag", [True, False])
def test_adjusted_times_whatever_the_flag(compress, flag: bool, file: Path) -> None:
    content = bytearray(compress(las([(0, 0, 1, ADJUSTED + 0.25), (0, 0, 2, ADJUSTED + 0.5)])))
    content[6] = int(flag)
    file.write_bytes(content)
    columns, dropped = read("laser", file, "las", time="adjusted_standard")
    assert not dropped
    assert columns["t_ns"].tolist() == [1_400_000_000 * NS + NS // 4, 1_400_000_000 * NS + NS // 2]


@pytest.mark.parametrize("flag", [True, False])
def test_seconds_of_week_whatever_the_flag(flag: bool, file: Path) -> None:
    file.write_bytes(las([(0, 0, 1, 1000.25), (0, 0, 2, 1000.375)], adjusted=flag))
    columns, _ = read("laser", file, "las", gps_week=WEEK, time="seconds_of_week")
    assert (columns["t_ns"] - WEEK * WEEK_NS).tolist() == [1000 * NS + NS // 4, 1000 * NS + 3 * NS // 8]
    with pytest.raises(ConfigError, match=r"laser\.gps_week is missing"):
        read("laser", file, "las", time="seconds_of_week")


@pytest.mark.parametrize("week", [None, WEEK])
def test_wrong_flag_names_the_key(week: int | None, file: Path) -> None:
    """Before a week is asked for that would not help."""
    file.write_bytes(las(las_points(3), adjusted=False))
    with pytest.raises(RawDataError, match=r"a\.las: its header promises seconds.*laser\.time: adjusted_standard"):
        read("laser", file, "las", gps_week=week)
    file.write_bytes(las(las_points(3, 345_600.001)))
    with pytest.raises(RawDataError, match=r"a\.las: its header promises adj.*laser\.time: seconds_of_week"):
        read("laser", file, "las", gps_week=week)


@pytest.mark.parametrize("flag", [True, False])
def test_a_key_that_the_times_contradict(flag: bool, file: Path) -> None:
    """Whatever the flag says: times of both kinds do not overlap."""
    file.write_bytes(las(las_points(3), adjusted=flag))
    with pytest.raises(RawDataError, match=r"a\.las: laser\.time: seconds_of_week .*but 4000.*laser\.time") as error:
        read("laser", file, "las", gps_week=WEEK, time="seconds_of_week")
    assert "\n" not in str(error.value)
    file.write_bytes(las(las_points(3, 345_600.001), adjusted=flag))
    with pytest.raises(RawDataError, match=r"a\.las: laser\.time: adjusted_standard .*but 3456.*laser\.time"):
        read("laser", file, "las", time="adjusted_standard")


@pytest.mark.parametrize("time", ["adjusted_standard", "seconds_of_week", None])
def test_times_of_no_kind(time: str | None, file: Path) -> None:
    file.write_bytes(las(las_points(3, -5e9), adjusted=time == "adjusted_standard"))
    with pytest.raises(RawDataError, match=r"a\.las: .*neither of the two times that LAS has; export it again"):
        read("laser", file, "las", gps_week=WEEK, time=time)


def test_a_first_point_at_infinity_moves_no_week(file: Path) -> None:
    points = [(k, k, k, seconds) for k, seconds in enumerate((float("inf"), 300_000.0001, 300_000.1001))]
    file.write_bytes(las(points, adjusted=False))
    columns, dropped = read("laser", file, "las", gps_week=WEEK)
    assert (columns["t_ns"] // (604_800 * 10**9)).tolist() == [WEEK, WEEK]
    assert dropped == {"not a finite number": 1}


def test_a_huge_time_is_told_in_few_digits(file: Path) -> None:
    file.write_bytes(las([(1, 2, 3, 1e300)] * 5, adjusted=False))
    with pytest.raises(RawDataError, match=r"a\.las: its header promises .*but 1e\+300 is not that"):
        read("laser", file, "las", gps_week=WEEK)


def test_another_time_has_the_files_read_again() -> None:
    """All settings that read the files are in the recordings; they put stage ingest out of date."""
    ins, laser = Ins(files=["a.gps"], format="novatel"), Laser(files=["a.las"], format="las", mount=build.MOUNT)
    as_told, as_said = (
        SessionConfig(name="a", ins=ins, laser=laser.model_copy(update={"time": time})).recordings
        for time in (None, "adjusted_standard")
    )
    assert as_told != as_said
    assert as_told.ins == as_said.ins


def test_time_belongs_to_las() -> None:
    with pytest.raises(ValueError, match="time says what times of LAS count from, but format is e57"):
        build.settings("laser", ["a"], "e57", time="adjusted_standard")
    with pytest.raises(ValueError, match="adjusted_standard"):
        build.settings("laser", ["a"], "las", time="adjusted")


@pytest.mark.parametrize(("week", "count"), [(999.99, 0), (1000.01, 1), (4999.99, 1), (5000.01, 0)])
def test_first_and_last_week(week: float, count: int, file: Path) -> None:
    """As everywhere: from week 1000, March 1999, to week 5000, 2075."""
    file.write_bytes(las([(0, 0, 1, ADJUSTED + 0.001), (0, 0, 2, week * 604_800 - 1e9)]))
    columns, dropped = read("laser", file, "las")
    assert rows(columns) == 1 + count
    assert dropped == ({} if count else {"impossible time": 1})


def test_without_times(file: Path) -> None:
    file.write_bytes(las(las_points(3), point_format=0))
    with pytest.raises(RawDataError, match=r"a\.las.*no GPS time.*export"):
        read("laser", file, "las")
    file.write_bytes(las([(1, 2, 3, 0.0)] * 5))
    with pytest.raises(RawDataError, match=r"a\.las.*GPS times are 0.*export"):
        read("laser", file, "las")


def test_times_of_single_precision(file: Path) -> None:
    times = np.float32(345_600) + np.arange(1000, dtype=np.float32) / np.float32(32)
    file.write_bytes(las([(0, 0, 1, float(time)) for time in times], adjusted=False))
    with pytest.raises(RawDataError, match=r"a\.las.*float32.*export"):
        read("laser", file, "las", gps_week=WEEK)


@pytest.mark.parametrize("time", [NAN, INF, -INF, 0.0, -1e15, 1e300])
def test_impossible_times(time: float, file: Path) -> None:
    file.write_bytes(las([(0, 0, 1, ADJUSTED + 0.001), (0, 0, 2, time), (0, 0, 3, ADJUSTED + 0.003)]))
    columns, dropped = read("laser", file, "las")
    assert columns["z_m"].tolist() == pytest.approx([0.001, 0.003])
    assert sum(dropped.values()) == 1
