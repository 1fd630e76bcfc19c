"""Raw files that are missing, damaged, cut or of another kind, and times that do not meet."""

import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from pipeline.gps_time import NS
from pipeline.simulation.novatel import aligning_bodies, novatel_bytes
from tests.support.effort import often
from tests.support.places import Place, Told, poolcal, simulate
from tests.support.refusals import Spoil, as_if_nothing_had_been, nothing_is_left, one_line


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


def _listed_twice(place: Place) -> None:
    shutil.copy(place.raw("mbes"), place.raw("mbes").with_name("copy.xtf"))


RXP = b"\x00\x01\x0e\xf5\x00\x00\x00\x00RieglLMS-VZ1000" + bytes(5000)
FILES: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "session folder missing": (_session_is_gone, ("session", "is no folder", "session.yaml")),
    "session.yaml missing": (_unlink("session/session.yaml"), ("there is no such file", "poolcal init")),
    "config missing": (_unlink("pool.yaml"), ("pool.yaml", "cannot be read", "check the path")),
    "no INS file": (_remove("ins"), ("session.yaml", "ins/*.gps", "matches no file")),
    "no laser file": (_remove("laser"), ("session.yaml", "laser/*.las", "matches no file")),
    "no sonar file": (_remove("mbes"), ("session.yaml", "mbes/*.xtf", "matches no file")),
    "pattern without file": (_files_name_nothing, ("session.yaml", "mbes/*.gsf", "matches no file")),
    "link out of the session": (_link_leads_out, ("pass_0.las", "out of the session", "copy")),
    "sonar file listed twice": (_listed_twice, ("mbes/pass_0.xtf: is the same as mbes/copy.xtf", "list one")),
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


# Of these the same folder is run again to the end: of one that ends when all files of a stage have been read, and by
# make thorough of two that end before.
MENDED = ("INS a day later", *often((), ("no laser file", "RXP as LAS")))


@pytest.mark.parametrize("what", FILES)
def test_files(what: str, place: Place, right: dict[str, str]) -> None:
    spoil, words = FILES[what]
    spoil(place)
    one_line(place.calibrate(), *words)
    nothing_is_left(place)
    if what in MENDED:
        as_if_nothing_had_been(place, right)


SHORT = {"half_length_m": 2.5, "margin_s": 1.0}  # of passes whose files are read, and calibrate nothing


# --- weeks -----------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="session")
def weeks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session whose INS and laser files carry seconds of week alone."""
    folder = tmp_path_factory.mktemp("weeks") / "session"
    return simulate(folder, ins={"format": "sbet"}, laser={"time": "week_seconds"}, track=SHORT)


@pytest.mark.parametrize("sensor", ["ins", "laser"])
@pytest.mark.parametrize(("week", "words"), [(None, ("is missing",)), (2417, ("1 week apart: check gps_week",))])
def test_weeks(sensor: str, week: int | None, words: tuple[str, ...], weeks: Path, tmp_path: Path) -> None:
    place = Place(weeks, tmp_path)
    place.mend()
    place.edit_session(sensor, gps_week=week)
    one_line(place.calibrate(), "gps_week", *words)
    nothing_is_left(place)


# --- cut files -------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="session")
def others(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same session in the other formats, but for LAZ: a process of its own reads that."""
    folder = tmp_path_factory.mktemp("others") / "session"
    return simulate(folder, ins={"format": "inspvaa"}, mbes={"format": "r2s"}, track=SHORT)


@pytest.fixture(scope="session")
def laz(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return simulate(tmp_path_factory.mktemp("laz") / "session", laser={"format": "laz"}, track=SHORT)


@pytest.mark.parametrize("tenth", often((1, 5, 9), range(1, 10)))
@pytest.mark.parametrize(
    ("session", "sensor"),
    [
        *(("small", sensor) for sensor in ("ins", "laser", "mbes")),
        ("others", "ins"), ("others", "mbes"), ("laz", "laser"), ("weeks", "ins"),
    ],
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
