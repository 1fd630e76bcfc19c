"""``poolcal check``: what a session's files are, and what is wrong with them, before it is calibrated."""

from pathlib import Path

import pandas as pd

from pipeline.checking import saying
from pipeline.checking.examine import examine
from pipeline.checking.latency import Raw
from pipeline.config import PoolConfig, SessionConfig, load_session
from pipeline.errors import PoolcalError
from pipeline.folder import load_settings
from stages.campaign import calibrate_in_memory


def check(session: Path, config: Path | None, as_json: bool) -> tuple[str, bool]:
    """What the screen says, and whether something is wrong."""
    settings = None if config is None else load_settings(session, config, None)
    content, pool = (load_session(session), None) if settings is None else (settings.session, settings.pool)
    found = examine(session, content, pool, _freed)
    return saying.as_json(found) if as_json else saying.text(found), found.faulty


def _freed(session: SessionConfig, pool: PoolConfig, raw: Raw) -> pd.DataFrame | None:
    """What the held parameters would rather be, by a sample of the session; None where that cannot be calibrated."""
    try:
        found: pd.DataFrame = calibrate_in_memory(session, pool, raw, "adjust")["adjust/freed"]
    except PoolcalError:
        return None
    return found
