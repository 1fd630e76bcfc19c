"""The list of the formats that are read, and the function that opens a sensor's files as parts.

``raw_parts`` finds a sensor's files, checks the format of each by its content, and returns their parts. ``chunks()`` of
a part yields batches of canonical columns, with the counts of rows left out, by reason. Canonical columns have the
names and units of the tables and streams of stage ingest (:mod:`pipeline.artefacts`). INS angles are NovAtel's: roll
starboard down +, pitch bow up +, azimuth clockwise from north. A damaged file raises RawDataError or yields fewer rows.
It never raises another exception.

A new format needs four steps:

1. **Read it.** Write ``readers/<format>.py`` with a frozen dataclass that fulfils the protocol
   :class:`pipeline.artefacts.streams.Part`: a ``name``, and ``chunks()``, which yields one
   :class:`~pipeline.artefacts.streams.Chunk` of canonical columns after another. It also has the field ``path``, which
   ``poolcal check`` replaces to read an excerpt of the file. Check the rows with
   :mod:`pipeline.readers.row_checks`. Gather a sonar's pings with :mod:`pipeline.readers.sounding_chunks`.
   :class:`pipeline.readers.sbet.SbetPart` is the shortest example.
2. **Recognise it.** Add a ``FileKind`` with session.yaml's word for the format to :mod:`pipeline.readers.file_kind`,
   and the format's mark or test to :func:`pipeline.readers.detect.kind_of_bytes`.
3. **Open it.** Write the function that opens it in :mod:`pipeline.readers.openers`, and add it to ``FORMATS`` below.
4. **Accept its word.** Add the word to the ``Literal`` of the sensor's ``format`` in :mod:`pipeline.config.session`.

``tests/readers/test_dispatch.py`` fails while the lists of steps 2, 3 and 4 differ.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pipeline.artefacts.streams import Part
from pipeline.config.instruments import Sensor
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.errors import RawDataError
from pipeline.readers import file_kind, openers
from pipeline.readers.crs import frame_transform
from pipeline.readers.detect import kind_of
from pipeline.readers.session_files import SessionFile, files_matching

SensorSettings = Ins | Laser | Mbes  # a sensor's block of session.yaml

FORMATS: Mapping[tuple[Sensor, str], Callable[[openers.SensorFiles[Any]], tuple[Part, ...]]] = {
    ("ins", "novatel"): openers.open_novatel,
    ("ins", "sbet"): openers.open_sbet,
    ("ins", "inertial_explorer"): openers.open_inertial_explorer,
    ("ins", "table"): openers.open_tables,
    ("laser", "las"): openers.open_las,
    ("laser", "e57"): openers.open_e57,
    ("laser", "table"): openers.open_tables,
    ("mbes", "r2sonic"): openers.open_r2sonic,
    ("mbes", "gsf"): openers.open_gsf,
    ("mbes", "kmall"): openers.open_kmall,
    ("mbes", "all"): openers.open_kongsberg_all,
    ("mbes", "table"): openers.open_tables,
}


def raw_files(settings: SensorSettings, folder: Path) -> list[Path]:
    """Return the files that match a sensor's patterns in session.yaml, each once, ordered by their paths in the folder.

    Raises
    ------
    RawDataError
        A pattern matches no file, or a file that lies outside the session folder (through a symbolic link).
    """
    files = {
        *files_matching(folder, settings.files, f"{_sensor_of(settings)}.files"),
        *_accuracy_files(settings, folder),
    }
    return [file.path for file in sorted(files)]


def raw_parts(sensor: Sensor, settings: SensorSettings, folder: Path) -> tuple[Part, ...]:
    """Return the parts of one sensor's files, in the order of the files' names.

    Parameters
    ----------
    sensor
        The sensor.
    settings
        Its block of session.yaml.
    folder
        The session folder.

    Raises
    ------
    RawDataError
        A file cannot be read, or its content is not in the format that session.yaml names.
    ConfigError
        ``gps_week``, ``laser.frame`` or ``laser.heights`` is missing or wrong in session.yaml.
    """
    if isinstance(settings, Laser):
        frame_transform(openers.laser_frame(settings))
    files = files_matching(folder, settings.files, f"{sensor}.files")
    for file in files:
        _refuse_other_format(file, sensor, settings)
    request = openers.SensorFiles(sensor, settings, files, _accuracy_files(settings, folder))
    return FORMATS[sensor, settings.format](request)


def _sensor_of(settings: SensorSettings) -> Sensor:
    if isinstance(settings, Ins):
        return "ins"
    return "laser" if isinstance(settings, Laser) else "mbes"


def _accuracy_files(settings: SensorSettings, folder: Path) -> list[SessionFile]:
    return files_matching(folder, settings.accuracy, "ins.accuracy") if isinstance(settings, Ins) else []


def _refuse_other_format(file: SessionFile, sensor: Sensor, settings: SensorSettings) -> None:
    """Raise RawDataError if the file's content is not of this sensor, or not in the format that session.yaml names."""
    kind = kind_of(file.path, file.name)
    if kind.format == settings.format and sensor in kind.sensors:
        return
    if settings.format == "inertial_explorer" and kind is file_kind.TEXT:
        raise RawDataError(
            f"{file.name}: is a text without Inertial Explorer's column names; export it from Inertial Explorer with "
            "its header ('header' ticked in the export profile)"
        )
    if kind.format is None:
        raise RawDataError(f"{file.name}: is {kind.title}, not {settings.format}; {kind.advice_for(sensor)}")
    if sensor in kind.sensors:
        raise RawDataError(
            f"{file.name}: is {kind.title}, but session.yaml has {sensor}.format: {settings.format}; "
            f"write {sensor}.format: {kind.format}, and keep files of one format in {sensor}.files"
        )
    raise RawDataError(
        f"{file.name}: is {kind.title}, not a file of {sensor} in format {settings.format}; "
        f"list it under {kind.sensors[0]}.files"
    )
