"""No command: this writes the laser's mount into session.yaml, with the covariance for the sonar's total sigmas."""

from pathlib import Path

import numpy as np

from pipeline.coarse.session_file import mount_block, mount_origin, read_session, write_mounts
from pipeline.report.method_blocks import mounted_of
from pipeline.run.results import calibration


def write(session: Path, run: Path) -> str:
    """Write an accepted result into SESSION/session.yaml; return a text that says what was written."""
    result = calibration(run)
    block = result["laser"]
    origin = mount_origin("fine", run / "report" / "calibration.json", held=list(result["held"]))
    blocks = {"laser": mount_block(mounted_of(block), np.array(block["covariance_total"]), origin)}
    return write_mounts(session, *read_session(session), blocks)
