"""Checks of the files and settings without the target: files are readable, complete and no copies, values plausible."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_survey import SENSORS, SurveyedFile
from pipeline.checking.findings import Finding
from pipeline.config.session import Mbes, SessionConfig
from pipeline.gps_time import utc_text
from pipeline.maths.geometry.geodesy import ecef_from_geodetic
from pipeline.readers.file_summaries import different_milliseconds, times_of_reception
from pipeline.report.cast_checks import cast_origin_warnings

SLOWEST_HZ = 49.0  # slowest rate of an INS: 50 Hz, less an allowance for its clock
TWICE = 0.5  # share of a file's times that are in another file too: recorded twice
CUT = ("truncated", "truncated message", "truncated packet", "truncated record", "truncated datagram")
FAR_M = 10_000.0  # points farther from a scanner have coordinates in a CRS
SPEEDS_M_S = (1400.0, 1560.0)
DIFFERENT_M_S = 5.0
FAR_ARM_M = 5.0  # longest lever arm on a bracket that is rigid to millimetres
GEODETIC = ("latitude_rad", "longitude_rad", "height_m")


def unreadable_files(files: Sequence[SurveyedFile], list_faults: Sequence[str]) -> Iterator[Finding]:
    """Yield findings for faults in the lists of files, and for files refused, cut off or without usable records."""
    for words in list_faults:
        yield Finding("files", words)
    for file in files:
        if file.complaint:
            yield Finding("file", file.complaint)
            continue
        cut = {reason: file.dropped[reason] for reason in CUT if file.dropped[reason]}
        if cut and (file.share == 1.0 or "truncated" in cut):  # a piece of a log may end within a record
            lost = ", ".join(f"{number} x {reason}" for reason, number in cut.items())
            words = f"{file.name}: ends in the middle of a record ({lost}); copy it again, unless it was logged so"
            yield Finding("cut off", words, "look" if sum(cut.values()) == 1 and "truncated" not in cut else "fault")
        if not file.records:
            why = ", ".join(f"{n} x {reason}" for reason, n in sorted(file.dropped.items()) if n) or "it is empty"
            words = f"{file.name}: no usable {file.sensor} record ({why}); log or export it again"
            aligning = any(reason.startswith("ins status") for reason in file.dropped)
            others = any(other.records for other in files if other.sensor == file.sensor)
            yield Finding("no records", words, "look" if aligning and others else "fault")


def duplicate_files(files: Sequence[SurveyedFile]) -> Iterator[Finding]:
    """Yield a finding for each pair of files of a sensor with half or more of one file's times in common."""
    for first, second in _overlapping([file for file in files if len(file.epochs_ns) > 1]):
        start_ns = max(first.span_ns[0], second.span_ns[0])
        common = np.count_nonzero(np.isin(first.epochs_ns, second.epochs_ns, assume_unique=True))
        share = float(common / min(len(first.epochs_ns), len(second.epochs_ns)))
        if share < TWICE:
            continue
        same = first.records == second.records and len(first.epochs_ns) == len(second.epochs_ns) == common
        what = "is the same recording" if same else f"has {share:.0%} of its times in common"
        what += f" as {first.name}" if same else f" with {first.name}"
        advice = f"take one of them out of {first.sensor}.files, unless they are parts of one scan"
        tiles = first.sensor == "laser" and not same
        words = f"{second.name}: {what}, from {utc_text(start_ns)}; {advice}"
        yield Finding("twice", words, "look" if tiles else "fault")


def _overlapping(files: Sequence[SurveyedFile]) -> Iterator[tuple[SurveyedFile, SurveyedFile]]:
    """Yield each pair of files of one sensor whose times overlap, the pair in the order of ``files``.

    Each file is compared only with the files that still run when it begins, because few of many files overlap.
    """
    order = {id(file): k for k, file in enumerate(files)}
    running: list[SurveyedFile] = []
    for later in sorted(files, key=lambda file: (file.sensor, file.span_ns[0])):
        start, end = later.span_ns
        running = [file for file in running if file.sensor == later.sensor and file.span_ns[1] > start]
        for earlier in running if end > start else ():
            first, second = sorted((earlier, later), key=lambda file: order[id(file)])
            yield first, second
        running.append(later)


