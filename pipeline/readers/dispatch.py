"""Readers: raw instrument files -> canonical columns. The only place that knows byte layouts, NED and UTC.

``raw_parts`` finds a sensor's files, recognises each by its content, and returns parts whose ``chunks()`` stream
canonical columns (names and units as the tables of stage ingest in ``pipeline.artefacts``; INS angles are NovAtel's:
roll starboard down +, pitch bow up +, azimuth clockwise from north) together with counts of what was left out and why.
Damaged files give RawDataError or fewer rows, never another exception.
"""

import os
from collections.abc import Callable, Sequence
from itertools import takewhile
from pathlib import Path, PurePosixPath
from typing import Literal

import numpy as np

from pipeline.artefacts.streams import Part
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import NS, WEEK_NS
from pipeline.readers import detect
from pipeline.readers.claimed_counts import refuse_claim
from pipeline.readers.crs import LaserFrame, frame_transform

Sensor = Literal["ins", "laser", "mbes"]
Settings = Ins | Laser | Mbes


def raw_files(settings: Settings, folder: Path) -> list[Path]:
    """The files that session.yaml's patterns name, each once, in order of their paths in the session folder.

    Raises
    ------
    RawDataError
        A pattern matches no file, or a file that lies outside the session folder (by way of a symbolic link).
    """
    key = f"{type(settings).__name__.lower()}.files"
    return sorted({*found(folder, settings.files, key), *_accuracy_files(settings, folder)}, key=_in(folder))


def _accuracy_files(settings: Settings, folder: Path) -> list[Path]:
    return found(folder, settings.accuracy, "ins.accuracy") if isinstance(settings, Ins) else []


def _in(folder: Path) -> Callable[[Path], str]:
    return lambda path: path.relative_to(folder).as_posix()


def found(folder: Path, patterns: Sequence[str], key: str) -> list[Path]:
    if not folder.is_dir():
        raise RawDataError(f"{folder}: the session folder is gone; put it back, or name its new place")
    found: dict[Path, Path] = {}
    for pattern in patterns:
        matches = _matches(folder, pattern, key)
        if not matches:
            raise RawDataError(f"session.yaml: {key}: {pattern!r} matches no file in {folder}; correct the pattern")
        for path, real in matches:
            found[real] = min(path, found.get(real, path))
    return sorted(found.values(), key=_in(folder))


def _matches(folder: Path, pattern: str, key: str) -> list[tuple[Path, Path]]:
    """Regular files that match, with their resolved paths."""
    files = []
    try:
        root = folder.resolve()
        for path in folder.glob(pattern):
            if not path.is_file():
                continue
            real = path.resolve()
            if not real.is_relative_to(root):
                raise RawDataError(f"{path}: leads out of the session folder, to {real}; copy the file into it")
            files.append((path, real))
        _refuse_unreadable(folder, pattern)
    except (ValueError, NotImplementedError) as error:
        raise ConfigError(f"session.yaml: {key}: {pattern} is no pattern ({error}); correct the pattern") from error
    except (OSError, RuntimeError) as error:
        raise RawDataError(f"{folder}: {pattern} cannot be searched ({error}); check the folder") from error
    return files


def _refuse_unreadable(folder: Path, pattern: str) -> None:
    """Python passes over folders that it may not read, and so over their files: OSError instead."""
    parts = PurePosixPath(pattern).parts
    fixed = list(takewhile(lambda part: not set(part) & set("*?["), parts[:-1]))

    def refuse(error: OSError) -> None:
        if not isinstance(error, FileNotFoundError):
            raise error

    for _ in os.walk(folder.joinpath(*fixed), onerror=refuse):
        if len(fixed) == len(parts) - 1:  # all that can match lies in this one
            break


def raw_parts(sensor: Sensor, settings: Settings, folder: Path) -> tuple[Part, ...]:
    """The parts of one sensor's files, in order.

    Raises
    ------
    RawDataError
        A file cannot be read, or is not what session.yaml says it is.
    ConfigError
        Something is missing or wrong in session.yaml: ``gps_week``, ``laser.frame``, ``laser.heights``.
    """
    if isinstance(settings, Laser):
        frame_transform(_frame(settings))
    files = _named(folder, found(folder, settings.files, f"{sensor}.files"))
    for path, name in files:
        _check_kind(path, name, sensor, settings)
    if settings.format == "table":
        return _tables(files, sensor, settings)
    if isinstance(settings, Laser):
        return _e57(files, settings) if settings.format == "e57" else _las(files, settings)
    if isinstance(settings, Mbes):
        return _soundings(files, settings)
    if settings.format == "sbet":
        return _sbet(files, _named(folder, _accuracy_files(settings, folder)), settings)
    return _inertial_explorer(files, settings) if settings.format == "inertial_explorer" else _novatel(files, settings)


Files = list[tuple[Path, str]]


def _named(folder: Path, paths: list[Path]) -> Files:
    return [(path, _in(folder)(path)) for path in paths]


def _check_kind(path: Path, name: str, sensor: Sensor, settings: Settings) -> None:
    kind = detect.kind_of(path, name)
    if kind.format == settings.format and sensor in kind.sensors:
        return
    if settings.format == "inertial_explorer" and kind is detect.TEXT:
        raise RawDataError(
            f"{name}: is a text without Inertial Explorer's column names; export it from Inertial Explorer with its "
            "header ('header' ticked in the export profile)"
        )
    if kind.format is None:
        raise RawDataError(f"{name}: is {kind.title}, not {settings.format}; {kind.advice_for(sensor)}")
    if sensor in kind.sensors:
        raise RawDataError(
            f"{name}: is {kind.title}, but session.yaml has {sensor}.format: {settings.format}; "
            f"write {sensor}.format: {kind.format}, and keep files of one format in {sensor}.files"
        )
    raise RawDataError(
        f"{name}: is {kind.title}, not a file of {sensor} in format {settings.format}; "
        f"list it under {kind.sensors[0]}.files"
    )


