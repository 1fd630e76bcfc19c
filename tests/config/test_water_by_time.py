"""The water's level by time: readings in the pool's file, and in a file beside it; what is refused."""

import hashlib
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config.load import load_pool
from pipeline.config.water_by_time import MOST, WaterByTime
from pipeline.errors import ConfigError
from pipeline.simulation.scenario import load_scenario

LETTERS = {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5}
PLACE = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
FIRST, NEXT = "2026-05-09T05:00Z,1\n", "2026-05-09T05:05Z,1\n"
READ_AS = (("2026-05-09T05:00:00Z", -0.1), ("2026-05-09T05:10:00Z", 0.05), ("2026-05-09T05:20:00Z", 1.0))


def pool(folder: Path, **by_time: Any) -> Path:
    path = folder / "pool.yaml"
    target = {**LETTERS, "origin": PLACE, "water_by_time": by_time}
    path.write_text(yaml.safe_dump({"target": target}), encoding="utf-8")
    return path


def read(folder: Path, text: str) -> WaterByTime:
    (folder / "潮位.csv").write_bytes(text.encode("utf-8-sig"))
    found = load_pool(pool(folder, readings="潮位.csv")).target.water_by_time
    assert found is not None
    return found


@pytest.mark.parametrize(
    "row", ["{},{}", "{} , {}", "{};{}", "{}\t{}", "{} {}"], ids=["comma", "spaces", "semicolon", "tab", "space"]
)
def test_readings_of_a_file(tmp_path: Path, row: str) -> None:
    """A heading, a comment, an empty line, and times of three zones, of which the third is UTC by silence."""
    times = ("2026-05-09T05:00:00Z", "2026-05-09 13:10:00+08:00", "2026-05-09 05:20")
    lines = [row.format(time, height) for time, height in zip(times, ("-0.10", "0.05", "+1"), strict=True)]
    text = "\r\n".join(["time, level", "# staff 3 at the gate", lines[0], "", *lines[1:]])
    found = read(tmp_path, text)
    assert found.readings == READ_AS
    assert found.readings_from is not None
    assert (found.readings_from.file, found.readings_from.rows) == ("潮位.csv", 3)
    assert found.readings_from.sha256 == hashlib.sha256(text.encode("utf-8-sig")).hexdigest()


def test_readings_within_a_minute_are_averaged(tmp_path: Path) -> None:
    rows = [(second, 2.0 + (0.3 if second % 2 else -0.3) + second / 600) for second in range(120)]
    text = "\n".join(f"2026-05-09T05:{second // 60:02}:{second % 60:02}Z,{height:.6f}" for second, height in rows)
    (first, one), (second, other) = read(tmp_path, text).readings or ()
    assert (first, second) == ("2026-05-09T05:00:29.500000Z", "2026-05-09T05:01:29.500000Z")
    assert one == pytest.approx(2.0 + 29.5 / 600, abs=1e-4)
    assert other == pytest.approx(2.0 + 89.5 / 600, abs=1e-4)


def test_readings_in_the_pools_file(tmp_path: Path) -> None:
    """YAML makes a time of the first two, and leaves the third as text."""
    path = pool(tmp_path, readings="ROWS")
    rows = "[[2026-05-09 05:00:00, -0.1], [2026-05-09T07:10:00+02:00, 0.05], ['2026-05-09T05:20Z', 1.0]]"
    path.write_text(path.read_text().replace("ROWS", rows))
    found = load_pool(path).target.water_by_time
    assert found is not None
    assert (found.readings, found.readings_from) == (READ_AS, None)


