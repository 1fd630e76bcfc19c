"""``poolcal init``: begin a session, by session.yaml and the pool's config, from a folder of raw files."""

import os
import sys
from pathlib import Path

from pipeline.atomic_files import write_text
from pipeline.config.fill_in import unfilled
from pipeline.config.yaml_file import SESSION_YAML
from pipeline.console import plural
from pipeline.errors import ConfigError
from pipeline.language.speaking import say
from pipeline.starting.folder_survey import FolderSurvey, survey_folder
from pipeline.starting.next_steps import found_text, steps_text
from pipeline.starting.pool_text import pool_text
from pipeline.starting.session_text import session_text


def command(folder: Path, pool: Path | None, with_pool: bool) -> int:
    """Write FOLDER/session.yaml and the pool's config, and print what was found and what is left to be done.

    Parameters
    ----------
    folder
        The folder with the raw files.
    pool
        The pool's config to write; None: FOLDER/pool.yaml.
    with_pool
        False: write no pool's config.
    """
    session_path, pool_path = folder / SESSION_YAML, folder / "pool.yaml" if pool is None else pool
    _refuse_folder(folder)
    _refuse_present(session_path, "take it away to begin anew")
    if with_pool:
        _refuse_present(pool_path, "give --no-pool to keep to it, or name another file with --pool")
        _refuse_place(pool_path, session_path)
    survey = survey_folder(folder)
    _refuse_nothing(survey)
    texts = {session_path: session_text(survey)} | ({pool_path: pool_text(survey.track)} if with_pool else {})
    _write_all(texts)
    open_keys = [(path, unfilled(text, path)) for path, text in texts.items()]
    written = "\n".join(f"Written: {path}" for path in texts)
    known_pool = pool_path if with_pool else pool
    say("\n\n".join([found_text(survey), written, steps_text(folder, known_pool, open_keys)]), sys.stdout)
    return 0


def _refuse_folder(folder: Path) -> None:
    if not folder.is_dir():
        raise ConfigError(f"{folder}: is no folder; FOLDER is the folder with the raw files")
    if not os.access(folder, os.R_OK | os.X_OK):
        raise ConfigError(f"{folder}: cannot be read; correct its permissions")
    if not os.access(folder, os.W_OK):
        raise ConfigError(f"{folder}: cannot be written, and {SESSION_YAML} belongs there; copy the files elsewhere")


def _refuse_present(path: Path, remedy: str) -> None:
    if os.path.lexists(path):
        raise ConfigError(f"{path}: is there already, and poolcal init replaces no file; {remedy}")


def _refuse_place(pool: Path, session: Path) -> None:
    if not pool.parent.is_dir():
        raise ConfigError(f"--pool {pool}: there is no folder {pool.parent}; make it, or name another file")
    if pool.resolve() == session.resolve():
        raise ConfigError(f"--pool {pool}: is where {SESSION_YAML} goes; name another file")


def _refuse_nothing(survey: FolderSurvey) -> None:
    if any(survey.groups.values()):
        return
    reasons = [f"{one.name}: {one.why}" for one in survey.left_out[:3]]
    number = len(survey.left_out) + len(survey.casts) + len(survey.accuracy)
    holds = f"none of its {plural(number, 'file')} can be read as raw data" if number else "it holds no file"
    why = f" ({'; '.join(reasons)})" if reasons else ""
    raise ConfigError(f"{survey.folder}: {holds}{why}; name the folder with the raw files. Nothing was written")


def _write_all(texts: dict[Path, str]) -> None:
    """Write all files, or none."""
    written: list[Path] = []
    try:
        for path, text in texts.items():
            write_text(path, text)
            written.append(path)
    except BaseException:  # whatever stops it, Ctrl-C included
        for path in written:
            path.unlink(missing_ok=True)
        raise
