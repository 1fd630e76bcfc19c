"""How the files of each format become parts: one function a format, listed in :mod:`pipeline.readers.dispatch`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from pipeline.artefacts.streams import Part
from pipeline.config.instruments import Sensor
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import NS, WEEK_NS
from pipeline.readers import detect, e57, file_kind, las, sbet
from pipeline.readers.claimed_counts import refuse_claim
from pipeline.readers.crs import Frame
from pipeline.readers.gsf import GsfPart
from pipeline.readers.inertial_explorer import InertialExplorerPart
from pipeline.readers.inertial_explorer_layout import read_layout
from pipeline.readers.kmall import KmallPart
from pipeline.readers.kongsberg_all import AllPart
from pipeline.readers.las_times import refuse_contradiction
from pipeline.readers.novatel import NovatelPart
from pipeline.readers.r2sonic import R2sonicPart
from pipeline.readers.session_files import SessionFile
from pipeline.readers.smrmsg import AccuracyPart
from pipeline.readers.table import TablePart

Parts = tuple[Part, ...]
BlockOfSensor = TypeVar("BlockOfSensor", Ins, Laser, Mbes, Any)


@dataclass(frozen=True)
class SensorFiles(Generic[BlockOfSensor]):
    """One sensor's raw files, in order of their names, and its block of session.yaml."""

    sensor: Sensor
    settings: BlockOfSensor
    files: list[SessionFile]
    accuracy_files: list[SessionFile]  # SMRMSG files, of an INS alone


def laser_frame(settings: Laser) -> Frame:
    """Return the frame, or the coordinate reference system, in which the laser's points are stored."""
    return Frame(settings.frame, settings.heights)


def gps_weeks(first_s: Mapping[str, float], gps_week: int | None, sensor: Sensor) -> dict[str, int]:
    """Return the GPS week in which each file starts, by the file's name; nothing for no files.

    Parameters
    ----------
    first_s
        Seconds of week of each file's first record, by the file's name.
    gps_week
        The week of the first file, from session.yaml. The other files get the week that puts them nearest to it.
    sensor
        The sensor, for the message.

    Raises
    ------
    ConfigError
        session.yaml gives no week, and there are files.
    """
    if not first_s:
        return {}
    first_name, reference_s = next(iter(first_s.items()))
    if gps_week is None:
        raise ConfigError(
            f"session.yaml: {sensor}.gps_week is missing: {first_name} has seconds of week alone; "
            f"give {sensor}.gps_week, the GPS week in which the file begins"
        )
    steps = {name: (reference_s - seconds) / (WEEK_NS / NS) for name, seconds in first_s.items()}
    return {name: gps_week + (round(step) if abs(step) <= 1 else 0) for name, step in steps.items()}


# --- all sensors -----------------------------------------------------------------------------------------------------
def open_tables(request: SensorFiles[Any]) -> Parts:
    """Return one part for each Parquet or CSV table."""
    settings = request.settings
    frame = laser_frame(settings) if isinstance(settings, Laser) else Frame()
    return tuple(
        TablePart(
            path=file.path,
            name=file.name,
            sensor=request.sensor,
            frame=frame,
            latency_s=settings.latency_s,
            max_records=settings.max_records,
        )
        for file in request.files
    )


# --- INS -------------------------------------------------------------------------------------------------------------
def open_novatel(request: SensorFiles[Ins]) -> Parts:
    """Return one part for each NovAtel log."""
    return tuple(NovatelPart(file.path, file.name, request.settings.latency_s) for file in request.files)


def open_inertial_explorer(request: SensorFiles[Ins]) -> Parts:
    """Return one part for each export of Inertial Explorer; texts with seconds of week alone need ``gps_week``."""
    settings = request.settings
    layouts = [(file.name, read_layout(file.path, file.name)) for file in request.files]
    first_s = {name: layout.first_s for name, layout in layouts if layout.clock == "gps_week"}
    weeks = gps_weeks(first_s, settings.gps_week, "ins")
    return tuple(
        InertialExplorerPart(file.path, file.name, weeks.get(file.name), settings.latency_s) for file in request.files
    )


