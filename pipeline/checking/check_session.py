"""All questions about a session, in their order. A question is left out if an earlier finding decides its answer."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.checking import clocks, file_checks, target_hits, track_checks
from pipeline.checking.expected_soundings import PingsOnTarget, SoundingCounts, count_soundings, faces_missed
from pipeline.checking.file_lines import gaps_of
from pipeline.checking.file_survey import SENSORS, SurveyedFile, Times, survey_files
from pipeline.checking.findings import Finding
from pipeline.checking.ins_quality import InsQuality, assess_ins_quality, quality_findings
from pipeline.checking.latency import latency_findings
from pipeline.checking.point_samples import rows_with_pose, sample_points, sampled_rows
from pipeline.checking.track import InsTrack, Leg, frame_of, joined, sees_port, track_of
from pipeline.checking.trial_calibration import Calibrate, TrialCalibration
from pipeline.checking.trial_findings import pose_findings, sign_findings
from pipeline.checking.water_checks import water_findings
from pipeline.config.pool import Ingest, PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.gps_time import NS
from pipeline.maths.target.model import TargetModel
from pipeline.target.design import target_of
from pipeline.target.surface import ClosestSurface

ROUGHLY, SAMPLED, FINELY = 4_000, 20_000, 60_000  # sampled rows: target hits, trial calibration, sounding counts


@dataclass(frozen=True)
class SessionCheck:
    """The surveyed files of a session, its passes, and the findings."""

    files: tuple[SurveyedFile, ...]
    legs: tuple[Leg, ...]
    findings: tuple[Finding, ...]
    model: TargetModel | None = None  # None: the check ended before the passes
    soundings: SoundingCounts | None = None  # None: the soundings were not counted
    quality: InsQuality = field(default_factory=InsQuality)
    gaps: pd.DataFrame | None = None  # None: the INS has no records

    @property
    def faulty(self) -> bool:
        """Whether a calibration would fail, or would be wrong."""
        return any(finding.severity == "fault" for finding in self.findings)


@dataclass(frozen=True)
class _Session:
    """A session, with the pool's settings and the target."""

    files: Sequence[SurveyedFile]
    settings: SessionConfig
    pool: PoolConfig
    model: TargetModel
    calibrate: Calibrate


def check_session(
    folder: Path, session: SessionConfig, pool: PoolConfig | None, calibrate: Calibrate
) -> SessionCheck:
    """Check each file of a session by itself, and then all files together.

    Parameters
    ----------
    folder : Path
        The session folder.
    session : SessionConfig
        Its settings.
    pool : PoolConfig or None
        The pool's settings. With None no question is asked about the target.
    calibrate : Calibrate
        Function that calibrates a sample of the session in memory.
    """
    checked = _check(folder, session, pool, calibrate)
    quality = assess_ins_quality(checked.files, [leg for leg in checked.legs if leg.good])
    return replace(checked, quality=quality, findings=(*checked.findings, *quality_findings(quality)))


def _check(folder: Path, session: SessionConfig, pool: PoolConfig | None, calibrate: Calibrate) -> SessionCheck:
    files, list_faults = survey_files(session, folder)
    findings = list(_file_findings(files, list_faults, session))
    epochs = _epochs(files)
    if "ins" not in epochs:
        return SessionCheck(tuple(files), (), tuple(findings))
    max_gap_s = (Ingest() if pool is None else pool.ingest).max_gap_s
    coarseness_ns = max(file.coarseness_ns for file in files if file.sensor == "ins")
    weeks = {"ins": session.ins.gps_week, "laser": session.laser.gps_week}
    max_gap_ns = max(round(max_gap_s * NS), round(coarseness_ns))
    findings += clocks.clock_findings(epochs, max_gap_ns, files, weeks)
    gaps = gaps_of(epochs, max_gap_ns)
    if pool is None:
        return SessionCheck(tuple(files), (), tuple(findings), gaps=gaps)
    unusable = {finding.words.split(":")[0] for finding in findings if finding.question == "clock"}
    unusable |= {"laser", "mbes"} if "ins" in unusable else set()
    unusable |= {"laser" for finding in findings if finding.question == "frame"}
    unusable |= {"mbes" for finding in findings if finding.question == "stamps"}
    if session.mbes is not None:
        findings += track_checks.survey_findings(pool)
    at_target = _check_at_target(_Session(files, session, pool, target_of(pool.target), calibrate), epochs, unusable)
    return replace(at_target, findings=(*findings, *at_target.findings), gaps=gaps)


def _file_findings(
    files: Sequence[SurveyedFile], list_faults: Sequence[str], session: SessionConfig
) -> Iterator[Finding]:
    yield from file_checks.unreadable_files(files, list_faults)
    yield from file_checks.sensors_without_records(files, session)
    yield from file_checks.duplicate_files(files)
    yield from file_checks.slow_ins_logs(files)
    yield from file_checks.unaligned_ins(files)
    yield from file_checks.wrong_frames(files, session)
    yield from file_checks.long_lever_arms(session)
    if session.mbes is not None:
        yield from file_checks.soundings_by_reception(files)
        yield from file_checks.doubtful_sound_speeds(files, session.mbes)
        yield from file_checks.doubtful_cast(files, session.mbes)


