"""In Chinese nothing stays English on the screen: the help, and what the commands around a run say."""

import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from pipeline.exports.cloud import CLOUDS
from pipeline.exports.registry import TARGETS
from stages.cli.application import app
from tests.support.left_english import assert_chinese
from tests.support.marks import marks_of
from tests.support.places import Place, Told, poolcal, result_of
from tests.support.surveys import World
from tools.survey_software import entry_of, georeferenced, in_crs, recording, write_points

COMMANDS = [str(info.name) for info in app.registered_commands]
WORDS = re.compile(r"(?<![-<\w])[a-z]{2,} [a-z]{2,}(?!>)")  # two words of a sentence; <float range> is a kind of value
DATA = ("undisturbed", "session", "runs/a", "CRS", "EPSG", "Kluster", "qimera")
PRODUCTS = (  # programs, their parts and formats: written as their makers do
    "NOAA", "Kluster", "Applanix POS MV", "Vessel Editor", "HYSWEEP", "HSX", "OF2", "IIP", "MB-System", "SPAN", "ROS",
    "URDF", "PDAL", "XML", "CIDCO", "MBES-lib", "SONAR-netCDF4", "XSF", "Platform", "stage", "tf2", "CONVENTIONS.md",
)  # fmt: skip
UTM = "EPSG:32651"


@pytest.fixture(autouse=True)
def chinese(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "zh")
    monkeypatch.setenv("COLUMNS", "100")


def screen(told: Told, status: int) -> Iterator[str]:
    """The lines of an answer, which must end with a status."""
    assert told.status == status, told.out + told.err
    yield from told.out.splitlines()
    yield from told.err.splitlines()


@pytest.mark.parametrize("words", [["--help"], *([name, "--help"] for name in COMMANDS)], ids=" ".join)
def test_help(words: list[str]) -> None:
    lines = list(screen(poolcal(*words), 0))
    assert lines[0].startswith("用法：poolcal")
    assert "选项：" in lines
    left = [line for line in lines if WORDS.search(line.replace("pip install", "").replace("poolcal ", "poolcal_"))]
    assert left == []


@pytest.mark.parametrize(
    "words",
    [
        ["rn"], ["run"], ["run", "a", "--jbs"], ["diff", "a", "b", "--tolerance-mm", "x"],
        ["export", "a", "--ins-point", "1"], ["verify"], ["check", "a", "b"],
    ],
    ids=" ".join,
)  # fmt: skip
def test_a_wrong_command_line(words: list[str]) -> None:
    assert_chinese(screen(poolcal(*words), 2), "'rn'", "FILE", "FOLDER", "'")


def test_init_and_what_is_still_open(small: Path, tmp_path: Path) -> None:
    folder = tmp_path / "池"
    shutil.copytree(small, folder, ignore=shutil.ignore_patterns("*.yaml", "*.json"))
    lines = [*screen(poolcal("init", folder), 0), *screen(poolcal("init", folder), 2)]
    lines += screen(poolcal("check", folder, "--config", folder / "pool.yaml"), 2)
    marks = tmp_path / "marks.yaml"
    marks.write_text(yaml.safe_dump(marks_of(World())), encoding="utf-8")
    lines += screen(poolcal("coarse", marks, "--session", folder), 0)
    assert_chinese(lines, tmp_path, "MARKS.yaml", "FILE", "FOLDER", "FILL_IN", "body", "south", "north", "about")


def test_export_list_and_files(done: Place) -> None:
    lines = list(screen(poolcal("export", "--list"), 0))
    for name in ("json", "qimera", "las"):
        file = done.folder / f"甲.{'txt' if name == 'qimera' else name}"
        lines += screen(poolcal("export", done.run, "--to", name, "--out", file), 0)
    lines += screen(poolcal("mount", done.folder / "甲.json", "--from", "json", "--session", done.session), 0)
    lines += screen(poolcal("export", done.run, "--to", "qimera", "--crs", UTM), 2)
    lines += screen(poolcal("export", done.run, "--to", "wash"), 2)
    assert_chinese(lines, done.folder, *DATA, *PRODUCTS, *TARGETS, *CLOUDS, "wash")


@pytest.mark.parametrize(
    ("change", "status"),
    [
        pytest.param({}, 0, marks=pytest.mark.thorough),
        pytest.param({"level_lever_arm": True}, 1, marks=pytest.mark.thorough),
        ({"order": "rph"}, 1),
    ],
)
def test_check_entry(
    small: Path, undisturbed: tuple[Path, Told], tmp_path: Path, change: dict[str, object], status: int
) -> None:
    run = undisturbed[0]
    placed = georeferenced(recording(small), replace(entry_of(result_of(run)), **change))  # type: ignore[arg-type]
    write_points(tmp_path / "测深.xyz", in_crs(placed, UTM), 3)
    orders = ("roll · pitch · yaw", "yaw · pitch · roll")
    assert_chinese(screen(poolcal("check-entry", run, tmp_path / "测深.xyz"), status), *DATA, run, "UTM zone", *orders)


def test_compare_and_verify(small: Path, done: Place) -> None:
    lines = list(screen(poolcal("compare", done.run, small.with_name("session.truth.json")), 0))
    lines += screen(poolcal("verify", done.run), 0)
    (done.run / "adjust" / "parameters.parquet").write_bytes(b"")
    lines += screen(poolcal("verify", done.run), 1)
    assert_chinese(lines, done.folder, *DATA)


@pytest.mark.thorough
def test_report_and_repeat(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = list(screen(poolcal("report", done.run), 0))
    monkeypatch.chdir(done.folder)
    fleet = Path("fleet.yaml")
    fleet.write_text("sessions: [{session: session, config: pool.yaml, run: runs/a}]\n", encoding="utf-8")
    lines += screen(poolcal("repeat", fleet, "--jobs", 1, "--no-recordings", "--no-report"), 0)
    assert_chinese(lines, done.folder, *DATA)


def test_plan(small: Path, tmp_path: Path) -> None:
    plan = tmp_path / "plan.yaml"
    figures = {"laser": {"point_rate_hz": 2000.0}, "mbes": {"ping_rate_hz": 8.0}}
    plan.write_text(yaml.safe_dump(figures | {"passes": [{"distance_m": 8.0}]}), encoding="utf-8")
    told = poolcal("plan", plan, "--session", small, "--config", small / "pool.yaml")
    assert_chinese(screen(told, 1), tmp_path, small)
