"""Which files a session's patterns name, and what happens to those of another kind."""

import os
from pathlib import Path

import pytest

from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.dispatch import raw_files, raw_parts
from tests.support.files import build, ie_files
from tests.support.files.sonar_files import all_installation


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "session"
    for name in ("ins/b.gps", "ins/a.gps", "ins/deep/c.gps", "laser/扫描 1.las", "mbes/x.xtf"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b"content")
    return folder


def names(session: Path, *patterns: str) -> list[str]:
    paths = raw_files(build.settings("ins", patterns, "novatel"), session)
    assert all(path.is_file() for path in paths)
    return [path.relative_to(session).as_posix() for path in paths]


@pytest.mark.parametrize(
    ("patterns", "expected"),
    [
        (["ins/*.gps"], ["ins/a.gps", "ins/b.gps"]),
        (["ins/b.gps", "ins/a.gps"], ["ins/a.gps", "ins/b.gps"]),
        (["ins/**/*.gps"], ["ins/a.gps", "ins/b.gps", "ins/deep/c.gps"]),
        (["ins/*"], ["ins/a.gps", "ins/b.gps"]),  # deep is a folder
        (["ins/a.gps", "ins/*.gps", "ins/a.gps"], ["ins/a.gps", "ins/b.gps"]),
        (["laser/扫描 1.las"], ["laser/扫描 1.las"]),
        (["laser/扫*"], ["laser/扫描 1.las"]),
        (["./ins/a.gps"], ["ins/a.gps"]),
        (["ins/[ab].gps"], ["ins/a.gps", "ins/b.gps"]),
    ],
)
def test_patterns(patterns: list[str], expected: list[str], session: Path) -> None:
    assert names(session, *patterns) == expected


@pytest.mark.parametrize("pattern", ["ins/*.out", "nowhere/*", "ins/deep", "ins/A.gps.", "ins/[", "laser/*.gps"])
def test_pattern_that_matches_no_file(pattern: str, session: Path) -> None:
    with pytest.raises(RawDataError, match=r"session\.yaml.*matches no file") as error:
        names(session, "ins/a.gps", pattern)
    assert repr(pattern) in str(error.value)


def test_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(RawDataError):
        names(tmp_path / "gone", "*")


