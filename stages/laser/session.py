"""The laser's own calibration into session.yaml, with its covariance: the sonar's total sigmas are made from it."""

from pathlib import Path

import numpy as np

from pipeline.blocks import mounted_of
from pipeline.folder import calibration
from pipeline.session_edit import block_of, origin_of, read_session, written


def write(session: Path, run: Path) -> str:
    """An accepted result into SESSION/session.yaml; what was done, in words."""
    result = calibration(run)
    block = result["laser"]
    origin = origin_of("fine", run / "report" / "calibration.json", held=list(result["held"]))
    blocks = {"laser": block_of(mounted_of(block), np.array(block["covariance_total"]), origin)}
    return written(session, *read_session(session), blocks)
