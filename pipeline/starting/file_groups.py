"""The files of one sensor that are of one kind: their survey, their GPS week, the instrument that they name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.checking.file_survey import SurveyedFile, survey_sensor
from pipeline.config.instruments import Sensor
from pipeline.config.mount import Mount
from pipeline.config.session import Ins, Laser, Mbes
from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import WEEK_NS
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.readers.dispatch import SensorSettings, raw_parts
from pipeline.readers.file_kind import FileKind
from pipeline.readers.named_instruments import named_instrument
from pipeline.readers.session_files import as_pattern
from pipeline.starting.file_patterns import patterns_for
from pipeline.starting.folder_files import LeftOut

PROVISIONAL_WEEK = 2000  # of files without a week, until it is known
_SPEED_M_S = 1500.0  # with which files without a sound speed are read here; nothing depends on it
_NO_MOUNT = Mount(**dict.fromkeys(SETTINGS, 0.0))
_BLOCKS: Mapping[Sensor, type[Ins | Laser | Mbes]] = {"ins": Ins, "laser": Laser, "mbes": Mbes}


@dataclass(frozen=True)
class FileGroup:
    """Files of one sensor and one kind that can be read.

    Attributes
    ----------
    sensor, kind
        The sensor, and the kind of the files.
    files : tuple of SurveyedFile
        The files, in order of their names.
    patterns : tuple of str
        Patterns of session.yaml that match these files alone.
    undated : frozenset of str
        Names of files that have seconds of the week without the week.
    gps_week : int or None
        The week in which the first file begins; None: it is not needed, or not known.
    lacks_speed : bool
        Whether the files lack the sound speed.
    instrument : str
        The instrument that every file names; empty without one.
    """

    sensor: Sensor
    kind: FileKind
    files: tuple[SurveyedFile, ...]
    patterns: tuple[str, ...]
    undated: frozenset[str] = frozenset()
    gps_week: int | None = None
    lacks_speed: bool = False
    instrument: str = ""

    @property
    def span_ns(self) -> tuple[int, int] | None:
        """Times of the first and the last record; None if they are not known."""
        if self.undated and self.gps_week is None:
            return None
        return min(file.span_ns[0] for file in self.files), max(file.span_ns[1] for file in self.files)

    def in_week(self, week: int) -> "FileGroup":
        """Return the group with the week in which its first file begins, and its times in it."""
        later_ns = (week - PROVISIONAL_WEEK) * WEEK_NS
        files = (
            replace(file, epochs_ns=file.epochs_ns + later_ns) if file.name in self.undated else file
            for file in self.files
        )
        return replace(self, gps_week=week, files=tuple(files))


def survey_group(
    sensor: Sensor, kind: FileKind, names: Sequence[str], folder: Path, copies: Path
) -> tuple[FileGroup | None, list[LeftOut]]:
    """Return the files of one kind that can be read, None if there are none; and those that cannot, with the reason.

    Parameters
    ----------
    sensor, kind
        The sensor and the kind.
    names
        The files.
    folder
        The session folder.
    copies
        A folder for short copies of large files.
    """
    undated = frozenset(name for name in names if _lacks_week(sensor, kind, name, folder))
    settings = _settings(sensor, kind, names, PROVISIONAL_WEEK)
    surveyed, _ = survey_sensor(sensor, settings, folder, copies)
    lacks_speed = any("sound_speed_m_s" in file.complaint for file in surveyed)
    if lacks_speed:
        settings = settings.model_copy(update={"sound_speed_m_s": _SPEED_M_S})
        surveyed, _ = survey_sensor(sensor, settings, folder, copies)
    left_out = [LeftOut(file.name, why) for file in surveyed if (why := _unusable(file))]
    gone = set(names) - {file.name for file in surveyed}
    left_out += [LeftOut(name, "is there no longer; was it moved meanwhile?") for name in gone]
    good = tuple(file for file in surveyed if not _unusable(file))
    if not good:
        return None, left_out
    named = {named_instrument(folder / file.name, file.name, kind) for file in good}
    used = [file.name for file in good]
    return FileGroup(
        sensor=sensor,
        kind=kind,
        files=good,
        patterns=tuple(patterns_for(used, folder)),
        undated=undated.intersection(used),
        lacks_speed=lacks_speed,
        instrument=named.pop() if len(named) == 1 else "",
    ), left_out


def _settings(sensor: Sensor, kind: FileKind, names: Sequence[str], week: int | None) -> SensorSettings:
    block: dict[str, Any] = {"files": [as_pattern(name) for name in names], "format": kind.format}
    block |= {} if sensor == "ins" else {"mount": _NO_MOUNT}
    block |= {} if sensor == "mbes" else {"gps_week": week}
    settings: SensorSettings = _BLOCKS[sensor](**block)
    return settings


def _lacks_week(sensor: Sensor, kind: FileKind, name: str, folder: Path) -> bool:
    """Return whether a file can be opened only with a GPS week in session.yaml."""
    if sensor == "mbes":
        return False
    try:
        raw_parts(sensor, _settings(sensor, kind, [name], None), folder)
    except ConfigError as error:
        return "gps_week" in str(error)
    except RawDataError:
        return False
    return False


def _unusable(file: SurveyedFile) -> str:
    """Return why a file cannot be used; empty if it can."""
    if file.complaint:
        return file.complaint.removeprefix(f"{file.name}: ")
    if file.records:
        return ""
    why = ", ".join(f"{number} x {reason}" for reason, number in sorted(file.dropped.items()) if number)
    return f"no usable {file.sensor} record ({why or 'it is empty'})"
