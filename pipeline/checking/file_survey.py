"""Every file of a session looked into: what it is, when it begins and ends, how fast it runs, samples of its rows."""

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
from pipeline.checking.excerpts import excerpt, stretches
from pipeline.config.instruments import Sensor
from pipeline.config.session import Ins, SessionConfig
from pipeline.errors import ConfigError, RawDataError
from pipeline.gps_time import NS
from pipeline.readers import detect
from pipeline.readers.dispatch import SensorSettings, raw_files, raw_parts
from pipeline.readers.file_summaries import thin_sigmas
from pipeline.readers.las import LasPart
from pipeline.readers.rates import rate_hz
from pipeline.readers.smrmsg import SmrmsgPart

Columns = dict[str, NDArray[Any]]
Times = NDArray[np.int64]
SENSORS: tuple[Sensor, ...] = ("ins", "laser", "mbes")
MOST_ROWS = 12_000_000  # read of the files of a sensor that cannot be cut
KEPT = 200_000  # rows kept of a file of points or soundings
TICK_NS = NS // 20  # of the laser's times one in each such interval is kept


@dataclass(frozen=True)
class Seen:
    """One file. ``share``: how much of it was read, ``places``: in how many evenly spread ones; ``ended``: its end was
    among that; ``epochs_ns``: times of records or pings, of a laser one a tick; ``columns``: sampled rows, of an INS
    all; ``states``: of each of these what its log says of it; ``sigmas``: what the INS says of its accuracy, thinned;
    ``complaint``: why it could not be read."""

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
        return int(self.epochs_ns[0]), int(self.epochs_ns[-1])

    @property
    def rate_hz(self) -> float:
        """Records of the INS, pings, points."""
        return rate_hz(self.sensor, self.epochs_ns, self.records)

    @property
    def coarseness_ns(self) -> float:
        """A longer time without an epoch is a hole, not one between two places that were read."""
        if self.places < 2 or len(self.epochs_ns) < 2:
            return 0.0
        return 3 * float(self.epochs_ns[-1] - self.epochs_ns[0]) / (self.places - 1)


def survey(session: SessionConfig, folder: Path) -> tuple[list[Seen], list[str]]:
    """All files, those that cannot be read with their refusal; and what is wrong with the lists themselves."""
    found: list[Seen] = []
    wrong: list[str] = []
    with temporary_folder() as place:
        for sensor in SENSORS:
            settings: SensorSettings | None = getattr(session, sensor)
            if settings is None:
                continue
            names, complaints = _listed(settings, folder)
            wrong += complaints
            for name, parts in _parts(sensor, settings, folder, names):
                found.append(_look(sensor, settings, folder, name, parts, len(names), place))
    if session.ins.accuracy:
        found, wrong = _with_accuracy(found, wrong, session.ins, folder)
    return found, wrong


def _with_accuracy(
    found: Sequence[Seen], wrong: Sequence[str], ins: Ins, folder: Path
) -> tuple[list[Seen], list[str]]:
    """The first good file of the INS has what its accuracy files say; those that cannot be read, with their refusal."""
    good = next((k for k, seen in enumerate(found) if seen.sensor == "ins" and not seen.complaint), None)
    if good is None:
        return list(found), list(wrong)
    try:
        alone = ins.model_copy(update={"files": [_escaped(found[good].name)]})
        parts = [part for part in raw_parts("ins", alone, folder) if isinstance(part, SmrmsgPart)]
        told = [thin_sigmas(chunk.sigmas) for part in parts for chunk in part.chunks()]
    except (RawDataError, ConfigError) as error:
        return list(found), [*wrong, str(error)]
    sigmas = _joined([one for one in told if one])
    return [replace(seen, sigmas=sigmas) if k == good else seen for k, seen in enumerate(found)], list(wrong)


def _listed(settings: SensorSettings, folder: Path) -> tuple[list[str], list[str]]:
    """Names of the files that the patterns match, and of patterns that match none the refusals."""
    names: list[str] = []
    wrong = []
    for pattern in settings.files:
        try:
            alone = settings.model_copy(update={"files": [pattern]} | _without_accuracy(settings))
            names += [path.relative_to(folder).as_posix() for path in raw_files(alone, folder)]
        except RawDataError as error:
            wrong.append(str(error))
    return sorted(dict.fromkeys(names)), wrong


def _without_accuracy(settings: SensorSettings) -> dict[str, Any]:
    return {"accuracy": []} if isinstance(settings, Ins) else {}


def _parts(
    sensor: Sensor, settings: SensorSettings, folder: Path, names: Sequence[str]
) -> Iterator[tuple[str, Sequence[Part] | RawDataError]]:
    """By file its parts, or why there are none. All files together where that goes: weeks follow from the first one."""
    without = _without_accuracy(settings)

    def parts_of(some: Sequence[str]) -> tuple[Part, ...]:
        escaped = [_escaped(name) for name in some]
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


def _escaped(name: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


def _look(
    sensor: Sensor, settings: SensorSettings, folder: Path, name: str, parts: Sequence[Part] | RawDataError, files: int,
    place: Path,
) -> Seen:
    path = folder / name
    try:
        seen = Seen(sensor, name, path.stat().st_size)
    except OSError as error:
        return Seen(sensor, name, 0, complaint=f"{name}: cannot be read ({error.strerror}); was it moved meanwhile?")
    if isinstance(parts, RawDataError):
        with suppress(RawDataError, OSError):
            seen = replace(seen, kind=detect.kind_of(path, name).title)
        return replace(seen, complaint=str(parts))
    try:
        seen = replace(seen, kind=detect.kind_of(path, name).title)
        las = [part for part in parts if isinstance(part, LasPart)]
        if las:
            some, share = stretches(las, files)
            total = sum(part.stop - part.start for part in las)
            read = _read(seen, some, files)
            return read if share == 1.0 else replace(read, share=share, places=len(some), records=total)
        copy, share, places = excerpt(path, name, sensor, settings, files, place)
        if copy == path:
            return _read(seen, parts, files)
        read = _read(seen, [_over(part, copy) for part in parts], files)
        copy.unlink()
        return replace(read, share=share, places=places, records=round(read.records / share))
    except (RawDataError, ConfigError) as error:
        return replace(seen, complaint=str(error))


def _path_of(part: Part) -> Path | None:
    return getattr(part, "path", None)


def _over(part: Part, path: Path) -> Part:
    moved: Part = replace(part, path=path)  # type: ignore[type-var]  # every part of a raw file is a dataclass with one
    return moved


def _read(seen: Seen, parts: Sequence[Part], files: int) -> Seen:
    """The rows of some parts of one of so many files: counted, and thinned until few enough remain."""
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
            epochs.append(np.unique(t_ns if seen.sensor != "laser" else t_ns // TICK_NS * TICK_NS))
            while seen.sensor != "ins" and records / one_in > KEPT:
                one_in *= 2
            kept.append(dict(sample_rows(chunk.columns, one_in)))
            states += [dict(chunk.states)] if chunk.states else []
    times = np.unique(np.concatenate(epochs)) if epochs else np.empty(0, np.int64)
    columns = dict(sample_rows(_joined(kept), one_in)) if kept else {}
    return replace(
        seen,
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