def _novatel(files: Files, settings: Ins) -> tuple[Part, ...]:
    from pipeline.readers.novatel import NovatelPart

    return tuple(NovatelPart(path, name, settings.latency_s) for path, name in files)


def _inertial_explorer(files: Files, settings: Ins) -> tuple[Part, ...]:
    from pipeline.readers.inertial_explorer import InertialExplorerPart
    from pipeline.readers.inertial_explorer_layout import read_layout

    layouts = [(name, read_layout(path, name)) for path, name in files]
    weekly = [(name, layout.first_s) for name, layout in layouts if layout.clock == "gps_week"]
    weeks = iter(_weeks([first for _, first in weekly], settings.gps_week, "ins", weekly[0][0]) if weekly else [])
    return tuple(
        InertialExplorerPart(path, name, next(weeks) if layout.clock == "gps_week" else None, settings.latency_s)
        for (path, name), (_, layout) in zip(files, layouts, strict=True)
    )


def _sbet(files: Files, accuracy: Files, settings: Ins) -> tuple[Part, ...]:
    from pipeline.readers import sbet
    from pipeline.readers.smrmsg import SmrmsgPart

    for path, name in files:
        sbet.check_size(path, name)
    for path, name in accuracy:
        if (kind := detect.kind_of(path, name)) is not detect.ACCURACY:
            raise RawDataError(f"{name}: is {kind.title}, not a whole accuracy file (SMRMSG); correct ins.accuracy")
    firsts = [sbet.first_seconds(path, name) for path, name in (*files, *accuracy)]
    weeks = _weeks(firsts, settings.gps_week, "ins", files[0][1])
    solutions = [sbet.SbetPart(*file, week, settings.latency_s) for file, week in zip(files, weeks, strict=False)]
    sigmas = [
        SmrmsgPart(*file, week, settings.latency_s) for file, week in zip(accuracy, weeks[len(files) :], strict=True)
    ]
    return (*solutions, *sigmas)


def _las(files: Files, settings: Laser) -> tuple[Part, ...]:
    from pipeline.readers import las
    from pipeline.readers.las_times import refuse_wrong_time_type

    headers = [las.read_header(path, name, settings.time) for path, name in files]
    for (_, name), header in zip(files, headers, strict=True):
        refuse_claim(header.present, header.size, settings.max_records, "laser", name)
    weekly = [(name, header) for (_, name), header in zip(files, headers, strict=True) if not header.adjusted_time]
    firsts = [header.first_s for _, header in weekly]
    for name, header in weekly:
        refuse_wrong_time_type(np.array([header.first_s]), name, header.adjusted_time, header.declared_time)
    weeks = iter(_weeks(firsts, settings.gps_week, "laser", weekly[0][0]) if weekly else [])
    parts: list[Part] = []
    for (path, name), header in zip(files, headers, strict=True):
        week = None if header.adjusted_time else next(weeks)
        parts += las.las_parts(path, name, header, week, _frame(settings), settings.latency_s)
    return tuple(parts)


def _e57(files: Files, settings: Laser) -> tuple[Part, ...]:
    from pipeline.readers import e57

    frame, latency_s, most = _frame(settings), settings.latency_s, settings.max_records
    return tuple(part for path, name in files for part in e57.e57_parts(path, name, frame, latency_s, most))


def _frame(settings: Laser) -> LaserFrame:
    return LaserFrame(settings.frame, settings.heights)


def _weeks(first_seconds: list[float], gps_week: int | None, sensor: str, name: str) -> list[int]:
    """The GPS week of each file's start: ``gps_week`` is that of the first file; the others lie nearest to it."""
    if gps_week is None:
        raise ConfigError(
            f"session.yaml: {sensor}.gps_week is missing: {name} has seconds of week alone; "
            f"give {sensor}.gps_week, the GPS week in which the file begins"
        )
    week_s = WEEK_NS / NS
    steps = [(first_seconds[0] - first) / week_s for first in first_seconds]
    return [gps_week + (round(step) if abs(step) <= 1 else 0) for step in steps]


def _soundings(files: Files, settings: Mbes) -> tuple[Part, ...]:
    if settings.format == "gsf":
        from pipeline.readers.gsf import GsfPart

        return tuple(GsfPart(path, name, settings.sound_speed_m_s, settings.latency_s) for path, name in files)
    if settings.format in ("kmall", "all"):
        return _kongsberg(files, settings)
    from pipeline.readers.r2sonic import R2sonicPart

    return tuple(
        R2sonicPart(path, name, detect.kind_of(path, name) is detect.XTF, settings.latency_s) for path, name in files
    )


def _kongsberg(files: Files, settings: Mbes) -> tuple[Part, ...]:
    from pipeline.readers.kmall import KmallPart
    from pipeline.readers.kongsberg_all import AllPart

    kind = KmallPart if settings.format == "kmall" else AllPart
    return tuple(kind(path, name, settings.latency_s, settings.projector_offset_m) for path, name in files)


def _tables(files: Files, sensor: Sensor, settings: Settings) -> tuple[Part, ...]:
    from pipeline.readers.table import TablePart

    frame = _frame(settings) if isinstance(settings, Laser) else LaserFrame()
    return tuple(TablePart(path, name, sensor, frame, settings.latency_s, settings.max_records) for path, name in files)
