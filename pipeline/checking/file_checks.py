"""Questions to the files by themselves: can they be read, do they hold what they should, is one there twice."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_survey import SENSORS, Seen
from pipeline.checking.findings import Finding
from pipeline.config.session import SessionConfig
from pipeline.gps_time import utc_text
from pipeline.maths.geometry.geodesy import ecef_from_geodetic
from pipeline.report.cast_checks import cast_origin_warnings

SLOWEST_HZ = 49.0  # of an INS: 50 Hz, but for its clock
TWICE = 0.5  # of a file's time in another one: recorded twice
CUT = ("truncated", "truncated message", "truncated packet", "truncated record", "truncated datagram")
FAR_M = 10_000.0  # from a scanner: coordinates of a CRS
SPEEDS_M_S = (1400.0, 1560.0)
DIFFERENT_M_S = 5.0
FAR_ARM_M = 5.0  # of a bracket that is rigid to millimetres
NAMES = ("latitude_rad", "longitude_rad", "height_m")


def unreadable(files: Sequence[Seen], wrong: Sequence[str]) -> Iterator[Finding]:
    """Lists that name nothing, files that a reader refuses, that are cut off, or hold nothing of use."""
    for words in wrong:
        yield Finding("files", words)
    for seen in files:
        if seen.complaint:
            yield Finding("file", seen.complaint)
            continue
        cut = {reason: seen.dropped[reason] for reason in CUT if seen.dropped[reason]}
        if cut and (seen.share == 1.0 or "truncated" in cut):  # pieces of a log end within a record
            lost = ", ".join(f"{number} x {reason}" for reason, number in cut.items())
            words = f"{seen.name}: ends in the middle of a record ({lost}); copy it again, unless it was logged so"
            yield Finding("cut off", words, "look" if sum(cut.values()) == 1 and "truncated" not in cut else "fault")
        if not seen.records:
            why = ", ".join(f"{n} x {reason}" for reason, n in sorted(seen.dropped.items()) if n) or "it is empty"
            words = f"{seen.name}: no usable {seen.sensor} record ({why}); log or export it again"
            aligning = any(reason.startswith("ins status") for reason in seen.dropped)
            others = any(other.records for other in files if other.sensor == seen.sensor)
            yield Finding("no records", words, "look" if aligning and others else "fault")


def twice(files: Sequence[Seen]) -> Iterator[Finding]:
    """Files of one sensor that hold the same time."""
    for one, other in _overlapping([seen for seen in files if len(seen.epochs_ns) > 1]):
        first = max(one.span_ns[0], other.span_ns[0])
        common = np.count_nonzero(np.isin(one.epochs_ns, other.epochs_ns, assume_unique=True))
        share = float(common / min(len(one.epochs_ns), len(other.epochs_ns)))
        if share < TWICE:
            continue
        same = one.records == other.records and len(one.epochs_ns) == len(other.epochs_ns) == common
        what = "is the same recording" if same else f"has {share:.0%} of its times in common"
        what += f" as {one.name}" if same else f" with {one.name}"
        advice = f"take one of them out of {one.sensor}.files, unless they are parts of one scan"
        tiles = one.sensor == "laser" and not same
        words = f"{other.name}: {what}, from {utc_text(first)}; {advice}"
        yield Finding("twice", words, "look" if tiles else "fault")


def _overlapping(files: Sequence[Seen]) -> Iterator[tuple[Seen, Seen]]:
    """Pairs of one sensor whose times overlap, each in the order of the list. Of many files few do."""
    order = {id(seen): k for k, seen in enumerate(files)}
    running: list[Seen] = []
    for seen in sorted(files, key=lambda seen: (seen.sensor, seen.span_ns[0])):
        start, end = seen.span_ns
        running = [one for one in running if one.sensor == seen.sensor and one.span_ns[1] > start]
        for one in running if end > start else ():
            first, second = sorted((one, seen), key=lambda seen: order[id(seen)])
            yield first, second
        running.append(seen)


def ins_rate(files: Sequence[Seen]) -> Iterator[Finding]:
    for seen in files:
        if seen.sensor == "ins" and seen.rate_hz < SLOWEST_HZ:
            yield Finding(
                "ins rate",
                f"{seen.name}: the INS was logged at {seen.rate_hz:.1f} Hz, which is too slow for a boat that rolls; "
                "log it at 100 Hz or more",
            )


def alignment(files: Sequence[Seen]) -> Iterator[Finding]:
    """An INS without a solution for most of its log."""
    of_ins = [seen for seen in files if seen.sensor == "ins" and seen.records]
    dropped = sum((seen.dropped for seen in of_ins), Counter[str]())
    bad = {reason: number for reason, number in dropped.items() if reason.startswith("ins status")}
    used = sum(round(seen.records * seen.share) for seen in of_ins)
    if sum(bad.values()) > used:
        why = ", ".join(f"{number} x {reason.removeprefix('ins status ')}" for reason, number in sorted(bad.items()))
        yield Finding(
            "alignment",
            f"{of_ins[0].name}: the INS has no solution in most of its records ({why}; {used} are usable); "
            "let it align before the first pass",
        )


def frames(files: Sequence[Seen], session: SessionConfig) -> Iterator[Finding]:
    """Points in a CRS that are declared as the scanner's own, and the reverse."""
    for seen in files:
        if seen.sensor != "laser" or not len(seen.columns.get("x_m", ())):
            continue
        away = float(np.median(np.sqrt(sum(seen.columns[axis] ** 2 for axis in ("x_m", "y_m", "z_m")))))
        if session.laser.frame == "laser" and away > FAR_M:
            yield Finding(
                "frame",
                f"{seen.name}: its points lie {away:.4g} m from their origin, but laser.frame is laser: they are "
                "georeferenced, or in mm; write their CRS into laser.frame, or export them in the scanner's own frame",
            )
        elif session.laser.frame == "EPSG:4978" and away < FAR_M:
            yield Finding(
                "frame",
                f"{seen.name}: its points lie {away:.4g} m from their origin, but laser.frame is EPSG:4978 (from the "
                "earth's centre): write laser.frame: laser if they are in the scanner's own frame",
            )
        elif session.laser.frame != "laser":
            yield from _elsewhere(seen, files, session.laser.frame)


