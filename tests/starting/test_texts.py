"""YAML that init writes: patterns and names of every kind come back as they were; comments stay comments."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config.about import About
from pipeline.config.instruments import Sensor
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.config.yaml_file import content_of
from pipeline.config.yaml_models import parse
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.readers.session_files import files_matching
from pipeline.starting.figure_comments import about_comments, figure_comments
from pipeline.starting.file_patterns import patterns_for
from pipeline.starting.folder_files import LeftOut
from pipeline.starting.left_out_words import left_out_lines
from pipeline.starting.pool_text import pool_text
from pipeline.starting.yaml_words import comment, file_list, scalar

NAMES = [
    "ins/a.gps", "ins/b c.gps", "水池/第一次.gps", "it's/\"x\".gps", "a,b/[1].gps", "*/?.gps", "x: y.gps", "# x.gps",
    "yes", "2026", "- a", "{a}.gps", "a\tb.gps", "a\nb.gps", "\u2028.gps", "&a.gps", "!b", "|c", "~", "%d", "@e",
    " a .gps", "🚤.gps", "null",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_names_come_back(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("x")
    (path.parent / "other.txt").write_text("x")
    patterns = patterns_for([name], tmp_path)
    for listed in (patterns, [*patterns, "z"]):
        text = f"files: {file_list(listed)}\nname: {scalar(name)}\n"
        assert content_of(text, path) == {"files": listed, "name": name}
    assert [file.name for file in files_matching(tmp_path, patterns, "ins.files")] == [name]


def test_a_pattern_where_all_belong_together_else_a_list(tmp_path: Path) -> None:
    for name in ("ins/a.gps", "ins/b.gps", "ins/c.out", "top.gps", "deep/er/d.gps"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x")
    assert patterns_for(["ins/a.gps", "ins/b.gps"], tmp_path) == ["ins/*.gps"]
    assert patterns_for(["ins/b.gps"], tmp_path) == ["ins/b.gps"]
    assert patterns_for(["top.gps", "ins/b.gps", "ins/a.gps", "deep/er/d.gps"], tmp_path) == [
        "*.gps", "deep/er/*.gps", "ins/*.gps",
    ]  # fmt: skip
    (tmp_path / "ins" / "link.gps").symlink_to(tmp_path / "top.gps")  # the pattern would match it
    assert patterns_for(["ins/a.gps", "ins/b.gps"], tmp_path) == ["ins/a.gps", "ins/b.gps"]


@pytest.mark.parametrize("text", ["a\nb: 1", "x\u2028y: 2", "\x85z: 3", "\r\nevil: 1", "\x1b[2J", "long " * 200])
def test_a_comment_never_becomes_a_key(text: str) -> None:
    lines = comment(text, "  ")
    assert all(line.startswith("  # ") and len(line) <= 120 for line in lines)
    assert yaml.safe_load("\n".join(lines)) is None


def test_files_alike_are_one_line_and_long_lists_say_how_much_is_left_out() -> None:
    """The one file among ten thousand pictures that should have been read is seen."""
    pictures = [LeftOut(f"照片/{number}.jpg", "is no raw data") for number in range(9999)]
    cut = LeftOut("照片/pass_0.las", "is cut off")
    assert left_out_lines([*pictures, cut], 2) == [
        "照片/0.jpg and 9998 files more of its folder and suffix: is no raw data",
        "照片/pass_0.las: is cut off",
    ]
    assert left_out_lines([cut, *pictures], 1)[1:] == ["and 1 file more"]
    few = [LeftOut(name, "is empty") for name in ("a/2.las", "a/1.las", "a/3.las", "4", "5", "6", "7")]
    others = [LeftOut("a/0.las", "is cut off"), LeftOut("b/1.las", "is empty")]
    assert left_out_lines([*few, *others], 9) == [
        "4 and 3 files more of its folder and suffix: is empty",
        "a/0.las: is cut off",
        "a/1.las: is empty",
        "a/2.las: is empty",
        "a/3.las: is empty",
        "b/1.las: is empty",
    ]
    assert left_out_lines([*few, *others], 2)[2] == "and 4 files more"


def test_a_pools_config_without_a_track() -> None:
    target = yaml.safe_load(pool_text(None))["target"]
    assert {key: target[key] for key in ("a", "b", "c", "e", "low_side", "water_level_m")} == dict.fromkeys(
        ("a", "b", "c", "e", "low_side", "water_level_m"), "FILL_IN"
    )
    assert set(target["origin"].values()) == {"FILL_IN"}
    assert "To compare" not in pool_text(None)


def test_what_is_assumed_is_what_the_program_takes() -> None:
    """With their comment signs taken away, the lines change no setting; a preset's figures are not overridden."""
    files: dict[str, Any] = {"files": ["a"]}
    sensors: list[tuple[Sensor, type[Ins | Laser | Mbes], dict[str, Any]]] = [
        ("ins", Ins, {"format": "sbet"}),
        ("laser", Laser, {"format": "las", "mount": dict.fromkeys(SETTINGS, 0.0)}),
        ("mbes", Mbes, {"format": "r2sonic", "mount": dict.fromkeys(SETTINGS, 0.0)}),
    ]
    for sensor, block, given in sensors:
        lines = [line.removeprefix("  # ") for line in figure_comments(sensor, has_preset=False)]
        stated = yaml.safe_load("\n".join(line for line in lines if re.match(r"\w+: [{\[\d]", line)))
        without = block(**files, **given).model_dump(mode="json")
        source = {"drift_from": "settings"} if sensor == "ins" else {}  # what is written overrides the files
        assert parse(block, files | given | stated, "a").model_dump(mode="json") == without | source
        assert "".join(figure_comments(sensor, has_preset=True)).count("range_sigma_m") == 0
    keys = yaml.safe_load("\n".join(line.removeprefix("# ") for line in about_comments() if line.endswith(":")))
    assert About(**keys["about"]) == About()
    assert len(keys["about"]) == 6
