"""SBET and its accuracy file on real files, against figures that other programs gave for them."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import NS, WEEK_NS
from tests.real.conftest import Read
from tests.support.real_files import ATLANS, INS, one_line


def test_accuracy_file(read: Read, data: Path, tmp_path: Path) -> None:
    """10,495 records at the times of the SBET; the first roll RMS is 0.165451 arc-minutes."""
    (tmp_path / "x.smr").write_bytes((data / "ins/sbet_ATLANS-20181023-accuracy.out").read_bytes())
    sigmas, dropped = read("ins", "sbet", ATLANS, sigmas=True, gps_week=2024, accuracy=["x.smr"])
    ins, _ = read("ins", "sbet", ATLANS, gps_week=2024)
    assert not dropped
    assert len(sigmas["t_ns"]) == 10_495
    assert np.array_equal(sigmas["t_ns"], ins["t_ns"])
    assert sigmas["roll_deg"][0] == pytest.approx(0.002758, abs=5e-7)
    assert 0.001 < np.median(sigmas["pitch_deg"]) < 0.01
    assert 0.001 < np.median(sigmas["heading_deg"]) < 0.1


def test_sbet_of_pdal(read: Read) -> None:
    ins, dropped = read("ins", "sbet", "ins/pdal_2-points.sbet", gps_week=1800)
    assert not dropped
    assert len(ins["t_ns"]) == 2
    assert ins["t_ns"][0] == 1800 * WEEK_NS + 151_631_002_836_071
    degrees = [32.545149, -116.978180, -1.611964, -1.392233, 174.567247 + 1.259599]
    names = ("latitude_rad", "longitude_rad", "roll_rad", "pitch_rad", "azimuth_rad")
    assert [np.degrees(ins[name][0]) for name in names] == pytest.approx(degrees, abs=1e-4)
    assert ins["height_m"][0] == pytest.approx(107.7152953296560, abs=1e-13)


def test_sbet_of_a_boat(read: Read) -> None:
    ins, dropped = read("ins", "sbet", ATLANS, gps_week=2024)
    assert not dropped
    assert len(ins["t_ns"]) == 10_495
    assert set(np.diff(ins["t_ns"]).tolist()) == {NS // 2}
    assert ins["t_ns"][0] == 2024 * WEEK_NS + 225_092_532_698_500
    assert np.degrees(ins["latitude_rad"][0]) == pytest.approx(46.783019673976, abs=1e-11)
    assert np.degrees(ins["longitude_rad"][0]) == pytest.approx(-71.272710666896, abs=1e-11)
    assert ins["height_m"][0] == pytest.approx(55.886139, abs=1e-6)
    values = [ins[name][0] for name in ("roll_rad", "pitch_rad", "azimuth_rad")]
    assert values == pytest.approx([0.079737922580, 0.012073070456, 4.601874186733], abs=1e-9)


def test_sbet_with_stray_bytes(read: Read) -> None:
    ins, dropped = read("ins", "sbet", "ins/sbet_20181023.out", gps_week=2024)
    first, _ = read("ins", "sbet", ATLANS, gps_week=2024)
    assert sum(dropped.values()) == 2
    for name in INS:
        assert np.array_equal(ins[name], first[name][:1]), name


def test_sbet_cut_off(read: Read) -> None:
    with pytest.raises(RawDataError) as error:
        read("ins", "sbet", "ins/pdal_badfile.sbet", gps_week=1800)
    one_line(error, "pdal_badfile.sbet", "135 bytes", "copy")


def test_sbet_without_week(read: Read) -> None:
    with pytest.raises(ConfigError) as error:
        read("ins", "sbet", ATLANS)
    one_line(error, "ins.gps_week", "GPS week")
