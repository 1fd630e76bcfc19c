"""LAS and LAZ on real files, against figures that other programs gave for them."""

import pytest

from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, NS, WEEK_NS
from tests.real.conftest import Read
from tests.support.real_files import one_line

XYZ = ("x_m", "y_m", "z_m")


def test_las_of_week_seconds(read: Read) -> None:
    points, dropped = read("laser", "las", "laser/1.2-with-color.las", gps_week=1500)
    assert not dropped
    assert len(points["t_ns"]) == 1065
    assert [points[name][0] for name in XYZ] == pytest.approx([637012.24, 849028.31, 431.66], abs=1e-9)
    assert points["t_ns"][0] == 1500 * WEEK_NS + 245_380_782_549_626


def test_las_of_week_seconds_without_week(read: Read) -> None:
    with pytest.raises(ConfigError) as error:
        read("laser", "las", "laser/1.2-with-color.las")
    one_line(error, "laser.gps_week", "1.2-with-color.las")


def test_las_of_adjusted_time(read: Read) -> None:
    points, dropped = read("laser", "las", "laser/test1_4.las")
    assert not dropped
    assert len(points["t_ns"]) == 1000
    since_ns = int(points["t_ns"][0]) - ADJUSTED_STANDARD_OFFSET_S * NS
    assert since_ns == pytest.approx(83177420.53400505 * NS, abs=20)
    assert [points[name][0] for name in XYZ] == pytest.approx(
        [1694510.3869346841, 1816497.966263977, 5598.3596128149675], abs=1e-9
    )


def test_las_of_adjusted_time_without_its_flag(read: Read) -> None:
    """14,408 points; laspy's times and places. Without the key the refusal names it."""
    name = "laser/pdal/pdal_sample_c.las"
    for more in ({}, {"gps_week": 1500}):
        with pytest.raises(RawDataError) as error:
            read("laser", "las", name, **more)
        one_line(error, "pdal_sample_c.las", "laser.time: adjusted_standard")
    points, dropped = read("laser", "las", name, time="adjusted_standard")
    assert not dropped
    assert len(points["t_ns"]) == 14_408
    assert points["t_ns"].min() - ADJUSTED_STANDARD_OFFSET_S * NS == pytest.approx(159_214_261.5561611 * NS, abs=200)
    assert [points[name][0] for name in XYZ] == pytest.approx([674_522.0, 1_206_771.75, 627.59], abs=1e-4)
    with pytest.raises(RawDataError) as error:
        read("laser", "las", name, time="seconds_of_week", gps_week=1500)
    one_line(error, "pdal_sample_c.las", "laser.time: seconds_of_week", "159214342")


def test_laz(read: Read) -> None:
    points, dropped = read("laser", "las", "laser/laspy_fullwave.laz", gps_week=2000)
    assert not dropped
    assert len(points["t_ns"]) == 10_750
    first, last = points["t_ns"].min() - 2000 * WEEK_NS, points["t_ns"].max() - 2000 * WEEK_NS
    assert (first, last) == (417_218_090_871_000, 417_219_079_417_000)
    assert [points[name][0] for name in XYZ] == pytest.approx([194288.587, 8249135.677, 994.355], abs=1e-6)
