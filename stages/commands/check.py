"""``poolcal check``: the content and the faults of a session's files, before the session is calibrated."""

from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.artefacts.streams import EMPTY_STREAM
from pipeline.checking import rendering
from pipeline.checking.check_session import check_session
from pipeline.checking.trial_calibration import Raw, TrialCalibration
from pipeline.config.load import load_session
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.errors import PoolcalError
from pipeline.readers.casts import with_cast
from pipeline.report.cast_checks import describe_cast
from pipeline.results.pages.assumptions import drift_note
from pipeline.run.found_target import found_target
from pipeline.run.progress import Progress
from pipeline.run.settings import load_settings
from pipeline.run.workers import SERIAL
from stages.commands.answer import print_answer
from stages.in_memory import calibrate_in_memory

WITHOUT_CONFIG = "Target, mounts and soundings were not checked: give the pool's YAML file with --config."


def command(session: Path, config: Path | None, as_json: bool) -> int:
    """Print the findings; return 1 if something is wrong.

    Parameters
    ----------
    session
        Folder with session.yaml and the raw files.
    config
        The pool's YAML file; None: target, mounts and soundings are not checked.
    as_json
        True: print JSON, for programs.
    """
    find = partial(found_target, session, workers=SERIAL)
    progress = Progress()
    with progress.shown("reading the settings; a target that is to be found is found now"):
        settings = None if config is None else load_settings(session, config, None, find)
    content, pool = (load_session(session, with_cast), None) if settings is None else (settings.session, settings.pool)
    with progress.shown("reading and comparing the files"):
        findings = check_session(session, content, pool, partial(_calibrated, progress))
    from_files = findings.quality.sigmas if content.ins.drift_from == "files" else {}
    note = "" if settings is None else drift_note(settings, from_files)
    if as_json:
        return print_answer(rendering.check_json(findings, note), not findings.faulty, as_is=True)
    used = None if content.mbes is None else content.mbes.svp_from
    cast = "" if used is None else f"mbes.svp: {describe_cast(used)}\n\n"
    unasked = "" if pool is not None else f"\n{WITHOUT_CONFIG}"
    return print_answer(f"{cast}{rendering.check_text(findings, note)}{unasked}", not findings.faulty)


def _calibrated(progress: Progress, session: SessionConfig, pool: PoolConfig, raw: Raw) -> TrialCalibration:
    progress.next("calibrating a sample of the points, then counting soundings")
    artefacts: dict[str, Any] = {}

    def keep(key: str, value: Any) -> Any:
        artefacts[key] = value
        return value

    with suppress(PoolcalError):
        calibrate_in_memory(session, pool, raw, "adjust", keep)
    tables = (artefacts.get(name) for name in ("segment/target_pose", "segment/provisional_mount", "adjust/freed"))
    return TrialCalibration(artefacts.get("segment/soundings_labelled", EMPTY_STREAM), *tables)
