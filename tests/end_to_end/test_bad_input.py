"""Whatever is wrong with the input ends in one line and status 2, and leaves nothing that a later run would trust."""

import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from pipeline.simulation.novatel import aligning_bodies, novatel_bytes
from pipeline.times import NS
from tests.end_to_end.places import Place, Told, digests, poolcal, simulate

Spoil = Callable[[Place], None]


def one_line(told: Told, *words: str) -> None:
    """Status 2, one line on standard error beside the stages' progress, and it says what it must."""
    assert told.status == 2, told.err
    assert "Traceback" not in told.err
    assert len(told.complaints) == 1, told.err
    line = told.complaints[0]
    assert told.err.endswith(line + "\n")
    assert line.startswith("poolcal: ")
    for word in words:
        assert word in line, line
    assert told.out == ""


def nothing_is_left(place: Place) -> None:
    """No stage has left anything at all: the next run starts from nothing."""
    left = {path.name for path in place.run.iterdir()} if place.run.exists() else set()
    assert left <= {"run.yaml", "digests.json", ".lock"}


def as_if_nothing_had_been(place: Place, right: dict[str, str]) -> None:
    """After mending, the same run folder gives what an undisturbed run gives."""
    left = {path.name for path in place.run.iterdir()}
    assert left <= {"run.yaml", "digests.json", ".lock", "ingest", "georeference"}
    place.mend()
    told = place.calibrate()
    assert told.status == 0, told.err
    assert digests(place.run) == right


# --- what can be wrong with files ------------------------------------------------------------------------------------
def _remove(sensor: str) -> Spoil:
    return lambda place: shutil.rmtree(place.session / sensor)


def _overwrite(sensor: str, content: bytes) -> Spoil:
    return lambda place: place.raw(sensor).write_bytes(content) and None


def _empty(sensor: str) -> Spoil:
    def spoil(place: Place) -> None:
        place.raw(sensor).write_bytes(b"")

    return spoil


def _swap(here: str, there: str) -> Spoil:
    """One sensor's file under another's name."""

    def spoil(place: Place) -> None:
        shutil.copy(place.raw(there), place.raw(here))

    return spoil


def _later_ins(place: Place) -> None:
    """INS of the same pool, a day later."""
    other = simulate(place.folder / "later", start_utc="2026-05-13T08:00:00")
    shutil.copy(other / "ins" / "ins.gps", place.raw("ins"))


def _later_laser(place: Place) -> None:
    other = simulate(place.folder / "later", start_utc="2026-05-13T08:00:00")
    shutil.rmtree(place.session / "laser")
    shutil.copytree(other / "laser", place.session / "laser")


def _later_mbes(place: Place) -> None:
    other = simulate(place.folder / "later", start_utc="2026-05-13T08:00:00")
    shutil.rmtree(place.session / "mbes")
    shutil.copytree(other / "mbes", place.session / "mbes")


def _never_aligned(place: Place) -> None:
    place.raw("ins").write_bytes(novatel_bytes(aligning_bodies(1_462_608_000 * NS, 60.0), "inspvas"))


def _unlink(name: str) -> Spoil:
    return lambda place: (place.folder / name).unlink()


def _session_is_gone(place: Place) -> None:
    shutil.rmtree(place.session)


def _files_name_nothing(place: Place) -> None:
    place.edit_session("mbes", files=["mbes/*.gsf"])


def _link_leads_out(place: Place) -> None:
    place.raw("laser").unlink()
    (place.session / "laser" / "pass_0.las").symlink_to(place.template / "laser" / "pass_0.las")


