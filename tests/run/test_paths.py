"""Paths that lead nowhere: a link to itself, a name that no disk has. They are refused like any other, in one line."""

from pathlib import Path

import pytest

from pipeline.errors import ArtefactError, ConfigError
from pipeline.run.output_files import refuse_output
from pipeline.run.settings import holds_run, read_settings, refuse_shared_folder

TOO_LONG = "a" * 300


@pytest.fixture
def loop(tmp_path: Path) -> Path:
    path = tmp_path / "loop.pdf"
    path.symlink_to(path.name)
    return path


def test_such_a_folder_holds_no_run(loop: Path) -> None:
    for path in (loop, loop / "run", Path(TOO_LONG)):
        assert not holds_run(path)
        with pytest.raises(ArtefactError, match="is no run folder"):
            read_settings(path)


def test_a_run_folder_that_is_a_link_to_itself(loop: Path, tmp_path: Path) -> None:
    refuse_shared_folder(loop, tmp_path / "session")  # in no session folder; writing to it is refused later
    with pytest.raises(ConfigError, match="lies in the session folder"):
        refuse_shared_folder(loop / "run", tmp_path)


def test_a_file_that_is_a_link_to_nothing_is_not_replaced(loop: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.pdf"
    broken.symlink_to("nowhere.pdf")
    for file in (loop, broken):
        with pytest.raises(ConfigError, match="is no file; name another"):
            refuse_output("--pdf", file, tmp_path / "run")
