"""All questions in their order; what would only follow from an earlier finding is not asked."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from pipeline.checking import clocks, file_checks, target_hits, track_checks
from pipeline.checking.expected_soundings import Soundings, missed, soundings
from pipeline.checking.file_survey import SENSORS, Seen, Times, survey
from pipeline.checking.findings import Finding
from pipeline.checking.ins_quality import Quality, quality, told
from pipeline.checking.latency import latencies
from pipeline.checking.point_samples import placeable, rows_of, sample
from pipeline.checking.track import Leg, Track, frame_of, joined, track_of
from pipeline.checking.trial_calibration import Calibrate, Calibrated
from pipeline.checking.trial_findings import other_pose, signs
from pipeline.config.pool import Ingest, PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.gps_time import NS
from pipeline.maths.target.model import TargetModel
from pipeline.target.design import target_of
from pipeline.target.surface import ClosestSurface

ROUGHLY, SAMPLED, FINELY = 4_000, 20_000, 60_000  # rows of a sensor: to hit the target, to calibrate, to count


@dataclass(frozen=True)
class Examined:
    """What is there, and what is wrong with it."""

    files: tuple[Seen, ...]
    legs: tuple[Leg, ...]
    findings: tuple[Finding, ...]
    model: TargetModel | None = None  # with the soundings on its faces, where they were counted
    soundings: Soundings | None = None
    quality: Quality = field(default_factory=Quality)

    @property
    def faulty(self) -> bool:
        return any(finding.severity == "fault" for finding in self.findings)


@dataclass(frozen=True)
class _Given:
    seen: Sequence[Seen]
    session: SessionConfig
    pool: PoolConfig
    model: TargetModel
    calibrate: Calibrate


def examine(
    folder: Path, session: SessionConfig, pool: PoolConfig | None, calibrate: Calibrate
) -> Examined:
    """``pool``: where the target is; without it nothing is asked about the target. ``calibrate``: does so in memory."""
    found = _examined(folder, session, pool, calibrate)
    said = quality(found.files, [leg for leg in found.legs if leg.good])
    return replace(found, quality=said, findings=(*found.findings, *told(said)))


def _examined(
    folder: Path, session: SessionConfig, pool: PoolConfig | None, calibrate: Calibrate
) -> Examined:
    seen, wrong = survey(session, folder)
    findings = list(_of_files(seen, wrong, session))
    epochs = _epochs(seen)
    if "ins" not in epochs:
        return Examined(tuple(seen), (), tuple(findings))
    max_gap_s = (Ingest() if pool is None else pool.ingest).max_gap_s
    coarse = max(s.coarseness_ns for s in seen if s.sensor == "ins")
    weeks = {"ins": session.ins.gps_week, "laser": session.laser.gps_week}
    findings += clocks.apart(epochs, max(round(max_gap_s * NS), round(coarse)), seen, weeks)
    if pool is None:
        return Examined(tuple(seen), (), tuple(findings))
    clocked = {f.words.split(":")[0] for f in findings if f.question == "clock"}
    clocked |= {"laser", "mbes"} if "ins" in clocked else set()
    clocked |= {"laser" for f in findings if f.question == "frame"}
    given = _Given(seen, session, pool, target_of(pool.target), calibrate)
    of_target = _of_target(given, epochs, clocked)
    return replace(of_target, findings=(*findings, *of_target.findings))


def _of_files(seen: Sequence[Seen], wrong: Sequence[str], session: SessionConfig) -> Iterator[Finding]:
    yield from file_checks.unreadable(seen, wrong)
    yield from file_checks.missing_sensors(seen, session)
    yield from file_checks.twice(seen)
    yield from file_checks.ins_rate(seen)
    yield from file_checks.alignment(seen)
    yield from file_checks.frames(seen, session)
    yield from file_checks.far_arms(session)
    yield from file_checks.sound_speed(seen, session)
    yield from file_checks.cast(seen, session)


def _of_target(given: _Given, epochs: dict[str, Times], clocked: set[str]) -> Examined:
    """``clocked``: sensors of which nothing more is asked."""
    seen, pool, model, ins = given.seen, given.pool, given.model, joined(given.seen)
    nothing = Examined(tuple(seen), (), tuple(track_checks.place(ins, pool, model)))
    if nothing.findings:
        return nothing
    frame = frame_of(ins, pool.target_place)
    if frame is None:
        words = "target.azimuth_deg is not given, and the boat never has target.origin within 20 m to starboard"
        return replace(nothing, findings=(Finding("side", f"{words}; give azimuth_deg, or check target.origin"),))
    track = track_of(ins, frame, model, seen, pool.ingest)
    findings = list(track_checks.sailing(track, pool.target_place))
    asked = [sensor for sensor in ("laser", "mbes") if sensor in epochs and sensor not in clocked]
    wrong: list[Finding] = []
    counted = None
    if all(finding.severity == "look" for finding in findings):
        wrong, counted = _of_points(given, track, asked)
    findings += wrong
    if not clocked and not any(finding.question == "clock" for finding in wrong):
        findings += track_checks.missing(track, seen)
        coarse = max(s.coarseness_ns for s in seen if s.sensor == "ins")
        sounded = {sensor: t_ns for sensor, t_ns in epochs.items() if sensor != "ins"}
        findings += track_checks.holes(track, sounded, pool.georeference.max_ins_interval_s, coarse)
    return Examined(tuple(seen), track.legs, tuple(findings), model, counted)


def _of_points(given: _Given, track: Track, asked: Sequence[str]) -> tuple[list[Finding], Soundings | None]:
    """Where the points fall; of sensors whose points miss the target nothing finer is asked."""
    seen, session, pool, model = given.seen, given.session, given.pool, given.model
    few = [sample(seen, session, sensor, track, ROUGHLY) for sensor in asked]
    found = list(target_hits.off_target(track, [one for one in few if one is not None], ClosestSurface(model), pool))
    some = sample(seen, session, "mbes", track, FINELY) if "mbes" in asked and not found else None
    if some is None:
        return found, None
    some = some.placeable(track)
    raw = {sensor: placeable(rows_of(seen, sensor, SAMPLED), track) for sensor in ("laser", "mbes")}
    raw["ins"] = joined(seen)
    tried = given.calibrate(session, pool, raw) if "laser" in asked else Calibrated()
    found = list(_of_trial(given, track, tried))
    if any(finding.severity == "fault" for finding in found):
        return found, None
    counted = soundings(track, some, tried.soundings, len(raw["mbes"]["t_ns"]), seen, model, pool, session)
    found += missed(model, counted) if counted is not None else []
    found += latencies(tried.freed) if tried.freed is not None else []
    return found, counted


def _of_trial(given: _Given, track: Track, tried: Calibrated) -> Iterator[Finding]:
    """Whether the target stands, and the sonar is mounted, as the settings say."""
    laser = sample(given.seen, given.session, "laser", track, SAMPLED)
    if laser is not None and tried.target_pose is not None:
        yield from other_pose(track, laser, tried.target_pose, given.model, given.pool)
    if tried.provisional_mount is not None:
        mount = given.session.sonar.mount
        yield from signs(mount, tried.provisional_mount, given.model, given.pool.segment.search_mount_deg)


def _epochs(seen: Sequence[Seen]) -> dict[str, Times]:
    found: dict[str, Times] = {}
    for sensor in SENSORS:
        pieces = [one.epochs_ns for one in seen if one.sensor == sensor and len(one.epochs_ns)]
        if pieces:
            found[sensor] = np.unique(np.concatenate(pieces))
    return found