def _check_at_target(session: _Session, epochs: dict[str, Times], unusable: set[str]) -> SessionCheck:
    """Check the track and the points against the target. Points of the sensors in ``unusable`` are not checked."""
    files, pool, model, ins = session.files, session.pool, session.model, joined(session.files)
    away = SessionCheck(tuple(files), (), tuple(track_checks.origin_findings(ins, pool, model)))
    if away.findings:
        return away
    frame = frame_of(ins, pool.target_place)
    if frame is None:
        words = "target.azimuth_deg is not given, and the boat never has target.origin within 20 m abeam"
        return replace(away, findings=(Finding("side", f"{words}; give azimuth_deg, or check target.origin"),))
    track = track_of(ins, frame, model, files, pool.ingest, sees_port(session.settings))
    findings = list(track_checks.sailing_findings(track, pool.target_place))
    usable = [sensor for sensor in ("laser", "mbes") if sensor in epochs and sensor not in unusable]
    of_points: list[Finding] = []
    counts = None
    if all(finding.severity == "look" for finding in findings):
        of_points, counts = _point_findings(session, track, usable)
    findings += [*of_points, *water_findings(track.legs, pool)]
    if not unusable and not any(finding.question == "clock" for finding in of_points):
        findings += track_checks.missing_pass_findings(track, files)
        coarseness_ns = max(file.coarseness_ns for file in files if file.sensor == "ins")
        sensor_epochs = {sensor: t_ns for sensor, t_ns in epochs.items() if sensor != "ins"}
        max_interval_s = pool.georeference.max_ins_interval_s
        findings += track_checks.ins_hole_findings(track, sensor_epochs, max_interval_s, coarseness_ns)
    return SessionCheck(tuple(files), track.legs, tuple(findings), model, counts)


def _still_water(pool: PoolConfig) -> PoolConfig:
    """Return the settings without the water's level by time: readings that do not serve would end the trial."""
    return pool.model_copy(update={"target": pool.target.model_copy(update={"water_by_time": None})})


def _point_findings(
    session: _Session, track: InsTrack, sensors: Sequence[str]
) -> tuple[list[Finding], SoundingCounts | None]:
    """Return the findings about the sensors' points, and the counts of soundings.

    The counts are None if points miss the target, if the trial calibration shows a fault, or without soundings.
    """
    files, settings, pool, model = session.files, session.settings, session.pool, session.model
    rough = [sample_points(files, settings, sensor, track, ROUGHLY) for sensor in sensors]
    samples = [sample for sample in rough if sample is not None]
    findings = list(target_hits.points_off_target(track, samples, ClosestSurface(model), pool))
    fine = sample_points(files, settings, "mbes", track, FINELY) if "mbes" in sensors and not findings else None
    if fine is None:
        return findings, None
    fine = fine.with_pose(track)
    raw = {sensor: rows_with_pose(sampled_rows(files, sensor, SAMPLED), track) for sensor in ("laser", "mbes")}
    raw["ins"] = joined(files)
    trial = session.calibrate(settings, _still_water(pool), raw) if "laser" in sensors else TrialCalibration()
    findings = list(_trial_findings(session, track, trial))
    if any(finding.severity == "fault" for finding in findings):
        return findings, None
    pings = PingsOnTarget(track=track, files=files, model=model, pool=pool, session=settings)
    counts = count_soundings(pings, fine, trial.soundings, len(raw["mbes"]["t_ns"]))
    findings += faces_missed(model, counts) if counts is not None else []
    findings += latency_findings(trial.freed) if trial.freed is not None else []
    return findings, counts


def _trial_findings(session: _Session, track: InsTrack, trial: TrialCalibration) -> Iterator[Finding]:
    """Yield findings if the trial calibration contradicts the target's pose or the sonar's mount in the settings."""
    laser = sample_points(session.files, session.settings, "laser", track, SAMPLED)
    if laser is not None and trial.target_pose is not None:
        yield from pose_findings(track, laser, trial.target_pose, session.model, session.pool)
    if trial.provisional_mount is not None:
        mount = session.settings.sonar.mount
        yield from sign_findings(mount, trial.provisional_mount, session.model, session.pool.segment.search_mount_deg)


def _epochs(files: Sequence[SurveyedFile]) -> dict[str, Times]:
    """Return by sensor the times of its records, ascending, without repeats; sensors without records are left out."""
    epochs: dict[str, Times] = {}
    for sensor in SENSORS:
        pieces = [file.epochs_ns for file in files if file.sensor == sensor and len(file.epochs_ns)]
        if pieces:
            epochs[sensor] = np.unique(np.concatenate(pieces))
    return epochs