def slow_ins_logs(files: Sequence[SurveyedFile]) -> Iterator[Finding]:
    """Yield a finding for each log of the INS that is too slow for a boat that rolls."""
    for file in files:
        if file.sensor == "ins" and file.rate_hz < SLOWEST_HZ:
            yield Finding(
                "ins rate",
                f"{file.name}: the INS was logged at {file.rate_hz:.1f} Hz, which is too slow for a boat that rolls; "
                "log it at 100 Hz or more",
            )


def unaligned_ins(files: Sequence[SurveyedFile]) -> Iterator[Finding]:
    """Yield a finding if the INS has no solution in most of its records."""
    of_ins = [file for file in files if file.sensor == "ins" and file.records]
    dropped = sum((file.dropped for file in of_ins), Counter[str]())
    bad = {reason: number for reason, number in dropped.items() if reason.startswith("ins status")}
    used = sum(round(file.records * file.share) for file in of_ins)
    if sum(bad.values()) > used:
        why = ", ".join(f"{number} x {reason.removeprefix('ins status ')}" for reason, number in sorted(bad.items()))
        yield Finding(
            "alignment",
            f"{of_ins[0].name}: the INS has no solution in most of its records ({why}; {used} are usable); "
            "let it align before the first pass",
        )


def wrong_frames(files: Sequence[SurveyedFile], session: SessionConfig) -> Iterator[Finding]:
    """Yield a finding for each laser file whose coordinates contradict ``laser.frame``."""
    for file in files:
        if file.sensor != "laser" or not len(file.columns.get("x_m", ())):
            continue
        away = float(np.median(np.sqrt(sum(file.columns[axis] ** 2 for axis in ("x_m", "y_m", "z_m")))))
        if session.laser.frame == "laser" and away > FAR_M:
            yield Finding(
                "frame",
                f"{file.name}: its points lie {away:.4g} m from their origin, but laser.frame is laser: they are "
                "georeferenced, or in mm; write their CRS into laser.frame, or export them in the scanner's own frame",
            )
        elif session.laser.frame == "EPSG:4978" and away < FAR_M:
            yield Finding(
                "frame",
                f"{file.name}: its points lie {away:.4g} m from their origin, but laser.frame is EPSG:4978 (from the "
                "earth's centre): write laser.frame: laser if they are in the scanner's own frame",
            )
        elif session.laser.frame != "laser":
            yield from _elsewhere(file, files, session.laser.frame)


def _elsewhere(laser: SurveyedFile, files: Sequence[SurveyedFile], frame: str) -> Iterator[Finding]:
    """Yield a finding if georeferenced points, already in ECEF, lie far from the whole track, as in another zone."""
    of_ins = [file.columns for file in files if file.sensor == "ins" and file.records]
    if not of_ins:
        return
    track = ecef_from_geodetic(*(np.concatenate([columns[name] for columns in of_ins]) for name in GEODETIC))
    points = np.median(np.column_stack([laser.columns[axis] for axis in ("x_m", "y_m", "z_m")]), axis=0)
    away = float(np.min(np.linalg.norm(track - points, axis=1)))
    if away > FAR_M:
        yield Finding(
            "frame",
            f"{laser.name}: its points lie {away / 1000:.3g} km from the INS's track with laser.frame {frame}: another "
            "zone, or interchanged axes? Write the CRS that they were exported in",
        )


def long_lever_arms(session: SessionConfig) -> Iterator[Finding]:
    """Yield a finding for each lever-arm component as long as a boat: it may be in another unit."""
    for sensor in ("laser", "mbes"):
        settings = getattr(session, sensor)
        for key in ("x_m", "y_m", "z_m") if settings is not None else ():
            value = getattr(settings.mount, key)
            if abs(value) > FAR_ARM_M:
                yield Finding(
                    "lever arm",
                    f"{sensor}: {sensor}.mount.{key} = {value:g} is {abs(value):g} m from the INS: is it in cm "
                    f"({value / 100:g} m)?",
                    "look",
                )