def test_the_height_of_the_ins_above_the_water(tmp_path: Path) -> None:
    found = load_pool(pool(tmp_path, ins_above_water_m=1.52)).target.water_by_time
    assert found is not None
    assert (found.ins_above_water_m, found.readings) == (1.52, None)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a\nb\n" + FIRST, "line 2: 'b' is no time and height in m; write them as 2026-05-09T05:00:00Z, 0.12"),
        ('"2026-05-09T05:00Z",1\n' + NEXT, "line 1: '\"2026-05-09T05:00Z\",1' is no time and height in m"),
        ("2026-05-09T05:00Z,1,5\n", "line 1: '2026-05-09T05:00Z,1,5' is no time and height in m"),
        ("2026-05-09T25:00Z,1\n", "'2026-05-09T25:00Z': is no time as 2026-05-09T05:00:00Z; correct it"),
        ("0001-01-01T00:00+10:00,1\n", "'0001-01-01T00:00+10:00': is no time as 2026-05-09T05:00:00Z"),
        ("9999-12-31T23:59-05:00,1\n", "'9999-12-31T23:59-05:00': is no time as 2026-05-09T05:00:00Z"),
        ("2300-01-01T00:00Z,1\n", "'2300-01-01T00:00Z': is no time of this age; correct it"),
        (NEXT + FIRST, "line 2: '2026-05-09T05:00Z,1': does not stand after the line before: times must grow"),
        (FIRST, "has readings in 1 minutes, of 2 to 10000; give those of the session"),
        ("", "has readings in 0 minutes"),
        (FIRST + "2026-05-09T06:00Z,99999\n", "line 2: '2026-05-09T06:00Z,99999': is no height in m, of -1000 to 1"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ConfigError) as error:
        read(tmp_path, text)
    assert words in str(error.value)
    assert "潮位.csv" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_of_more_minutes_than_are_kept_is_refused(tmp_path: Path) -> None:
    rows = [f"2026-05-{9 + k // 1440:02}T{k // 60 % 24:02}:{k % 60:02}Z,1\n" for k in range(MOST + 1)]
    assert len(read(tmp_path, "".join(rows[:-1])).readings or ()) == MOST
    with pytest.raises(ConfigError, match="has readings in 10001 minutes, of 2 to 10000; give those of the session"):
        read(tmp_path, "".join(rows))


ELSEWHERE = ["/etc/passwd", "../levels.csv", "a\\b.csv", "none.csv", ".", "", "out.csv", "loop.csv"]


@pytest.mark.parametrize("name", ELSEWHERE)
def test_only_a_file_beside_the_pools_is_read(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "pools"
    folder.mkdir()
    (tmp_path / "secret.csv").write_text("password:x:0\n")
    (folder / "out.csv").symlink_to(tmp_path / "secret.csv")
    (folder / "loop.csv").symlink_to(folder / "loop.csv")
    with pytest.raises(ConfigError, match=r"target\.water_by_time\.readings = ") as error:
        load_pool(pool(folder, readings=name))
    assert "password" not in str(error.value)


def two(first: str, second: str) -> list[list[Any]]:
    return [[first, 1.0], [second, 1.0]]


@pytest.mark.parametrize(
    ("by_time", "words"),
    [
        ({}, "needs either ins_above_water_m or readings"),
        ({"ins_above_water_m": 1.5, "readings": two("2026-05-09T05:00Z", "2026-05-09T06:00Z")}, "needs either"),
        ({"readings": two("2026-05-09", "2026-05-10")}, "'2026-05-09': is no time as 2026-05-09T05:00:00Z"),
        ({"readings": two("2026-05-09T05:00Z", "2026-05-09T05:00Z")}, "Z stands after 2026-05-09T05:00:00Z: times"),
    ],
)
def test_what_contradicts_itself_is_refused(tmp_path: Path, by_time: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError) as error:
        load_pool(pool(tmp_path, **by_time))
    assert words in str(error.value)


def test_readings_of_a_target_that_is_to_be_found_are_refused(tmp_path: Path) -> None:
    """What is found does not say at which time the water stood there."""
    path = tmp_path / "pool.yaml"
    rows = [["2026-05-09T05:00Z", 1.0], ["2026-05-09T06:00Z", 1.2]]
    path.write_text(yaml.safe_dump({"target": {"kind": "found", "water_by_time": {"readings": rows}}}))
    with pytest.raises(ConfigError, match="give ins_above_water_m, or the file that poolcal target --out writes"):
        load_pool(path)


def test_a_scenario_has_no_water_by_time(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    target = {**LETTERS, "origin": PLACE, "azimuth_deg": 0.0, "water_by_time": {"ins_above_water_m": 1.3}}
    path.write_text(yaml.safe_dump({"name": "tide", "target": target}))
    with pytest.raises(ConfigError, match="simulated water stands still; take the key out"):
        load_scenario(path)
