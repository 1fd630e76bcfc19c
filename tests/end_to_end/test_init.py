"""poolcal init: from raw files alone to a session that is checked, and all that may stand in its way."""

import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config.load import load_pool, load_session
from pipeline.config.session import SessionConfig
from pipeline.starting.folder_survey import survey_folder
from pipeline.starting.session_text import session_text
from tests.support.marks import marks_of
from tests.support.places import Told, poolcal, simulate
from tests.support.refusals import one_line
from tests.support.roots import SCENARIOS
from tests.support.surveys import World

Simulated = Callable[..., tuple[Path, Path]]


@pytest.fixture
def bare(small: Path, tmp_path: Path) -> Path:
    """The small session's raw files alone."""
    return _bare(small, tmp_path / "水池 it's [1] \"a\"")


def _bare(session: Path, folder: Path) -> Path:
    shutil.copytree(session, folder, ignore=shutil.ignore_patterns("*.yaml", "*.json"))
    return folder


def _fill_in(path: Path, original: Path) -> None:
    """Every FILL_IN becomes the original's value for that key."""
    given = yaml.safe_load(original.read_text(encoding="utf-8"))
    blocks: list[tuple[int, str]] = []
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        bare_line = line.strip()
        indent = len(line) - len(line.lstrip())
        if bare_line and not bare_line.startswith(("#", "-")):
            blocks = [block for block in blocks if block[0] < indent] + [(indent, bare_line.partition(":")[0])]
        if ": FILL_IN" in line:
            value: Any = given
            for _, key in blocks:
                value = value[key]
            line = line.replace("FILL_IN", str(value))
        lines.append(line)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _readings(session: SessionConfig) -> dict[str, Any]:
    """What decides how the files are read and placed."""
    keys = {"files", "format", "gps_week", "frame", "heights", "time", "mount"}
    return {
        sensor: {key: value for key, value in block.items() if key in keys}
        for sensor, block in session.model_dump().items()
        if sensor != "name"
    }


def test_from_raw_files_to_a_good_check(bare: Path, small: Path) -> None:
    told = poolcal("init", bare)
    assert told.status == 0, told.err
    assert "R2Sonic 2024" in told.out
    assert "2. The mounts of laser and mbes" in told.out
    for words in (("check", bare), ("check", bare, "--config", bare / "pool.yaml")):
        one_line(poolcal(*words), "still to be filled in")
    for name in ("session.yaml", "pool.yaml"):
        _fill_in(bare / name, small / name)
    made, given = load_session(bare), load_session(small)
    assert _readings(made) == _readings(given)
    assert made.name == bare.name
    assert made.mbes is not None
    assert made.mbes.instrument is not None
    assert made.mbes.instrument.name == "r2sonic_2024"
    pool = load_pool(bare / "pool.yaml").target
    assert pool.model_dump() | {"azimuth_deg": 0.0} == load_pool(small / "pool.yaml").target.model_dump()
    checked = poolcal("check", bare, "--config", bare / "pool.yaml")
    assert checked.status == 0, checked.out


def test_the_same_folder_gives_the_same_bytes_and_nothing_is_replaced(bare: Path, tmp_path: Path) -> None:
    assert poolcal("init", bare).status == 0
    first = {name: (bare / name).read_bytes() for name in ("session.yaml", "pool.yaml")}
    one_line(poolcal("init", bare), "session.yaml: is there already")
    (bare / "session.yaml").unlink()
    one_line(poolcal("init", bare), "pool.yaml: is there already", "--no-pool")
    assert not (bare / "session.yaml").exists()
    assert {name: (bare / name).read_bytes() for name in ("pool.yaml",)}["pool.yaml"] == first["pool.yaml"]
    assert poolcal("init", bare, "--no-pool").status == 0
    assert (bare / "session.yaml").read_bytes() == first["session.yaml"]
    assert (bare / "pool.yaml").read_bytes() == first["pool.yaml"]
    (bare / "session.yaml").unlink()
    (bare / "session.yaml").symlink_to(tmp_path / "nowhere")
    one_line(poolcal("init", bare, "--no-pool"), "session.yaml: is there already")


def test_the_pool_goes_where_it_is_wanted_or_nothing_is_written(bare: Path, tmp_path: Path) -> None:
    one_line(poolcal("init", bare, "--pool", tmp_path / "no" / "pool.yaml"), "there is no folder", "make it")
    one_line(poolcal("init", bare, "--pool", bare / "ins" / ".." / "session.yaml"), "is where session.yaml goes")
    assert not (bare / "session.yaml").exists()
    told = poolcal("init", bare, "--pool", tmp_path / "my pool.yaml")
    assert told.status == 0
    assert "my pool.yaml'" in told.out  # in quotes in the commands
    assert (tmp_path / "my pool.yaml").is_file()
    assert not (bare / "pool.yaml").exists()