def test_link_that_leads_out(session: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere.gps").write_bytes(b"content")
    (session / "ins" / "z.gps").symlink_to(tmp_path / "elsewhere.gps")
    with pytest.raises(RawDataError, match=r"z\.gps.*out of the session.*copy"):
        names(session, "ins/*.gps")


def test_folder_link_that_leads_out(session: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "e.gps").write_bytes(b"content")
    (session / "linked").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(RawDataError, match=r"e\.gps.*out of the session"):
        names(session, "linked/*.gps")


def test_link_inside_is_the_same_file(session: Path) -> None:
    (session / "ins" / "z.gps").symlink_to("a.gps")
    assert names(session, "ins/*.gps") == ["ins/a.gps", "ins/b.gps"]


def test_link_in_a_circle(session: Path) -> None:
    (session / "ins" / "z.gps").symlink_to("z.gps")
    try:
        assert names(session, "ins/*.gps") == ["ins/a.gps", "ins/b.gps"]
    except RawDataError as error:
        assert "\n" not in str(error)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no FIFOs here")
def test_fifo_is_no_file(session: Path) -> None:
    os.mkfifo(session / "ins" / "z.gps")
    assert names(session, "ins/*.gps") == ["ins/a.gps", "ins/b.gps"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_file_that_may_not_be_read(session: Path) -> None:
    (session / "ins" / "a.gps").chmod(0)
    with pytest.raises(RawDataError, match=r"a\.gps.*cannot be read"):
        raw_parts("ins", build.settings("ins", ["ins/a.gps"], "novatel"), session)


GOOD = {
    "a.gps": ("ins", "novatel", build.inspvas(1.0) * 3),
    "b.asc": ("ins", "novatel", build.inspvasa(1.0) * 3),
    "c.out": ("ins", "sbet", build.sbet(100.0, 100.1, 100.2)),
    "d.las": ("laser", "las", build.las([(1, 2, 3, 4e8 + 0.001)] * 3)),
    "e.xtf": ("mbes", "r2sonic", build.xtf(build.ping(1))),
    "f.r2s": ("mbes", "r2sonic", build.ping(1)),
    "h.txt": ("ins", "inertial_explorer", ie_files.whole("degrees", ie_files.truth(9))),
    "g.csv": ("laser", "table", b"gps_ns,x_m,y_m,z_m\n1400000000000000000,1,2,3\n"),
}
FORMATS = [
    ("ins", "novatel"), ("ins", "sbet"), ("ins", "inertial_explorer"), ("laser", "las"), ("mbes", "r2sonic")
]  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize(("sensor", "kind"), FORMATS)
def test_content_decides(sensor: str, kind: str, name: str, tmp_path: Path) -> None:
    """Never the name. The error says what the file is and what session.yaml says."""
    own_sensor, own_kind, content = GOOD[name]
    path = tmp_path / "data.bin"
    path.write_bytes(content)
    more = {"gps_week": 2300} if sensor != "mbes" else {}
    settings = build.settings(sensor, ["data.bin"], kind, **more)
    if (own_sensor, own_kind) == (sensor, kind):
        assert len(raw_parts(sensor, settings, tmp_path)) == 1
        return
    with pytest.raises(RawDataError, match=r"data\.bin: is .*format") as error:
        raw_parts(sensor, settings, tmp_path)
    assert kind in str(error.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "empty.*copy"),
        (bytes(9999), "no known|no kind"),
        (b"Dear diary,\ntoday nothing.\n" * 99, "text"),
        (b"\x02\x00\x00\x00\x00\x00\x00\x00RieglLMS-VZ1000" + bytes(999), "rxp.*export.*LAS"),
        (b"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\n", "PCD.*export"),
        (b"\0\0\0\x14\0\0\0\1GSF-v03.08\0\0" + bytes(99), "GSF"),
        (b"\xa4\0\0\0#IIP\0" + bytes(999), "[Kk]ongsberg|KMALL"),
        (all_installation() + bytes(999), r"Kongsberg \.all"),
    ],
)
@pytest.mark.parametrize(("sensor", "kind"), FORMATS)
def test_what_is_not_read_is_refused_with_advice(
    sensor: str, kind: str, content: bytes, words: str, tmp_path: Path
) -> None:
    (tmp_path / "data.bin").write_bytes(content)
    more = {"gps_week": 2300} if sensor != "mbes" else {}
    with pytest.raises(RawDataError, match=rf"data\.bin: is .*({words})"):
        raw_parts(sensor, build.settings(sensor, ["data.bin"], kind, **more), tmp_path)


POSPAC = """\
POSPac MMS - EXPORT Utility [Oct 12 2021]
Datum: WGS84,   Time in Sec of Week

        TIME,    DISTANCE,       LATITUDE,      LONGITUDE, ELLIPSOID HEIGHT,      ROLL,     PITCH,   HEADING
  (sec of week)      (m)          (deg)          (deg)             (m)           (deg)      (deg)     (deg)
 345600.000,        0.0,   36.123456789,  120.123456789,         12.345,         1.00,      2.00,     3.00
"""


QINERTIA = "GPS Time [s]; Latitude [deg]; Longitude [deg]; Altitude [m]; Roll; Pitch; Yaw\n1;36;120;5;0;0;0\n"


@pytest.mark.parametrize("text", [POSPAC, QINERTIA])
@pytest.mark.parametrize("kind", ["inertial_explorer", "sbet", "novatel"])
def test_other_programs_texts_are_advised_to_become_sbet(kind: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(RawDataError, match=r"a\.txt: is a trajectory as text.*export it as SBET \(POSPac, Qinertia"):
        raw_parts("ins", build.settings("ins", ["a.txt"], kind, gps_week=2300), tmp_path)


def test_an_export_without_its_header(tmp_path: Path) -> None:
    rows = ie_files.whole("degrees", ie_files.truth(9)).split(b"\n")[-10:]
    (tmp_path / "a.txt").write_bytes(b"\n".join(rows))
    with pytest.raises(RawDataError, match=r"export it from Inertial Explorer with its header \('header' ticked"):
        raw_parts("ins", build.settings("ins", ["a.txt"], "inertial_explorer"), tmp_path)


def test_week_is_asked_for_before_anything_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.out").write_bytes(build.sbet(100.0, 100.1))
    with pytest.raises(ConfigError, match=r"ins\.gps_week.*is missing.*give"):
        raw_parts("ins", build.settings("ins", ["a.out"], "sbet"), tmp_path)
