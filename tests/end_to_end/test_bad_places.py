"""Run folders that cannot be, and disks that are full."""

import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from stages import ORDER
from tests.support.places import Place, Told, digests, poolcal
from tests.support.refusals import one_line


# --- run folders -----------------------------------------------------------------------------------------------------
def _run_in(place: Place, run: Path) -> Told:
    return poolcal("run", place.session, "--config", place.config, "--run", run, "--jobs", 1)


def _file_in_the_way(place: Place) -> Path:
    (place.folder / "taken").write_text("mine")
    return place.folder / "taken"


def _file_above(place: Place) -> Path:
    return _file_in_the_way(place) / "run"


def _inside_session(place: Place) -> Path:
    return place.session / "run"


def _round_session(place: Place) -> Path:
    return place.folder


def _foreign(place: Place) -> Path:
    (place.folder / "foreign").mkdir()
    (place.folder / "foreign" / "thesis.doc").write_text("mine")
    return place.folder / "foreign"


def _no_folder_can_be_there(place: Place) -> Path:
    return Path("/proc/self/poolcal/run")


def _name_too_long(place: Place) -> Path:
    return place.folder / ("r" * 300)


def _no_text(place: Place) -> Path:
    return place.folder / "r\udcff"


FOLDERS: dict[str, tuple[Callable[[Place], Path], tuple[str, ...]]] = {
    "file in the way": (_file_in_the_way, ("taken", "cannot be written", "another run folder")),
    "file above": (_file_above, ("taken", "cannot be written", "another run folder")),
    "in the session": (_inside_session, ("--run", "lies in the session folder", "apart")),
    "round the session": (_round_session, ("--run", "lies in the session folder", "apart")),
    "somebody else's": (_foreign, ("foreign", "thesis.doc", "no run folder", "name another")),
    "where nothing can be": (_no_folder_can_be_there, ("/proc/", "cannot be written", "another run folder")),
    "no text": (_no_text, ("udcff", "no UTF-8 text", "rename")),
    "name too long": (_name_too_long, ("cannot be written", "another run folder")),
}


@pytest.mark.parametrize("what", FOLDERS)
def test_run_folder(what: str, place: Place) -> None:
    where, words = FOLDERS[what]
    run = where(place)
    before = sorted(place.folder.rglob("*"))
    one_line(_run_in(place, run), *words)
    assert sorted(place.folder.rglob("*")) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_read_only_run_folder(place: Place) -> None:
    place.run.mkdir(parents=True)
    place.run.chmod(0o500)
    one_line(place.calibrate(), "cannot be written", "permissions")


# --- full disks ------------------------------------------------------------------------------------------------------
def test_disk_full_in_the_second_stage(place: Place, right: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    write_table = pq.ParquetWriter.write_table

    def refuse(self: pq.ParquetWriter, *args: Any, **options: Any) -> None:
        if any((place.run / "georeference.partial").glob("*/*.parquet")):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write_table(self, *args, **options)

    with monkeypatch.context() as patch:
        patch.setattr(pq.ParquetWriter, "write_table", refuse)
        told = place.calibrate()
    one_line(told, "georeference", "No space left on device", "make room and run again")
    assert told.ran == ["ingest"]
    assert not (place.run / "georeference").exists()
    assert not (place.run / "georeference.partial").exists()
    told = place.calibrate()
    assert told.ran == list(ORDER[1:])
    assert digests(place.run) == right


def test_an_earlier_result_outlives_a_full_disk(
    place: Place, right: dict[str, str], undisturbed: tuple[Path, Told], monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(undisturbed[0], place.run)
    place.edit_config("georeference", box_margin_m=1.6)

    def refuse(*args: Any, **options: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(pq.ParquetWriter, "write_table", refuse)
        one_line(place.calibrate(), "georeference", "No space left on device", "make room and run again")
    assert digests(place.run) == right
    place.mend()
    assert place.calibrate().ran == []
    assert digests(place.run) == right


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system with less room than the first stage takes."""
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("only root can mount a file system, and only on Linux is it known how")
    disk = tmp_path / "disk"
    disk.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)]
    try:
        done = subprocess.run(command, capture_output=True, check=False)
    except FileNotFoundError:
        pytest.skip("there is no mount command")
    if done.returncode:
        pytest.skip("this system lets nobody mount")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def test_a_truly_full_disk(place: Place, right: dict[str, str], tiny_disk: Path) -> None:
    run = tiny_disk / "run"
    told = _run_in(place, run)
    one_line(told, str(run), "No space left on device", "make room and run again")
    assert not list(run.glob("*.partial"))
    subprocess.run(["mount", "-o", "remount,size=100m", str(tiny_disk)], check=True)
    told = poolcal("stage", "ingest", run, "--session", place.session, "--config", place.config, "--jobs", 1)
    assert told.status == 0, told.err
    assert digests(run) == {name: digest for name, digest in right.items() if name.startswith("ingest/")}
