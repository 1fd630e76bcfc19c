"""Functions that open files as parts, one function for each format; :mod:`pipeline.readers.dispatch` lists them."""

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from pipeline.artefacts.streams import Part
from pipeline.config.instruments import Sensor
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.errors import RawDataError
from pipeline.readers import detect, e57, file_kind, las, las_header, sbet
from pipeline.readers.claimed_counts import refuse_claim
from pipeline.readers.crs import LaserFrame
from pipeline.readers.gps_weeks import gps_weeks
from pipeline.readers.gsf import GsfPart
from pipeline.readers.inertial_explorer import InertialExplorerPart
from pipeline.readers.inertial_explorer_layout import read_layout
from pipeline.readers.kmall import KmallPart
from pipeline.readers.kongsberg_all import AllPart
from pipeline.readers.las_times import refuse_wrong_time_type
from pipeline.readers.novatel import NovatelPart
from pipeline.readers.r2sonic import R2sonicPart
from pipeline.readers.session_files import SessionFile
from pipeline.readers.smrmsg import SmrmsgPart
from pipeline.readers.table import TablePart

Parts = tuple[Part, ...]
BlockOfSensor = TypeVar("BlockOfSensor", Ins, Laser, Mbes, Any)


@dataclass(frozen=True)
class SensorFiles(Generic[BlockOfSensor]):
    """One sensor's raw files, in order of their names, and its block of session.yaml."""

    sensor: Sensor
    settings: BlockOfSensor
    files: list[SessionFile]
    accuracy_files: list[SessionFile]  # SMRMSG files, only for an INS


def laser_frame(settings: Laser) -> LaserFrame:
    """Return the frame, or the coordinate reference system, in which the laser's points are stored."""
    return LaserFrame(settings.frame, settings.heights)


# --- all sensors -----------------------------------------------------------------------------------------------------
def open_tables(request: SensorFiles[Any]) -> Parts:
    """Return one part for each Parquet or CSV table."""
    settings = request.settings
    frame = laser_frame(settings) if isinstance(settings, Laser) else LaserFrame()
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
    """Return one part for each export of Inertial Explorer; exports without week or date need ``gps_week``."""
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
    sigmas = [SmrmsgPart(file.path, file.name, weeks[file.name], settings.latency_s) for file in accuracy_files]
    return (*solutions, *sigmas)


# --- laser -----------------------------------------------------------------------------------------------------------
def open_las(request: SensorFiles[Laser]) -> Parts:
    """Return the stretches of LAS and LAZ files as parts; files with seconds of week need ``gps_week``."""
    settings = request.settings
    headers = [las_header.read_header(file.path, file.name, settings.time) for file in request.files]
    for file, header in zip(request.files, headers, strict=True):
        refuse_claim(header.present, header.size, settings.max_records, "laser", file.name)
    without_week = {
        file.name: header for file, header in zip(request.files, headers, strict=True) if not header.adjusted_time
    }
    for name, header in without_week.items():
        refuse_wrong_time_type(np.array([header.first_s]), name, header.adjusted_time, header.declared_time)
    first_s = {name: header.first_s for name, header in without_week.items()}
    weeks = gps_weeks(first_s, settings.gps_week, "laser")
    return tuple(
        part
        for file, header in zip(request.files, headers, strict=True)
        for part in las.las_parts(
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
        for part in e57.e57_parts(file.path, file.name, laser_frame(settings), settings.latency_s, settings.max_records)
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
