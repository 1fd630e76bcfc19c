"""``poolcal check``: what a session's files are, and what is wrong with them, before it is calibrated."""

from pathlib import Path

from pipeline.checking import saying
from pipeline.checking.examine import examine
from pipeline.config import load_session
from pipeline.folder import load_settings


def check(session: Path, config: Path | None, as_json: bool) -> tuple[str, bool]:
    """What the screen says, and whether something is wrong."""
    settings = None if config is None else load_settings(session, config, None)
    found = examine(
        session, load_session(session) if settings is None else settings.session, settings.pool if settings else None
    )
    return saying.as_json(found) if as_json else saying.text(found), found.faulty
