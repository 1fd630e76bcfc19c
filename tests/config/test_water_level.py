"""The water's level by time: readings in the pool's file, and in a file beside it; what is refused."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config.load import load_pool
from pipeline.errors import ConfigError

LETTERS = {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5}
PLACE = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}


def pool(folder: Path, changes: Any) -> Path:
    path = folder / "pool.yaml"
    target = {**LETTERS, "origin": PLACE, "water_level_changes": changes}
    path.write_text(yaml.safe_dump({"target": target}), encoding="utf-8")
    return path


def read(folder: Path, text: str) -> Any:
    (folder / "潮位.csv").write_bytes(text.encode("utf-8-sig"))
    return load_pool(pool(folder, "潮位.csv")).target.water_level_changes


@pytest.mark.parametrize(
    "row", ["{},{}", "{} , {}", "{};{}", "{}\t{}", "{} {}"], ids=["comma", "spaces", "semicolon", "tab", "space"]
)
def test_readings_of_a_file(tmp_path: Path, row: str) -> None:
    """A heading, a comment, an empty line, and times of three zones, of which the third is UTC by silence."""
    times = ("2026-05-09T05:00:00Z", "2026-05-09 13:10:00+08:00", "2026-05-09 05:20")
    lines = [row.format(time, height) for time, height in zip(times, ("-0.10", "0.05", "+1"), strict=True)]
    text = "\r\n".join(["time, level", "# staff at the gate", lines[0], "", *lines[1:]])
    assert read(tmp_path, text) == (
        ("2026-05-09T05:00:00Z", -0.1), ("2026-05-09T05:10:00Z", 0.05), ("2026-05-09T05:20:00Z", 1.0)
    )  # fmt: skip


def test_readings_within_a_minute_are_averaged(tmp_path: Path) -> None:
    rows = [(second, 2.0 + (0.3 if second % 2 else -0.3) + second / 600) for second in range(120)]
    text = "\n".join(f"2026-05-09T05:{second // 60:02}:{second % 60:02}Z,{height:.6f}" for second, height in rows)
    (first, one), (second, other) = read(tmp_path, text)
    assert (first, second) == ("2026-05-09T05:00:29.500000Z", "2026-05-09T05:01:29.500000Z")
    assert one == pytest.approx(2.0 + 29.5 / 600, abs=1e-4)
    assert other == pytest.approx(2.0 + 89.5 / 600, abs=1e-4)


def test_readings_in_the_pools_file_and_the_boat_itself(tmp_path: Path) -> None:
    path = pool(tmp_path, "ins")
    assert load_pool(path).target.water_level_changes == "ins"
    rows = "[[2026-05-09 05:00:00, 0.1], ['2026-05-09T07:00+02:00', 0.2], [2026-05-09T05:10:00Z, 0.3]]"  # two are times
    path.write_text(path.read_text().replace("ins", rows.replace("07:00+02", "07:05+02")))
    times = [time for time, _ in load_pool(path).target.water_level_changes or ()]
    assert times == ["2026-05-09T05:00:00Z", "2026-05-09T05:05:00Z", "2026-05-09T05:10:00Z"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a\nb\n2026-05-09T05:00Z,1\n", "line 2: 'b' is no time and height in m; write them as 2026-05-09T05:00:00Z, "),
        ("2026-05-09T05:00Z,1,5\n", "line 1: '2026-05-09T05:00Z,1,5' is no time and height in m"),
        ("2026-05-09T25:00Z,1\n", "line 1: 2026-05-09T25:00Z is no time; correct it"),
        ("2026-05-09T05:00Z,1\n2026-05-09T04:00Z,1\n", "2026-05-09T04:00:00Z stands after 2026-05-09T05:00:00Z: times"),
        ("2026-05-09T05:00Z,1\n", "at least 2"),
        ("", "at least 2"),
        ("2026-05-09T05:00Z,1\n2026-05-09T06:00Z,99999\n", "10000"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ConfigError) as error:
        read(tmp_path, text)
    assert words in str(error.value)
    assert "water_level_changes" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["/etc/passwd", "../levels.csv", "a\\b.csv", "none.csv", "."])
def test_only_a_file_beside_the_pools_is_read(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError, match="water_level_changes = "):
        load_pool(pool(tmp_path, name))
