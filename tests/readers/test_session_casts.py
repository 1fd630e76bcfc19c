"""Casts that session.yaml names: what is used, what is refused, and how the file may be named."""

import os
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.coarse.session_file import read_session
from pipeline.config.load import load_session
from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.casts import with_cast
from tests.support.files.cast_files import CARIS, is_profile

MOUNT = dict.fromkeys(("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m"), 0.0)


def session(folder: Path, **mbes: Any) -> Path:
    (folder / "casts").mkdir(exist_ok=True)
    (folder / "casts" / "today.svp").write_text(CARIS)
    block = {"files": ["a"], "format": "r2sonic", "mount": dict(MOUNT), **mbes}
    content = {
        "ins": {"files": ["a"], "format": "novatel"}, "laser": {"files": ["a"], "format": "las", "mount": dict(MOUNT)},
        "mbes": block,
    }  # fmt: skip
    (folder / "session.yaml").write_text(yaml.safe_dump(content))
    return folder


@pytest.mark.parametrize("given", ["casts/today.svp", "casts/*.svp", "**/*.svp"])
def test_a_session_that_names_a_cast(given: str, tmp_path: Path) -> None:
    mbes = load_session(session(tmp_path, svp=given), with_cast).mbes
    assert mbes is not None
    assert mbes.svp is not None
    is_profile(mbes.svp)
    assert mbes.svp_from is not None
    assert (mbes.svp_from.file, mbes.svp_from.kind) == ("casts/today.svp", "CARIS .svp")


@pytest.mark.parametrize(
    ("mbes", "words"),
    [
        ({"svp": "casts/tomorrow.svp"}, "mbes.svp: 'casts/tomorrow.svp' matches no file"),
        ({"svp": "../today.svp"}, "mbes.svp = '../today.svp': must be a path or pattern inside the session folder"),
        ({"svp": "/etc/passwd"}, "mbes.svp = '/etc/passwd': must be a path"),
        ({"svp": "casts/*"}, r"matches 2 files \(casts/other.svp, casts/today.svp\); name one"),
        ({"svp": [[0, 1480], [1, 1480]], "svp_number": 1}, "svp_number = 1: belongs to a file.*name the file"),
        ({"svp_from": {}}, "mbes.svp_from: is written by poolcal"),
        ({"svp": "casts/today.svp", "svp_number": "two"}, "has no cast two"),
    ],
)
def test_a_session_whose_cast_is_refused(mbes: dict[str, Any], words: str, tmp_path: Path) -> None:
    folder = session(tmp_path, **mbes)
    if "*" in str(mbes.get("svp")):
        (folder / "casts" / "other.svp").write_text(CARIS)
    with pytest.raises((ConfigError, RawDataError), match=words):
        load_session(folder, with_cast)


@pytest.mark.parametrize("name", ["a\nb.svp", os.fsdecode(b"\xff.svp"), "a\x1b[1m.svp"])
def test_names_that_cannot_be_shown(name: str, tmp_path: Path) -> None:
    folder = session(tmp_path, svp="casts/*.svp")
    (folder / "casts" / "today.svp").rename(folder / "casts" / name)
    with pytest.raises(RawDataError, match="letters that cannot be shown; rename") as error:
        load_session(folder, with_cast)
    assert str(error.value).isprintable()


def test_the_name_of_the_file_stays_in_session_yaml(tmp_path: Path) -> None:
    """poolcal coarse and poolcal laser edit that file; there too a cast that cannot be read is refused."""
    text, content = read_session(session(tmp_path, svp="casts/today.svp"))
    assert "svp: casts/today.svp" in text
    assert content["mbes"]["svp"] == "casts/today.svp"
    (tmp_path / "casts" / "today.svp").write_text("1 2\n")
    with pytest.raises(RawDataError, match=r"today\.svp: is no cast"):
        read_session(tmp_path)


def test_a_link_out_of_the_session(tmp_path: Path) -> None:
    (tmp_path / "elsewhere.svp").write_text(CARIS)
    (tmp_path / "s").mkdir()
    folder = session(tmp_path / "s", svp="casts/link.svp")
    (folder / "casts" / "link.svp").symlink_to(tmp_path / "elsewhere.svp")
    with pytest.raises(RawDataError, match="leads out of the session folder"):
        load_session(folder, with_cast)