def _elsewhere(laser: Seen, files: Sequence[Seen], frame: str) -> Iterator[Finding]:
    """Points of a CRS, which are in ECEF by now, far from every place where the boat was: the zone may be another."""
    of_ins = [seen.columns for seen in files if seen.sensor == "ins" and seen.records]
    if not of_ins:
        return
    track = ecef_from_geodetic(*(np.concatenate([one[name] for one in of_ins]) for name in NAMES))
    points = np.median(np.column_stack([laser.columns[axis] for axis in ("x_m", "y_m", "z_m")]), axis=0)
    away = float(np.min(np.linalg.norm(track - points, axis=1)))
    if away > FAR_M:
        yield Finding(
            "frame",
            f"{laser.name}: its points lie {away / 1000:.3g} km from the INS's track with laser.frame {frame}: another "
            "zone, or interchanged axes? Write the CRS that they were exported in",
        )


def far_arms(session: SessionConfig) -> Iterator[Finding]:
    """Lever arms as long as a boat: they may be in another unit."""
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


def sound_speed(files: Sequence[Seen], session: SessionConfig) -> Iterator[Finding]:
    """Recorded sound speeds that no pool has, that differ from file to file, or that look like a default."""
    if session.mbes is None:
        return
    speeds = {seen.name: seen.columns["sound_speed_m_s"] for seen in files if seen.sensor == "mbes" and seen.columns}
    medians = {name: float(np.median(values)) for name, values in speeds.items() if len(values)}
    low, high = SPEEDS_M_S
    recorded = session.mbes.sound_speed_m_s is None and session.mbes.svp is None  # what is recorded is used
    for name, speed in medians.items():
        if not low <= speed <= high and recorded:
            yield Finding(
                "sound speed",
                f"{name}: the sonar worked with a sound speed of {speed:.1f} m/s, outside {low:.0f} to {high:.0f}: "
                "give the measured one as mbes.sound_speed_m_s",
            )
    if recorded:
        yield from _differing(medians)
    cast = session.mbes.svp
    if cast is not None and session.mbes.sound_speed_m_s is None and medians:
        measured = float(np.median([speed for _, speed in cast]))
        worked = float(np.median(list(medians.values())))
        if abs(measured - worked) > DIFFERENT_M_S:
            yield Finding(
                "sound speed",
                f"mbes: the sonar worked with {worked:.1f} m/s, the cast in mbes.svp has {measured:.1f} m/s: see that "
                "it is this day's cast",
                "look",
            )


def cast(files: Sequence[Seen], session: SessionConfig) -> Iterator[Finding]:
    """A cast's file of another day, or of another place."""
    if session.mbes is None or session.mbes.svp_from is None:
        return
    times = [seen.span_ns for seen in files if seen.sensor == "mbes" and len(seen.epochs_ns)]
    span = (min(first for first, _ in times), max(last for _, last in times)) if times else None
    ins = next((seen.columns for seen in files if seen.sensor == "ins" and seen.columns), None)
    place = None if ins is None else (_degrees(ins["latitude_rad"]), _degrees(ins["longitude_rad"]))
    for warning in cast_origin_warnings(session.mbes.svp_from, span, place):
        yield Finding("sound speed", warning.words, "look")


def _degrees(angles_rad: NDArray[np.float64]) -> float:
    return float(np.degrees(np.median(angles_rad)))


def _differing(medians: Mapping[str, float]) -> Iterator[Finding]:
    if medians and max(medians.values()) - min(medians.values()) > DIFFERENT_M_S:
        slow, fast = min(medians, key=lambda name: medians[name]), max(medians, key=lambda name: medians[name])
        yield Finding(
            "sound speed",
            f"{fast}: sound speed {medians[fast]:.1f} m/s, but {medians[slow]:.1f} m/s in {slow}: one water has one "
            "sound speed; give the measured one as mbes.sound_speed_m_s",
        )


def missing_sensors(files: Sequence[Seen], session: SessionConfig) -> Iterator[Finding]:
    """A sensor of which no file at all can be used."""
    for sensor in SENSORS:
        if getattr(session, sensor) is not None and not any(s.records for s in files if s.sensor == sensor):
            yield Finding("no records", f"{sensor}: has no file that can be used; correct {sensor}.files or the files")

