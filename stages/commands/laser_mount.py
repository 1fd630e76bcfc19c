"""No command: this writes the laser's mount into session.yaml, with the covariance for the sonar's total sigmas."""

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.adjustment.laser_design import coarse_mount
from pipeline.coarse.session_file import mount_block, mount_origin, read_session, write_mounts, written_covariance
from pipeline.config.stage_settings import LaserPrior, narrow
from pipeline.report.method_blocks import mounted_of
from pipeline.run.results import calibration
from pipeline.run.settings import read_settings


def write(session: Path, run: Path) -> str:
    """Write an accepted result into SESSION/session.yaml; return a text that says what was written."""
    result = calibration(run)
    block, source = result["laser"], run / "report" / "calibration.json"
    origin = mount_origin("fine", source, held=list(result["held"]), coarse=_coarse(run))
    blocks = {"laser": mount_block(mounted_of(block), np.array(block["covariance_total"]), origin)}
    return write_mounts(session, *read_session(session), blocks)


def _coarse(run: Path) -> dict[str, Any]:
    """Return the coarse mount of the run for ``mount_origin``, without a covariance if pool.yaml gives its sigmas."""
    settings = read_settings(run)
    laser = settings.session.laser
    if laser.mount_origin is not None and laser.mount_origin.coarse is not None:
        return laser.mount_origin.coarse.model_dump(exclude_none=True)
    mount: dict[str, Any] = {"mount": laser.mount.model_dump()}
    if laser.mount_covariance is None:
        return mount
    _, covariance = coarse_mount(laser, narrow(LaserPrior, settings.pool.laser_fit))
    return mount | {"covariance": written_covariance(covariance)}