RXP = b"\x00\x01\x0e\xf5\x00\x00\x00\x00RieglLMS-VZ1000" + bytes(5000)
FILES: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "session folder missing": (_session_is_gone, ("session", "is no folder", "session.yaml")),
    "session.yaml missing": (_unlink("session/session.yaml"), ("session.yaml", "cannot be read", "check the path")),
    "config missing": (_unlink("pool.yaml"), ("pool.yaml", "cannot be read", "check the path")),
    "no INS file": (_remove("ins"), ("session.yaml", "ins/*.gps", "matches no file")),
    "no laser file": (_remove("laser"), ("session.yaml", "laser/*.las", "matches no file")),
    "no sonar file": (_remove("mbes"), ("session.yaml", "mbes/*.xtf", "matches no file")),
    "pattern without file": (_files_name_nothing, ("session.yaml", "mbes/*.gsf", "matches no file")),
    "link out of the session": (_link_leads_out, ("pass_0.las", "out of the session", "copy")),
    "empty INS file": (_empty("ins"), ("ins.gps", "empty")),
    "one empty laser file": (_empty("laser"), ("pass_0.las", "empty")),
    "one empty sonar file": (_empty("mbes"), ("pass_0.xtf", "empty")),
    "RXP as LAS": (_overwrite("laser", RXP), ("pass_0.las", "rxp", "export")),
    "LAS as XTF": (_swap("mbes", "laser"), ("pass_0.xtf", "LAS", "r2sonic", "format")),
    "XTF as LAS": (_swap("laser", "mbes"), ("pass_0.las", "XTF", "las", "format")),
    "LAS as NovAtel": (_swap("ins", "laser"), ("ins.gps", "LAS", "novatel", "format")),
    "text as NovAtel": (_overwrite("ins", b"Dear diary,\ntoday nothing.\n" * 99), ("ins.gps",)),
    "noise as XTF": (_overwrite("mbes", np.random.default_rng(1).bytes(9999)), ("pass_0.xtf", "no kind")),
    "zeros as NovAtel": (_overwrite("ins", bytes(9999)), ("ins.gps", "no kind")),
    "INS a day later": (_later_ins, ("no time overlap", "2026-05-13", "clocks")),
    "laser a day later": (_later_laser, ("no time overlap", "laser", "2026-05-13", "clocks")),
    "sonar a day later": (_later_mbes, ("no time overlap", "mbes", "2026-05-13", "clocks")),
    "INS never aligned": (_never_aligned, ("ins.gps", "INS_ALIGNING", "align")),
}


MENDED = ("no laser file", "RXP as LAS", "INS a day later")  # of these the same folder is run again to the end


@pytest.mark.parametrize("what", FILES)
def test_files(what: str, place: Place, right: dict[str, str]) -> None:
    spoil, words = FILES[what]
    spoil(place)
    one_line(place.calibrate(), *words)
    nothing_is_left(place)
    if what in MENDED:
        as_if_nothing_had_been(place, right)


# --- what can be wrong with the two YAML files -----------------------------------------------------------------------
def _config(**values: Any) -> Spoil:
    return lambda place: place.edit_config("target", **values)


def _add(name: str, text: str) -> Spoil:
    def spoil(place: Place) -> None:
        path = place.folder / name
        path.write_text(path.read_text(encoding="utf-8") + text, encoding="utf-8")

    return spoil


def _write(name: str, content: bytes) -> Spoil:
    return lambda place: (place.folder / name).write_bytes(content) and None


def _mount(sensor: str, **values: float) -> Spoil:
    return lambda place: place.edit_session(sensor, mount=values)


def _drop_key(place: Place) -> None:
    path = place.config
    path.write_text("".join(x for x in path.read_text().splitlines(True) if not x.startswith("  c:")), "utf-8")


