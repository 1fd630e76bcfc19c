"""A survey of every file of a session: its kind, its first and last time, its rate, and samples of its rows."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.sampling import sample_rows
from pipeline.artefacts.streams import Part
from pipeline.atomic_files import temporary_folder
from pipeline.checking.excerpts import SurveyedSensor, excerpt, stretches
from pipeline.config.instruments import Sensor
from pipeline.config.session import Ins, SessionConfig
from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import NS
from pipeline.readers import detect
from pipeline.readers.dispatch import SensorSettings, raw_files, raw_parts
from pipeline.readers.file_summaries import thin_sigmas
from pipeline.readers.las import LasPart
from pipeline.readers.rates import rate_hz
from pipeline.readers.session_files import as_pattern
from pipeline.readers.smrmsg import SmrmsgPart

Columns = dict[str, NDArray[Any]]
Times = NDArray[np.int64]
SENSORS: tuple[Sensor, ...] = ("ins", "laser", "mbes")
MOST_ROWS = 12_000_000  # most rows read of a sensor's files together; only files that cannot be cut reach it
KEPT = 200_000  # most rows kept of a file of points or soundings
TICK_NS = NS // 20  # one of the laser's times is kept per 0.05 s


@dataclass(frozen=True)
class SurveyedFile:
    """A file, and a summary of the rows that were read.

    Attributes
    ----------
    sensor, name, size, kind
        The sensor, the name within the session folder, the size in bytes, and the kind of file in words for people.
    share : float
        Share of the file that was read, if it was read at several places; otherwise 1.
    places : int
        Number of evenly spread places at which it was read.
    ended : bool
        Whether its end was read.
    records : int
        Number of INS records, soundings or laser points; estimated if the file was read at several places.
    dropped : Counter[str]
        Number of unusable rows, by reason.
    epochs_ns : ndarray of int64
        Times of INS records or pings, ascending; laser: one per 0.05 s.
    columns : Columns
        Sampled rows of points or soundings; all rows of an INS.
    states : Columns
        State of the INS in each of its rows, by kind of state.
    sigmas : Columns
        The INS's own sigmas, thinned to about one row per half second.
    complaint : str
        Why the file could not be read; empty if it could.
    """

    sensor: Sensor
    name: str
    size: int
    kind: str = "unreadable"
    share: float = 1.0
    places: int = 1
    ended: bool = True
    records: int = 0
    dropped: Counter[str] = field(default_factory=Counter)
    epochs_ns: Times = field(default_factory=lambda: np.empty(0, np.int64))
    columns: Columns = field(default_factory=dict)
    states: Columns = field(default_factory=dict)
    sigmas: Columns = field(default_factory=dict)
    complaint: str = ""

    @property
    def span_ns(self) -> tuple[int, int]:
        """Times of the first and the last record."""
        return int(self.epochs_ns[0]), int(self.epochs_ns[-1])

    @property
    def rate_hz(self) -> float:
        """INS records, pings or laser points per second; NaN if there are too few times."""
        return rate_hz(self.sensor, self.epochs_ns, self.records)

    @property
    def coarseness_ns(self) -> float:
        """Three times the mean time between two places that were read; 0 if the file was read at one place.

        A longer time without a record is a hole in the file.
        """
        if self.places < 2 or len(self.epochs_ns) < 2:
            return 0.0
        return 3 * float(self.epochs_ns[-1] - self.epochs_ns[0]) / (self.places - 1)


def survey_files(session: SessionConfig, folder: Path) -> tuple[list[SurveyedFile], list[str]]:
    """Return the survey of every file, and the faults in the lists of files. Unreadable files carry a complaint."""
    files: list[SurveyedFile] = []
    list_faults: list[str] = []
    with temporary_folder() as copies:
        for sensor in SENSORS:
            settings: SensorSettings | None = getattr(session, sensor)
            if settings is None:
                continue
            surveyed, complaints = survey_sensor(sensor, settings, folder, copies)
            list_faults += complaints
            files += surveyed
    if session.ins.accuracy:
        files, list_faults = _with_accuracy(files, list_faults, session.ins, folder)
    return files, list_faults


def survey_sensor(
    sensor: Sensor, settings: SensorSettings, folder: Path, copies: Path
) -> tuple[list[SurveyedFile], list[str]]:
    """Return the survey of one sensor's files, and the faults in its list of files.

    Parameters
    ----------
    sensor, settings
        The sensor, and its block of session.yaml.
    folder
        The session folder.
    copies
        A folder for short copies of large files.
    """
    names, complaints = _listed(settings, folder)
    sharing = SurveyedSensor(sensor=sensor, settings=settings, folder=folder, number=len(names), copies=copies)
    parts_by_name = _parts(sensor, settings, folder, names)
    return [_survey_file(sharing, name, parts) for name, parts in parts_by_name], complaints


def _with_accuracy(
    files: Sequence[SurveyedFile], list_faults: Sequence[str], ins: Ins, folder: Path
) -> tuple[list[SurveyedFile], list[str]]:
    """Return the files, and the faults of the lists; the first readable INS file gets the sigmas of the accuracy files.

    If an accuracy file cannot be read, its error is added to the faults.
    """
    good = next((k for k, file in enumerate(files) if file.sensor == "ins" and not file.complaint), None)
    if good is None:
        return list(files), list(list_faults)
    try:
        alone = ins.model_copy(update={"files": [as_pattern(files[good].name)]})
        parts = [part for part in raw_parts("ins", alone, folder) if isinstance(part, SmrmsgPart)]
        sigmas_by_chunk = [thin_sigmas(chunk.sigmas) for part in parts for chunk in part.chunks()]
    except (RawDataError, ConfigError) as error:
        return list(files), [*list_faults, str(error)]
    sigmas = _joined([columns for columns in sigmas_by_chunk if columns])
    return [replace(file, sigmas=sigmas) if k == good else file for k, file in enumerate(files)], list(list_faults)


def _listed(settings: SensorSettings, folder: Path) -> tuple[list[str], list[str]]:
    """Return the names of the files that the patterns match, and the errors for patterns that match none."""
    names: list[str] = []
    faults = []
    for pattern in settings.files:
        try:
            alone = settings.model_copy(update={"files": [pattern]} | _without_accuracy(settings))
            names += [path.relative_to(folder).as_posix() for path in raw_files(alone, folder)]
        except RawDataError as error:
            faults.append(str(error))
    return sorted(dict.fromkeys(names)), faults


def _without_accuracy(settings: SensorSettings) -> dict[str, Any]:
    return {"accuracy": []} if isinstance(settings, Ins) else {}


def _parts(
    sensor: Sensor, settings: SensorSettings, folder: Path, names: Sequence[str]
) -> Iterator[tuple[str, Sequence[Part] | RawDataError]]:
    """Yield each file's name, with its parts or with the error that its reader raised.

    The files are opened together if possible, because the GPS weeks of all follow from the first one.
    """
    without = _without_accuracy(settings)

    def parts_of(chosen: Sequence[str]) -> tuple[Part, ...]:
        escaped = [as_pattern(name) for name in chosen]
        return raw_parts(sensor, settings.model_copy(update={"files": escaped} | without), folder)

    good, bad = list(names), dict[str, RawDataError]()
    parts: tuple[Part, ...] = ()
    try:
        parts = parts_of(good) if good else ()
    except RawDataError:
        for name in names:
            try:
                parts_of([name])
            except RawDataError as error:
                bad[name] = error
        good = [name for name in names if name not in bad]
        parts = parts_of(good) if good else ()
    by_path: dict[Path | None, list[Part]] = {}
    for part in parts:
        by_path.setdefault(_path_of(part), []).append(part)
    for name in names:
        yield name, bad[name] if name in bad else by_path.get(folder / name, [])


def _survey_file(sharing: SurveyedSensor, name: str, parts: Sequence[Part] | RawDataError) -> SurveyedFile:
    """Return the survey of a file, read in pieces if it is long; ``parts``: the parts or the error of its reader."""
    path = sharing.folder / name
    try:
        file = SurveyedFile(sharing.sensor, name, path.stat().st_size)
    except OSError as error:
        complaint = f"{name}: cannot be read ({error.strerror}); was it moved meanwhile?"
        return SurveyedFile(sharing.sensor, name, 0, complaint=complaint)
    if isinstance(parts, RawDataError):
        with suppress(RawDataError, OSError):
            file = replace(file, kind=detect.kind_of(path, name).title)
        return replace(file, complaint=str(parts))
    try:
        file = replace(file, kind=detect.kind_of(path, name).title)
        las = [part for part in parts if isinstance(part, LasPart)]
        if las:
            spread, share = stretches(las, sharing.number)
            total = sum(part.stop - part.start for part in las)
            read = _read(file, spread, sharing.number)
            return read if share == 1.0 else replace(read, share=share, places=len(spread), records=total)
        copy = excerpt(path, name, sharing)
        if copy.path == path:
            return _read(file, parts, sharing.number)
        read = _read(file, [_over(part, copy.path) for part in parts], sharing.number)
        copy.path.unlink()
        return replace(read, share=copy.share, places=copy.places, records=round(read.records / copy.share))
    except (RawDataError, ConfigError) as error:
        return replace(file, complaint=str(error))


def _path_of(part: Part) -> Path | None:
    return getattr(part, "path", None)


def _over(part: Part, path: Path) -> Part:
    """Return a copy of ``part`` that reads the file at ``path`` in place of its own."""
    moved: Part = replace(part, path=path)  # type: ignore[type-var]  # each raw file's part is a dataclass with a path
    return moved


def _read(file: SurveyedFile, parts: Sequence[Part], files: int) -> SurveyedFile:
    """Return the file with the counts, times and rows of its parts: of an INS all rows, else about KEPT at most.

    ``files`` is the number of the sensor's files, which share the limit MOST_ROWS.
    """
    epochs: list[Times] = []
    kept: list[Columns] = []
    states: list[Columns] = []
    sigmas: list[Columns] = []
    dropped: Counter[str] = Counter()
    records, ended, one_in = 0, True, 1.0
    for chunk in (chunk for part in parts for chunk in part.chunks()):
        if records >= MOST_ROWS // files:
            ended = False
            break
        dropped.update(chunk.dropped)
        rows = len(chunk.columns["t_ns"]) if chunk.columns else 0
        sigmas += [thin_sigmas(chunk.sigmas)] if chunk.sigmas else []
        records += rows
        if rows:
            t_ns = chunk.columns["t_ns"]
            epochs.append(np.unique(t_ns if file.sensor != "laser" else t_ns // TICK_NS * TICK_NS))
            while file.sensor != "ins" and records / one_in > KEPT:
                one_in *= 2
            kept.append(dict(sample_rows(chunk.columns, one_in)))
            states += [dict(chunk.states)] if chunk.states else []
    times = np.unique(np.concatenate(epochs)) if epochs else np.empty(0, np.int64)
    columns = dict(sample_rows(_joined(kept), one_in)) if kept else {}
    return replace(
        file,
        records=records,
        dropped=dropped,
        epochs_ns=times,
        columns=columns,
        ended=ended,
        states=_joined(states),
        sigmas=_joined(sigmas),
    )


def _joined(pieces: Sequence[Columns]) -> Columns:
    names = pieces[0] if pieces else ()
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in names}
