"""The mount of a finished run, as it is to be written."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.atomic_files import sha256
from pipeline.config.mount import Mount
from pipeline.config.session import Calibrated, SessionConfig
from pipeline.errors import ArtefactError, ConfigError
from pipeline.exports.mounting import Mounting, Origin, VesselFrame
from pipeline.mount import Mounted, mount_of
from pipeline.report.method_blocks import mounted_of
from pipeline.results.finished_run import FinishedRun
from pipeline.run.output_files import as_written

SAME = 1e-6  # rad: angles and matrix of calibration.json agree within it


def mounting_of(run: FinishedRun, sensor: Calibrated | None, although_rejected: bool) -> Mounting:
    """Return the mount of a finished run.

    Parameters
    ----------
    run
        The run.
    sensor
        The sensor to write; None: the one that the run calibrates. From a sonar's run "laser" is the laser's mount in
        its settings, which the calibration rests on.
    although_rejected
        Whether a rejected result may be taken.

    Raises
    ------
    ConfigError
        The run was rejected and must not be exported, or it has no result of this sensor.
    ArtefactError
        calibration.json is not as poolcal writes it.
    """
    session, calibrated = run.settings.session, run.settings.session.calibrated
    with as_written(run.path):
        rejected = None if run.result["verdict"] == "accepted" else tuple(map(str, run.result["reasons"]))
        if rejected is not None and not although_rejected:
            has_values = run.result[calibrated]["mount"] is not None
            look = "; to look at its values in a program's form, add --although-rejected" if has_values else ""
            raise ConfigError(f"{run.path}: was rejected, and must not be used ({'; '.join(rejected)}){look}")
        passes = run.result["passes"]
        origin = Origin(
            session=one_line(session.name),
            run=one_line(run.path.resolve().name),
            kind=f"calibrated mount{_of_head(run)}, result {run.result['result']}",
            rejected=None if rejected is None else tuple(map(one_line, rejected)),
            held=tuple(map(str, run.result.get("held", ()))),
            free=tuple(one_line(str(one["words"])) for one in run.result.get("free", {}).values()),
            start_utc=str(passes[0]["start_utc"]) if passes else None,
            digest=sha256(run.path / "report" / "calibration.json"),
            purpose=one_line(str(run.result.get("limits", {}).get("in_words", ""))),
        )
        if sensor in (None, calibrated):
            mounting = _calibrated(run.path, run.result[calibrated], calibrated, origin)
        elif sensor == "laser":
            kind = "the laser's mount by the settings, on which the sonar's calibration rests (no result of this run)"
            mounting = _laser_setting(session, replace(origin, kind=kind, held=(), free=()))
        else:
            raise ConfigError(f"{run.path}: calibrates the laser alone, and holds no sonar; name a sonar's run")
    return _with_settings(mounting, session)


def _of_head(run: FinishedRun) -> str:
    """Return words for the head whose mount it is; nothing if the sonar has one."""
    return f" of head {one_line(run.result['head'])}" if "head" in run.result else ""


def one_line(text: str) -> str:
    """Return a text without characters that end a line, steer a terminal, or end a comment of XML."""
    return "".join(letter if letter.isprintable() else "?" for letter in text).replace("--", "- -")


def _calibrated(path: Path, block: Mapping[str, Any], sensor: Calibrated, origin: Origin) -> Mounting:
    if block["mount"] is None:
        raise ConfigError(f"{path}: has no mount ({block['no_result']}); nothing can be exported")
    body = mounted_of(block)
    R = np.asarray(body.R_body_from_sensor, dtype=np.float64).reshape(3, 3)
    lever_arm = np.asarray(body.lever_arm_body_m, dtype=np.float64).reshape(3)
    stated = mount_of_settings(block["mount"])
    if not (
        np.abs(R @ R.T - np.eye(3)).max() < SAME
        and np.linalg.det(R) > 0
        and np.abs(R - stated.R_body_from_sensor).max() < SAME
        and np.abs(lever_arm - stated.lever_arm_body_m).max() < SAME
    ):
        raise ArtefactError(f"{path}: mount and matrix of its calibration.json do not agree; run it again")
    covariance = block["covariance_total"]
    total = None if covariance is None else np.asarray(covariance, dtype=np.float64).reshape(6, 6)
    return Mounting(sensor, Mounted(R, lever_arm), total, origin, VesselFrame())


def mount_of_settings(settings: Mapping[str, float]) -> Mounted:
    """Return the mount of settings by name, as in calibration.json."""
    return mount_of(Mount(**{name: float(value) for name, value in settings.items()}))


def _laser_setting(session: SessionConfig, origin: Origin) -> Mounting:
    laser = session.laser
    if laser.mount_covariance is not None:
        covariance = np.array(laser.mount_covariance)
    else:
        sigmas = np.repeat([np.radians(laser.mount_sigma.angle_deg), laser.mount_sigma.lever_arm_m], 3)
        covariance = np.diag(sigmas**2)
    return Mounting("laser", mount_of(laser.mount), covariance, origin)


def _with_settings(mounting: Mounting, session: SessionConfig) -> Mounting:
    """Return the mount with the sensor's clock against the INS's, and the place of the transmitter.

    True time = recorded - latency for either. So the sonar's recorded time t is t - latency_sonar + latency_ins by the
    INS's clock as recorded.
    """
    if mounting.sensor == "laser":
        return replace(mounting, latency_s=session.laser.latency_s - session.ins.latency_s)
    sonar = session.sonar
    return replace(
        mounting,
        latency_s=sonar.latency_s - session.ins.latency_s,
        projector_offset_m=sonar.projector_offset_m,
        split=sonar.format in ("kmall", "all"),
    )