def test_coarse_writes_into_what_init_wrote(bare: Path, tmp_path: Path) -> None:
    assert poolcal("init", bare).status == 0
    comments = (bare / "session.yaml").read_text(encoding="utf-8").count("# ")
    marks = tmp_path / "marks.yaml"
    marks.write_text(yaml.safe_dump(marks_of(World())), encoding="utf-8")
    told = poolcal("coarse", marks, "--session", bare)
    assert told.status == 0, told.err
    text = (bare / "session.yaml").read_text(encoding="utf-8")
    assert text.count("FILL_IN") == 1  # in the first comment, which says what it means
    assert text.count("# ") == comments
    assert load_session(bare).laser.mount_origin is not None


def test_a_messy_folder(small: Path, tmp_path: Path) -> None:
    """Times without a week, unreadable and cut files, two kinds, links, other sessions, runs, names to be quoted."""
    folder = simulate(
        tmp_path / "messy", base=SCENARIOS / "messy.yaml", track={"distances_m": [4.0, 7.0], "half_length_m": 3.6}
    )
    week = load_session(folder).laser.gps_week
    (folder / "session.yaml").unlink()
    (folder / "pool.yaml").unlink()
    ins = sorted((folder / "ins").iterdir())
    (folder / "notes.txt").write_text("fair wind\n")
    (folder / "laser" / "scan.zip").write_bytes(b"PK\x03\x04" + bytes(100))
    las = sorted((folder / "laser").glob("*.las"))
    (folder / "laser" / "head only.las").write_bytes(las[0].read_bytes()[:300])
    for name in ("empty.r2s", "empty.xtf"):
        (folder / "mbes" / name).write_bytes(b"")
    shutil.copy(small / "mbes" / "pass_0.xtf", folder / "mbes" / "other:kind #1.xtf")
    (folder / "ins" / "link.gps").symlink_to(small / "ins" / "ins.gps")
    shutil.copytree(small, folder / "inner")
    (folder / "a run").mkdir()
    (folder / "a run" / "run.yaml").write_text("")
    told = poolcal("init", folder)
    assert told.status == 0, told.err
    text = (folder / "session.yaml").read_text(encoding="utf-8")
    content = yaml.safe_load(text)
    assert content["laser"]["gps_week"] == week
    assert content["laser"]["files"] == [f"laser/{path.name}" for path in las]
    assert sorted(path.name for pattern in content["ins"]["files"] for path in folder.glob(pattern)) == sorted(
        path.name for path in ins
    )
    assert (content["mbes"]["files"], content["mbes"]["format"]) == ("FILL_IN", "FILL_IN")
    assert "files: ['mbes/other:kind #1.xtf']" in text  # the empty files stand in the patterns' way
    assert "files: [mbes/pass_0.r2s, mbes/pass_1.r2s]" in text
    left = text.partition("# Files that are not used")[2]
    for name in ("notes.txt", "scan.zip", "head only.las", "empty.r2s", "ins/link.gps", "inner", "a run"):
        assert name in left, name
    assert "mbes.files" in told.out


def test_georeferenced_points(tmp_path: Path) -> None:
    folder = simulate(
        tmp_path / "s", laser={"point_rate_hz": 2000.0, "line_rate_hz": 20.0, "format": "las", "frame": "EPSG:4978"}
    )
    given = load_session(folder)
    bare = _bare(folder, tmp_path / "bare")
    assert poolcal("init", bare).status == 0
    assert yaml.safe_load((bare / "session.yaml").read_text(encoding="utf-8"))["laser"]["frame"] == given.laser.frame


def test_an_sbet_without_a_date_gets_the_week_of_the_others(tmp_path: Path) -> None:
    folder = simulate(tmp_path / "s", ins={"rate_hz": 50.0, "format": "sbet"})
    given = load_session(folder)
    assert given.ins.gps_week is not None
    bare = _bare(folder, tmp_path / "bare")
    assert poolcal("init", bare).status == 0
    assert yaml.safe_load((bare / "session.yaml").read_text(encoding="utf-8"))["ins"]["gps_week"] == given.ins.gps_week
    for sensor in ("laser", "mbes"):
        shutil.rmtree(bare / sensor)
    (bare / "session.yaml").unlink()
    told = poolcal("init", bare, "--no-pool")
    assert "laser: no file that can be read" in told.out
    content = yaml.safe_load((bare / "session.yaml").read_text(encoding="utf-8"))
    assert content["ins"]["gps_week"] == "FILL_IN"
    assert content["laser"]["files"] == "FILL_IN"
    assert "mbes" not in content


