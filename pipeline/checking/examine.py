"""All questions in their order; what would only follow from an earlier finding is not asked."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline import config
from pipeline.checking import clocks, files, hits, passes
from pipeline.checking.expected import faces
from pipeline.checking.finding import Finding
from pipeline.checking.latency import Adjusted, latencies
from pipeline.checking.placed import rows_of, sample
from pipeline.checking.survey import SENSORS, Seen, Times, survey
from pipeline.checking.track import Leg, Track, frame_of, joined, track_of
from pipeline.clouds import ClosestSurface
from pipeline.mounts import target_of
from pipeline.times import NS

ROUGHLY, ADJUSTED, FINELY = 4_000, 20_000, 60_000  # rows of a sensor: to hit the target, adjust, count faces


@dataclass(frozen=True)
class Examined:
    """What is there, and what is wrong with it."""

    files: tuple[Seen, ...]
    legs: tuple[Leg, ...]
    findings: tuple[Finding, ...]

    @property
    def faulty(self) -> bool:
        return any(finding.severity == "fault" for finding in self.findings)


def examine(
    folder: Path, session: config.SessionConfig, pool: config.PoolConfig | None, adjusted: Adjusted
) -> Examined:
    """``pool``: where the target is; without it nothing is asked about the target. ``adjusted`` calibrates samples."""
    seen, wrong = survey(session, folder)
    findings = list(_of_files(seen, wrong, session))
    epochs = _epochs(seen)
    legs: tuple[Leg, ...] = ()
    if "ins" in epochs:
        max_gap_s = (config.Ingest() if pool is None else pool.ingest).max_gap_s
        coarse = max(s.coarseness_ns for s in seen if s.sensor == "ins")
        findings += clocks.apart(epochs, max(round(max_gap_s * NS), round(coarse)), seen)
        if pool is not None:
            clocked = {f.words.split(":")[0] for f in findings if f.question == "clock"}
            clocked |= {"laser" for f in findings if f.question == "frame"}
            of_target, legs = _of_target(seen, epochs, session, pool, clocked, adjusted)
            findings += of_target
    return Examined(tuple(seen), legs, tuple(findings))


def _of_files(seen: Sequence[Seen], wrong: Sequence[str], session: config.SessionConfig) -> Iterator[Finding]:
    yield from files.unreadable(seen, wrong)
    yield from files.missing_sensors(seen, session)
    yield from files.twice(seen)
    yield from files.ins_rate(seen)
    yield from files.alignment(seen)
    yield from files.frames(seen, session)
    yield from files.sound_speed(seen, session)


def _of_points(
    seen: Sequence[Seen],
    session: config.SessionConfig,
    pool: config.PoolConfig,
    track: Track,
    asked: Sequence[str],
    adjusted: Adjusted,
) -> Iterator[Finding]:
    """Where the points fall; of sensors whose points miss the target nothing finer is asked."""
    model = target_of(pool.target)
    closest = ClosestSurface(model)
    few = [sample(seen, session, sensor, track, ROUGHLY) for sensor in asked]
    findings = list(hits.off_target(track, [one for one in few if one is not None], closest, pool.segment))
    yield from findings
    soundings = sample(seen, session, "mbes", track, FINELY) if "mbes" in asked and not findings else None
    if soundings is None:
        return
    yield from faces(
        track, soundings, sum(one.records for one in seen if one.sensor == "mbes"), seen, model, pool, session
    )
    if "laser" in asked:
        raw = {"ins": joined(seen)} | {sensor: rows_of(seen, sensor, ADJUSTED) for sensor in ("laser", "mbes")}
        freed = adjusted(session, pool, raw)
        if freed is not None:
            yield from latencies(freed)


def _epochs(seen: Sequence[Seen]) -> dict[str, Times]:
    found: dict[str, Times] = {}
    for sensor in SENSORS:
        pieces = [one.epochs_ns for one in seen if one.sensor == sensor and len(one.epochs_ns)]
        if pieces:
            found[sensor] = np.unique(np.concatenate(pieces))
    return found


def _of_target(
    seen: Sequence[Seen],
    epochs: dict[str, Times],
    session: config.SessionConfig,
    pool: config.PoolConfig,
    clocked: set[str],
    adjusted: Adjusted,
) -> tuple[list[Finding], tuple[Leg, ...]]:
    """``clocked``: sensors of which nothing more is asked."""
    model, ins = target_of(pool.target), joined(seen)
    findings = list(passes.place(ins, pool, model))
    if findings:
        return findings, ()
    frame = frame_of(ins, pool.target_place)
    if frame is None:
        words = "target.azimuth_deg is not given, and the boat never has target.origin within 20 m to starboard"
        return [Finding("side", f"{words}; give azimuth_deg, or check target.origin")], ()
    track = track_of(ins, frame, model, seen, pool.ingest)
    findings += passes.sailing(track)
    asked = [sensor for sensor in ("laser", "mbes") if sensor in epochs and sensor not in clocked]
    missed: list[Finding] = []
    if not findings or all(finding.severity == "look" for finding in findings):
        missed = list(_of_points(seen, session, pool, track, asked, adjusted))
    findings += missed
    if not clocked and not any(finding.question == "clock" for finding in missed):
        findings += passes.missing(track, seen)
        coarse = max(s.coarseness_ns for s in seen if s.sensor == "ins")
        sounded = {sensor: t_ns for sensor, t_ns in epochs.items() if sensor != "ins"}
        findings += passes.holes(track, sounded, pool.georeference.max_ins_interval_s, coarse)
    return findings, track.legs
