"""Every real file is tried as every format: what is refused by what it holds, and with which advice."""

from pathlib import Path
from typing import Any

import pytest

from pipeline.errors import RawDataError
from pipeline.readers import detect, file_kind
from tests.real.conftest import Read
from tests.support.real_files import ATLANS, BUNNY, GSF, HE, KMALL, MOVED, PPP, PPP_ASCII, TURBEAMS, XTF, one_line

REFUSED = {
    "laser/riegl_130501_232206_cut.rxp": ("RIEGL .rxp", "export it to LAS"),
    "laser/autzen-utm.pcd": ("PCD", "export it to LAS"),
    "ins/sbet_ATLANS-20181023-accuracy.out": ("accurac", "give the SBET"),
    "georeferencing/PortDeQuebec_Sphere1_passage_1.txt": ("text", "docs/your-files.md"),
    "georeferencing/q_25_passage_1_sphere1.bin": ("of no kind that is read", "docs/your-files.md"),
    "georeferencing/q_25_passage_1_sphere2.bin": ("of no kind that is read", "docs/your-files.md"),
    "georeferencing/q_25_passage_1_target1.bin": ("of no kind that is read", "docs/your-files.md"),
    "georeferencing/q_25_passage_2_sphere1.bin": ("of no kind that is read", "docs/your-files.md"),
    "georeferencing/q_25_passage_2_sphere2.bin": ("of no kind that is read", "docs/your-files.md"),
    "georeferencing/q_25_passage_2_target1.bin": ("of no kind that is read", "docs/your-files.md"),
}
FORMATS = {
    "laser": ("las", "e57", "table"),
    "mbes": ("r2sonic", "gsf", "kmall", "all", "table"),
    "ins": ("novatel", "sbet", "inertial_explorer", "table"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_advice(name: str, read: Read) -> None:
    """Whatever session.yaml says they are."""
    for sensor, formats in FORMATS.items():
        for kind in formats:
            with pytest.raises(RawDataError) as error:
                read(sensor, kind, name, gps_week=2000) if sensor != "mbes" else read(sensor, kind, name)
            one_line(error, Path(name).name, *REFUSED[name])


@pytest.mark.parametrize(
    ("name", "sensor", "kind", "words"),
    [
        (XTF, "laser", "las", ("XTF", "format")),
        (PPP, "ins", "sbet", ("NovAtel", "format")),
        (PPP_ASCII, "ins", "table", ("NovAtel", "format")),
        (ATLANS, "ins", "novatel", ("SBET", "format")),
        ("laser/test1_4.las", "mbes", "r2sonic", ("LAS", "format")),
        (GSF, "mbes", "r2sonic", ("GSF", "write mbes.format: gsf")),
        (KMALL, "mbes", "table", ("kmall", "write mbes.format: kmall")),
        (HE, "mbes", "kmall", (".all", "write mbes.format: all")),
        (BUNNY, "laser", "las", ("E57", "write laser.format: e57")),
        (BUNNY, "mbes", "gsf", ("E57", "list it under laser.files")),
    ],
)
def test_another_format_than_told(name: str, sensor: Any, kind: str, words: tuple[str, ...], read: Read) -> None:
    with pytest.raises(RawDataError) as error:
        read(sensor, kind, name)
    one_line(error, Path(name).name, *words)


NO_KIND = {path for path in REFUSED if path.endswith(".bin")}  # a program's own binary, without any mark
WHOLE_SETTINGS: dict[str, dict[str, Any]] = {"ins": {"gps_week": 2000}, "laser": {"gps_week": 2000}, "mbes": {}}
REFUSED_LATER = {  # of a format that is read, but damaged, without times, with a wrong flag, of stabilised or two heads
    "ins/pdal_badfile.sbet", "laser/pdal/pdal_sample_c.las", BUNNY, MOVED, GSF, TURBEAMS,
}  # fmt: skip


def test_every_file_is_tried(data: Path, read: Read) -> None:
    """Whatever is added to the folder, however deep, is read for what it is, or refused in one line with advice."""
    paths = sorted(path for path in data.glob("*/**/*") if path.is_file())
    names = [path.relative_to(data).as_posix() for path in paths]
    assert set(REFUSED) | REFUSED_LATER <= set(names)
    for path, name in zip(paths, names, strict=True):
        kind = detect.kind_of(path, path.name)
        assert (kind is file_kind.UNKNOWN) == (name in NO_KIND), name
        if kind.format is None:
            for sensor, formats in FORMATS.items():
                with pytest.raises(RawDataError) as error:
                    read(sensor, formats[0], name, **WHOLE_SETTINGS[sensor])
                one_line(error, path.name, kind.title, "; ")
            continue
        sensor = kind.sensors[0]
        if name in REFUSED_LATER:
            with pytest.raises(RawDataError) as error:
                read(sensor, kind.format, name, **WHOLE_SETTINGS[sensor])
            one_line(error, path.name, "; ")
        else:
            columns, dropped = read(sensor, kind.format, name, **WHOLE_SETTINGS[sensor])
            assert len(columns["t_ns"]) or dropped, name