def open_sbet(request: SensorFiles[Ins]) -> Parts:
    """Return one part for each SBET, then one for each accuracy file (SMRMSG)."""
    files, accuracy_files, settings = request.files, request.accuracy_files, request.settings
    for file in files:
        sbet.check_size(file.path, file.name)
    for file in accuracy_files:
        if (kind := detect.kind_of(file.path, file.name)) is not file_kind.SMRMSG:
            raise RawDataError(
                f"{file.name}: is {kind.title}, not a whole accuracy file (SMRMSG); correct ins.accuracy"
            )
    first_s = {file.name: sbet.first_seconds(file.path, file.name) for file in (*files, *accuracy_files)}
    weeks = gps_weeks(first_s, settings.gps_week, "ins")
    solutions = [sbet.SbetPart(file.path, file.name, weeks[file.name], settings.latency_s) for file in files]
    sigmas = [AccuracyPart(file.path, file.name, weeks[file.name], settings.latency_s) for file in accuracy_files]
    return (*solutions, *sigmas)


# --- laser -----------------------------------------------------------------------------------------------------------
def open_las(request: SensorFiles[Laser]) -> Parts:
    """Return the parts of LAS and LAZ files: stretches of points; files with seconds of week need ``gps_week``."""
    settings = request.settings
    headers = [las.read_header(file.path, file.name, settings.time) for file in request.files]
    for file, header in zip(request.files, headers, strict=True):
        refuse_claim(header.present, header.size, settings.max_records, "laser", file.name)
    without_week = {
        file.name: header for file, header in zip(request.files, headers, strict=True) if not header.adjusted_time
    }
    for name, header in without_week.items():
        refuse_contradiction(np.array([header.first_s]), name, header.adjusted_time, header.told)
    first_s = {name: header.first_s for name, header in without_week.items()}
    weeks = gps_weeks(first_s, settings.gps_week, "laser")
    return tuple(
        part
        for file, header in zip(request.files, headers, strict=True)
        for part in las.parts(
            path=file.path,
            name=file.name,
            header=header,
            gps_week=weeks.get(file.name),
            frame=laser_frame(settings),
            latency_s=settings.latency_s,
        )
    )


def open_e57(request: SensorFiles[Laser]) -> Parts:
    """Return one part for each scan in the E57 files."""
    settings = request.settings
    return tuple(
        part
        for file in request.files
        for part in e57.parts(file.path, file.name, laser_frame(settings), settings.latency_s, settings.max_records)
    )


# --- sonar -----------------------------------------------------------------------------------------------------------
def open_r2sonic(request: SensorFiles[Mbes]) -> Parts:
    """Return one part for each file with R2Sonic packets: bare, HYPACK .R2S or XTF."""
    return tuple(
        R2sonicPart(
            path=file.path,
            name=file.name,
            xtf=detect.kind_of(file.path, file.name) is file_kind.XTF,
            latency_s=request.settings.latency_s,
        )
        for file in request.files
    )


def open_gsf(request: SensorFiles[Mbes]) -> Parts:
    """Return one part for each GSF file."""
    settings = request.settings
    return tuple(GsfPart(file.path, file.name, settings.sound_speed_m_s, settings.latency_s) for file in request.files)


def open_kmall(request: SensorFiles[Mbes]) -> Parts:
    """Return one part for each Kongsberg .kmall file."""
    settings = request.settings
    return tuple(
        KmallPart(file.path, file.name, settings.latency_s, settings.projector_offset_m) for file in request.files
    )


def open_kongsberg_all(request: SensorFiles[Mbes]) -> Parts:
    """Return one part for each Kongsberg .all file."""
    settings = request.settings
    return tuple(
        AllPart(file.path, file.name, settings.latency_s, settings.projector_offset_m) for file in request.files
    )