SESSION = "session/session.yaml"
YAML: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "negative dimension": (_config(c=-1.0), ("pool.yaml", "target.c = -1.0", "greater than 0", "mend")),
    "dimension of no room": (_config(a=0.9), ("pool.yaml", "target", "a must be >= 2 e", "mend")),
    "text for a number": (_config(a="eight"), ("pool.yaml", "target.a = 'eight'", "mend")),
    "number in quotes": (_config(a="8.0"), ("pool.yaml", "target.a = '8.0'", "mend")),
    "truth value for a number": (_config(a=True), ("pool.yaml", "target.a = True", "mend")),
    "dimension missing": (_drop_key, ("pool.yaml", "target.c", "missing", "add")),
    "unknown key": (_config(d=1.0), ("pool.yaml", "target.d", "unknown key", "known here: a, azimuth_deg, b")),
    "unknown block": (_add("pool.yaml", "segmnt: {margin_m: 0.1}\n"), ("pool.yaml", "segmnt", "unknown key")),
    "key twice": (_add("pool.yaml", "target: {a: 6.0}\n"), ("pool.yaml", "'target'", "given twice")),
    "NaN": (_config(a=float("nan")), ("pool.yaml", "target.a = nan", "finite", "mend")),
    "infinity": (_config(water_level_m=float("inf")), ("pool.yaml", "target.water_level_m = inf", "finite", "mend")),
    "alias": (_add("pool.yaml", "verdict: &x {max_sigma_m: 1.0}\nadjust: *x\n"), ("pool.yaml", "alias")),
    "a list": (_write("pool.yaml", b"- 1\n- 2\n"), ("pool.yaml", "list", "mapping")),
    "nothing": (_write("pool.yaml", b""), ("pool.yaml", "NoneType", "mapping")),
    "binary": (_write("pool.yaml", bytes(range(256)) * 9), ("pool.yaml", "UTF-8")),
    "control characters": (_write("pool.yaml", bytes(99)), ("pool.yaml", "not valid YAML")),
    "no YAML": (_write("pool.yaml", b"target: {a: 1\n"), ("pool.yaml", "not valid YAML")),
    "deep YAML": (_write("pool.yaml", b"[" * 9999), ("pool.yaml", "not valid YAML")),
    "huge file": (_write("pool.yaml", b"# much\n" * 200_000), ("pool.yaml", "1400000 bytes", "name the YAML")),
    "object": (_write("pool.yaml", b"!!python/object/apply:os.getcwd []\n"), ("pool.yaml", "not valid YAML")),
    "date": (_add("pool.yaml", "verdict: {max_sigma_m: 2026-05-12}\n"), ("pool.yaml", "verdict.max_sigma_m", "date")),
    "session: unknown key": (_add(SESSION, "gps: 1\n"), ("session.yaml", "gps", "unknown key")),
    "session: key twice": (_add(SESSION, "name: b\n"), ("session.yaml", "'name'", "given twice")),
    "session: NaN": (_mount("mbes", roll_deg=float("nan")), ("session.yaml", "mbes.mount.roll_deg = nan", "mend")),
    "session: absolute path": (
        lambda place: place.edit_session("ins", files=["/etc/*"]),
        ("session.yaml", "ins.files.0 = '/etc/*'", "inside the session folder"),
    ),
    "session: path upwards": (
        lambda place: place.edit_session("ins", files=["../ins/*"]),
        ("session.yaml", "ins.files.0 = '../ins/*'", "inside the session folder"),
    ),
    "session: bad pattern": (lambda place: place.edit_session("ins", files=["ins/**x"]), ("session.yaml",)),
    "session: format of another": (
        lambda place: place.edit_session("ins", format="las"),
        ("session.yaml", "ins.format = 'las'", "novatel"),
    ),
    "session: week out of range": (
        lambda place: place.edit_session("ins", gps_week=42),
        ("session.yaml", "ins.gps_week = 42", "1000"),
    ),
    "session: unknown frame": (
        lambda place: place.edit_session("laser", frame="EPSG:0"),
        ("session.yaml", "laser.frame", "EPSG:0", "EPSG:4978"),
    ),
    "session: flat frame": (
        lambda place: place.edit_session("laser", frame="EPSG:32651"),
        ("session.yaml", "laser.frame", "EPSG:32651", "height"),
    ),
}


@pytest.mark.parametrize("what", YAML)
def test_yaml(what: str, place: Place) -> None:
    spoil, words = YAML[what]
    spoil(place)
    one_line(place.calibrate(), *words)
    nothing_is_left(place)


