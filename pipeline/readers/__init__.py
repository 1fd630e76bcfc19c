"""Raw instrument files -> canonical columns. The only place that knows byte layouts, NED and UTC.

One module a format. A file's kind is found by its content and must agree with session.yaml's ``format``.
"""

from pathlib import Path
from typing import Literal

from pipeline.config import Ins, Laser, Mbes
from pipeline.errors import RawDataError
from pipeline.streams import Part

Sensor = Literal["ins", "laser", "mbes"]
KINDS = {"novatel": ("novatel",), "sbet": ("sbet",), "las": ("las",), "r2sonic": ("xtf", "r2sonic"), "table": ("csv", "parquet")}


def raw_files(settings: Ins | Laser | Mbes, folder: Path) -> list[Path]:
    """The files that ``files`` names, in order of name, each once; all inside the session folder."""
    root = folder.resolve()
    found: set[Path] = set()
    for pattern in settings.files:
        matches = [path for path in folder.glob(pattern) if path.is_file()]
        if not matches:
            raise RawDataError(f"{folder / 'session.yaml'}: files: {pattern!r} matches no file in the session folder; mend the pattern")
        for path in matches:
            if not path.resolve().is_relative_to(root):
                raise RawDataError(f"{path}: leads out of the session folder; copy the file into it")
        found |= set(matches)
    return sorted(found)


def raw_parts(sensor: Sensor, settings: Ins | Laser | Mbes, folder: Path) -> tuple[Part, ...]:
    """Parts of all files of one sensor."""
    parts: list[Part] = []
    for path in raw_files(settings, folder):
        parts += _parts_of(path, path.relative_to(folder).as_posix(), sensor, settings)
    return tuple(parts)


def _parts_of(path: Path, name: str, sensor: Sensor, settings: Ins | Laser | Mbes) -> list[Part]:
    from pipeline.readers.detect import kind_of, refuse
    from pipeline.readers.las import las_parts
    from pipeline.readers.novatel import NovatelPart
    from pipeline.readers.r2sonic import R2SonicPart
    from pipeline.readers.sbet import SbetPart
    from pipeline.readers.table import TablePart

    kind = kind_of(path)
    if kind not in KINDS[settings.format]:
        raise refuse(path, kind, settings.format)
    if kind == "novatel":
        return [NovatelPart(path, name, settings.latency_s)]
    if kind == "sbet":
        return [SbetPart(path, name, settings.gps_week if isinstance(settings, Ins) else None, settings.latency_s)]
    if kind in ("xtf", "r2sonic"):
        return [R2SonicPart(path, name, kind, settings.latency_s)]
    frame = settings.frame if isinstance(settings, Laser) else "laser"
    if kind == "las":
        week = settings.gps_week if isinstance(settings, Laser) else None
        return list(las_parts(path, name, week, settings.latency_s, frame))
    return [TablePart(path, name, sensor, kind, settings.latency_s, frame)]