def test_two_weeks_in_one_folder_are_pointed_out(bare: Path, small: Path, tmp_path: Path) -> None:
    later = simulate(tmp_path / "later", start_utc="2026-05-19T08:00:00")
    shutil.copytree(later / "mbes", bare / "mbes" / "一周后")
    told = poolcal("init", bare)
    assert told.status == 0, told.err
    doubt = "mbes/一周后/pass_0.xtf: begins 7 days after the end of mbes/pass_1.xtf; if they are of two sessions"
    assert f"Look: {doubt}" in told.out
    text = " ".join((bare / "session.yaml").read_text(encoding="utf-8").replace("# ", "").split())
    assert f"Look: {doubt}" in text
    assert "Look: mbes/一周后/pass_0.xtf (and 1 more): runs from 2026-05-19T" in told.out


class _Removal:
    """Removes a file when it is opened for the n-th time, by whatever means."""

    def __init__(self, path: Path, nth: int) -> None:
        self.path, self.left = path, nth

    def __call__(self, event: str, words: tuple[Any, ...]) -> None:
        if event == "open" and words[0] == str(self.path):
            self.left -= 1
            if self.left == 0:
                self.path.unlink()


@pytest.mark.parametrize("nth", range(1, 10))
def test_a_file_that_goes_while_it_is_looked_at(nth: int, bare: Path) -> None:
    """It is used no more and named with the reason, or it was read already."""
    removal = _Removal(bare / "laser" / "pass_0.las", nth)
    sys.addaudithook(removal)  # stays, and does nothing more
    survey = survey_folder(bare)
    assert not removal.path.exists()
    listed = {file.name for group in survey.groups["laser"] for file in group.files}
    left_out = {one.name: one.why for one in survey.left_out}
    assert ("laser/pass_0.las" in listed) != ("laser/pass_0.las" in left_out)
    assert "laser/pass_1.las" in listed
    assert {"No such file or directory" in why or "is there no longer" in why for why in left_out.values()} <= {True}
    session_text(survey)


# --- refusals --------------------------------------------------------------------------------------------------------
def _init(folder: Path) -> Told:
    return poolcal("init", folder)


def test_no_folder_and_nothing_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one_line(_init(tmp_path / "missing"), "missing: is no folder")
    (tmp_path / "file").write_text("x")
    one_line(_init(tmp_path / "file"), "file: is no folder")
    (tmp_path / "empty").mkdir()
    one_line(_init(tmp_path / "empty"), "empty: it holds no file")
    (tmp_path / "empty" / "a.zip").write_bytes(b"PK\x03\x04")
    one_line(_init(tmp_path / "empty"), "none of its 1 file can be read", "a.zip: is a ZIP archive; unpack it")
    assert sorted(path.name for path in (tmp_path / "empty").iterdir()) == ["a.zip"]
    monkeypatch.setattr("pipeline.starting.folder_files.MOST_FILES", 3)
    for number in range(4):
        (tmp_path / "empty" / f"{number}").write_text("x")
    one_line(_init(tmp_path / "empty"), "more than 3 files", "one session")


def test_names_that_cannot_be_listed(bare: Path) -> None:
    first = sorted((bare / "mbes").iterdir())[0]
    shutil.copy(first, bare / "mbes" / "back\\slash.xtf")
    shutil.copy(first, os.fsdecode(os.fsencode(bare / "mbes") + b"/\xff.xtf"))
    assert _init(bare).status == 0
    text = (bare / "session.yaml").read_text(encoding="utf-8")
    assert text.count("rename it") == 2
    assert all("*" not in name for name in yaml.safe_load(text)["mbes"]["files"])


@pytest.mark.parametrize("writable", [False, True])
def test_a_folder_that_cannot_be_written(writable: bool, bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Permissions that say so, and a disk that only says so when it is written to."""
    if writable:
        real = Path.open
        monkeypatch.setattr(
            Path, "open", lambda self, *a, **k: _full(self) if "xb" in a else real(self, *a, **k)
        )
    else:
        monkeypatch.setattr(os, "access", lambda _, mode: not mode & os.W_OK)
    one_line(_init(bare), "cannot be written")
    assert not list(bare.glob("*.yaml*"))


def _full(path: Path) -> None:
    raise OSError(28, "No space left on device", str(path))