def soundings_by_reception(files: Sequence[SurveyedFile]) -> Iterator[Finding]:
    """Yield a finding for each file whose soundings do not have their ping's time of transmission."""
    for file in files:
        if file.sensor == "mbes" and file.columns:
            counts = different_milliseconds(file.columns["t_ns"], file.columns["two_way_time_s"])
            if words := times_of_reception(file.name, [counts]):
                yield Finding("stamps", words)


def doubtful_sound_speeds(files: Sequence[SurveyedFile], mbes: Mbes) -> Iterator[Finding]:
    """Yield findings for recorded sound speeds that no pool has, or that differ between files or from a cast."""
    speeds = {file.name: file.columns["sound_speed_m_s"] for file in files if file.sensor == "mbes" and file.columns}
    medians = {name: float(np.median(values)) for name, values in speeds.items() if len(values)}
    low, high = SPEEDS_M_S
    recorded = mbes.sound_speed_m_s is None and mbes.svp is None  # the recorded speed is used
    for name, speed in medians.items():
        if not low <= speed <= high and recorded:
            yield Finding(
                "sound speed",
                f"{name}: the sonar worked with a sound speed of {speed:.1f} m/s, outside {low:.0f} to {high:.0f}: "
                "give the measured one as mbes.sound_speed_m_s",
            )
    if recorded:
        yield from _differing(medians)
    cast = mbes.svp
    if cast is not None and mbes.sound_speed_m_s is None and medians:
        measured = float(np.median([speed for _, speed in cast]))
        worked = float(np.median(list(medians.values())))
        if abs(measured - worked) > DIFFERENT_M_S:
            yield Finding(
                "sound speed",
                f"mbes: the sonar worked with {worked:.1f} m/s, the cast in mbes.svp has {measured:.1f} m/s: see that "
                "it is this day's cast",
                "look",
            )


def doubtful_cast(files: Sequence[SurveyedFile], mbes: Mbes) -> Iterator[Finding]:
    """Yield findings if the cast's file is of another time or place than the session."""
    if mbes.svp_from is None:
        return
    times = [file.span_ns for file in files if file.sensor == "mbes" and len(file.epochs_ns)]
    span = (min(first for first, _ in times), max(last for _, last in times)) if times else None
    ins = next((file.columns for file in files if file.sensor == "ins" and file.columns), None)
    place = None if ins is None else (_degrees(ins["latitude_rad"]), _degrees(ins["longitude_rad"]))
    for warning in cast_origin_warnings(mbes.svp_from, span, place):
        yield Finding("sound speed", warning.words, "look")


def _degrees(angles_rad: NDArray[np.float64]) -> float:
    return float(np.degrees(np.median(angles_rad)))


def _differing(medians: Mapping[str, float]) -> Iterator[Finding]:
    """Yield a finding if sound speeds differ between files; ``medians``: the median by file, m/s."""
    if medians and max(medians.values()) - min(medians.values()) > DIFFERENT_M_S:
        slow, fast = min(medians, key=lambda name: medians[name]), max(medians, key=lambda name: medians[name])
        yield Finding(
            "sound speed",
            f"{fast}: sound speed {medians[fast]:.1f} m/s, but {medians[slow]:.1f} m/s in {slow}: one water has one "
            "sound speed; give the measured one as mbes.sound_speed_m_s",
        )


def sensors_without_records(files: Sequence[SurveyedFile], session: SessionConfig) -> Iterator[Finding]:
    """Yield a finding for each sensor without a usable file."""
    for sensor in SENSORS:
        if getattr(session, sensor) is not None and not any(file.records for file in files if file.sensor == sensor):
            yield Finding("no records", f"{sensor}: has no file that can be used; correct {sensor}.files or the files")

