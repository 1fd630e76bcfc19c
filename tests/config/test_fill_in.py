"""FILL_IN in session.yaml and in a pool's config: named with file, line, key and meaning, in one line."""

from pathlib import Path

import pytest

from pipeline.coarse.session_file import read_session
from pipeline.config.fill_in import Unfilled, unfilled
from pipeline.config.load import load_pool, load_session
from pipeline.errors import ConfigError
from tests.support.marks import PLAIN, marks_of, mounts_in, run
from tests.support.places import poolcal
from tests.support.roots import CONFIGS
from tests.support.surveys import World

OPEN_MBES = PLAIN.replace(
    "mount: {roll_deg: -48, pitch_deg: 2.0, yaw_deg: -2.8, x_m: 0.38, y_m: 0.12, z_m: -1.0}   # flow, 流",
    "mount:   # of the sonar\n    roll_deg: FILL_IN   # starboard +\n    pitch_deg: FILL_IN\n    yaw_deg: FILL_IN\n"
    "    x_m: FILL_IN\n    y_m: FILL_IN\n    z_m: FILL_IN   # up +",
)


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "session"
    folder.mkdir()
    return folder


def _write(session: Path, text: str) -> Path:
    path = session / "session.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_place_is_found_and_no_other(tmp_path: Path) -> None:
    text = "name: FILL_IN it\nins:\n  files: [FILL_IN]   # FILL_IN\n  format: 'FILL_IN'\nFILL_IN: 1\n"
    assert unfilled(text, tmp_path) == [Unfilled("ins.files", 3), Unfilled("ins.format", 4)]


def test_a_session_says_all_that_is_open(session: Path) -> None:
    path = _write(session, OPEN_MBES.replace("format: las ", "format: FILL_IN "))
    with pytest.raises(ConfigError) as error:
        load_session(session)
    said = str(error.value)
    assert said.startswith(f"{path}: still to be filled in")
    assert "line 6 laser.format (the format of these files)" in said
    assert "lines 18 to 23 mbes.mount.roll_deg, pitch_deg, yaw_deg, x_m, y_m, z_m (the sonar's angles" in said
    assert "\n" not in said


def test_a_pool_says_all_that_is_open(tmp_path: Path) -> None:
    text = (CONFIGS / "defaults.yaml").read_text(encoding="utf-8").replace("a: 8.0 ", "a: FILL_IN ")
    path = tmp_path / "pool.yaml"
    path.write_text(text.replace("height_m: 12.0 ", "height_m: FILL_IN "), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"target\.a \(height of the centre wall, m\); line \d+ target\.origin\.h"):
        load_pool(path)


def test_open_mounts_count_as_missing_for_coarse_alone(session: Path) -> None:
    _write(session, OPEN_MBES)
    assert "mount" not in read_session(session)[1]["mbes"]
    assert run(session, marks_of(World(), None)).status == 0
    assert len(mounts_in(session)) == 2
    text = (session / "session.yaml").read_text(encoding="utf-8")
    assert "FILL_IN" not in text
    for comment in ("# of the sonar", "# starboard +", "# up +", "# 会话 of boat A"):
        assert comment in text


def test_one_mount_may_stay_open_while_the_other_is_written(session: Path) -> None:
    _write(session, OPEN_MBES.replace("yaw_deg: 40.0 ", "yaw_deg: FILL_IN "))
    marks = marks_of(World(), None)
    del marks["mbes"]
    told = run(session, marks)
    assert told.status == 0, told.err
    assert "But mbes still has no mount there." in told.out
    with pytest.raises(ConfigError, match=r"in place of FILL_IN: lines \d+ to \d+ mbes\.mount\.roll_deg"):
        load_session(session)


def test_coarse_refuses_other_open_keys(session: Path) -> None:
    before = OPEN_MBES.replace("files: [ins/*.gps]", "files: FILL_IN")
    _write(session, before)
    told = run(session, marks_of(World(), None))
    assert (told.status, told.err.count("\n")) == (2, 1)
    assert "line 3 ins.files (the sensor's files" in told.err
    assert "mount" not in told.err
    assert (session / "session.yaml").read_text(encoding="utf-8") == before


def test_coarse_without_a_sonar(session: Path) -> None:
    _write(session, PLAIN.partition("mbes:")[0])
    marks = marks_of(World(), None)
    refused = run(session, marks)
    assert (refused.status, "mbes: has no format" in refused.err) == (2, True)
    del marks["mbes"]
    assert run(session, marks).status == 0


def test_a_folder_without_session_yaml_names_init(session: Path) -> None:
    for read in (load_session, read_session):
        with pytest.raises(ConfigError, match=r"there is no such file; poolcal init \S+ writes it"):
            read(session)


def test_both_files_are_told_of_at_once(session: Path, tmp_path: Path) -> None:
    """So that nobody fills in one file to hear of the other; still one line, as of every refusal."""
    path = _write(session, OPEN_MBES)
    pool = tmp_path / "pool.yaml"
    text = (CONFIGS / "defaults.yaml").read_text(encoding="utf-8")
    pool.write_text(text.replace("a: 8.0 ", "a: FILL_IN "), encoding="utf-8")
    told = poolcal("check", session, "--config", pool)
    assert (told.status, told.out, told.err.count("\n")) == (2, "", 1)
    assert told.err.startswith(f"poolcal: {path}: still to be filled in")
    assert f"; and {pool}: still to be filled in, in place of FILL_IN: line " in told.err