# --- settings that do not go with the data ---------------------------------------------------------------------------
SETTINGS: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "target 100 m off": (
        _config(origin={"latitude_deg": 36.0009, "longitude_deg": 120.1, "height_m": 12.0}),
        ("target.origin",),
    ),
    "target 100 m up": (
        _config(origin={"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 112.0}),
        ("target.origin",),
    ),
    "sonar looks away": (_mount("mbes", roll_deg=48.0), ("mount",)),
    "laser looks away": (_mount("laser", yaw_deg=180.0), ("laser.mount",)),
}


@pytest.mark.parametrize("what", SETTINGS)
def test_settings(what: str, place: Place, right: dict[str, str]) -> None:
    spoil, words = SETTINGS[what]
    spoil(place)
    one_line(place.calibrate(), *words)
    left = {path.name for path in place.run.iterdir()}
    assert left <= {"run.yaml", "digests.json", ".lock", "ingest", "georeference"}
    if what in ("target 100 m off", "sonar looks away"):  # one that ends before any stage is complete, one after two
        as_if_nothing_had_been(place, right)


NEVER_ACCEPTED: dict[str, Spoil] = {
    "target too small": _config(a=6.0, b=2.4, c=0.8, e=0.4),
    "blocks of another height": _config(e=0.4),
    "wall of another width": _config(b=2.6),
    "coarse mount 20 degrees off in roll": _mount("mbes", roll_deg=-28.0),
    "coarse mount 20 degrees off in yaw": _mount("mbes", yaw_deg=17.2),
}


@pytest.mark.parametrize("what", NEVER_ACCEPTED)
def test_wrong_by_much_is_never_accepted(what: str, place: Place) -> None:
    """Refused with one line, or rejected with reasons: which of the two depends on what is left on the target."""
    NEVER_ACCEPTED[what](place)
    told = place.calibrate()
    assert told.status in (1, 2), told.out
    if told.status == 2:
        one_line(told)
    else:
        assert place.result()["verdict"] == "rejected"
        assert place.result()["reasons"]

# --- weeks -----------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="session")
def weeks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session whose INS and laser files carry seconds of week alone."""
    folder = tmp_path_factory.mktemp("weeks") / "session"
    return simulate(folder, ins={"format": "sbet"}, laser={"time": "week_seconds"})


@pytest.mark.parametrize("sensor", ["ins", "laser"])
@pytest.mark.parametrize(("week", "words"), [(None, ("is missing",)), (2417, ("weeks apart",))])
def test_weeks(sensor: str, week: int | None, words: tuple[str, ...], weeks: Path, tmp_path: Path) -> None:
    place = Place(weeks, tmp_path)
    place.mend()
    place.edit_session(sensor, gps_week=week)
    one_line(place.calibrate(), "gps_week", *words)
    nothing_is_left(place)


# --- cut files -------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="session")
def others(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same session in the other formats."""
    folder = tmp_path_factory.mktemp("others") / "session"
    return simulate(folder, ins={"format": "inspvaa"}, laser={"format": "laz"}, mbes={"format": "r2s"})


@pytest.mark.parametrize("tenth", range(1, 10))
@pytest.mark.parametrize(
    ("session", "sensor"),
    [*((session, sensor) for session in ("small", "others") for sensor in ("ins", "laser", "mbes")), ("weeks", "ins")],
)
def test_cut_at_each_tenth(
    session: str, sensor: str, tenth: int, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """One clear line, or a calibration from what is left with the loss counted; never a bug."""
    place = Place(request.getfixturevalue(session), tmp_path)
    place.mend()
    path = place.raw(sensor)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * tenth // 10])
    whole = session == "small" and tenth == 5  # of the others only the stage that reads files
    told = place.calibrate() if whole else ingest(place)
    if told.status == 2:
        one_line(told, path.name)
        nothing_is_left(place)
        return
    assert told.status in (0, 1), told.err
    table = pq.read_table(place.run / "ingest" / "files.parquet").to_pylist()
    assert {row["file"] for row in table} >= {f"{sensor}/{path.name}"}


def ingest(place: Place) -> Told:
    """The first stage alone, in a run folder that has its settings."""
    return poolcal(
        "stage", "ingest", place.run, "--session", place.session, "--config", place.config, "--jobs", 1
    )


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


FOLDERS: dict[str, tuple[Callable[[Place], Path], tuple[str, ...]]] = {
    "file in the way": (_file_in_the_way, ("taken", "cannot be written", "another run folder")),
    "file above": (_file_above, ("taken", "cannot be written", "another run folder")),
    "in the session": (_inside_session, ("--run", "lies in the session folder", "apart")),
    "round the session": (_round_session, ("--run", "lies in the session folder", "apart")),
    "somebody else's": (_foreign, ("foreign", "thesis.doc", "no run folder", "name another")),
    "where nothing can be": (_no_folder_can_be_there, ("/proc/", "cannot be written", "another run folder")),
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
def test_disk_full_in_the_third_stage(place: Place, right: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    write_table = pq.ParquetWriter.write_table

    def refuse(self: pq.ParquetWriter, *args: Any, **options: Any) -> None:
        if any((place.run / "segment.partial").glob("*/*.parquet")):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write_table(self, *args, **options)

    with monkeypatch.context() as patch:
        patch.setattr(pq.ParquetWriter, "write_table", refuse)
        told = place.calibrate()
    one_line(told, "segment", "No space left on device", "make room and run again")
    assert told.ran == ["ingest", "georeference"]
    assert not (place.run / "segment").exists()
    assert not (place.run / "segment.partial").exists()
    told = place.calibrate()
    assert told.ran == ["segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report"]
    assert digests(place.run) == right


def test_an_earlier_result_outlives_a_full_disk(
    place: Place, right: dict[str, str], undisturbed: tuple[Path, Told], monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(undisturbed[0], place.run)
    place.edit_config("segment", margin_m=0.04)

    def refuse(*args: Any, **options: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(pq.ParquetWriter, "write_table", refuse)
        one_line(place.calibrate(), "segment", "No space left on device", "make room and run again")
    assert digests(place.run) == right
    place.mend()
    assert place.calibrate().ran == []
    assert digests(place.run) == right


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system with less room than a run takes."""
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("only root can mount a file system, and only on Linux is it known how")
    disk = tmp_path / "disk"
    disk.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(disk)]
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
    told = _run_in(place, run)
    assert told.status == 0, told.err
    assert digests(run) == right
