"""``poolcal patch``: the sonar's angles by passes over the bottom alone, and whether a run agrees with them."""

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.artefacts.streams import Stream
from pipeline.config.load import load_session
from pipeline.config.session import Mbes, SessionConfig
from pipeline.config.stage_settings import SonarPlacement, narrow
from pipeline.errors import ConfigError
from pipeline.language.chosen import translated
from pipeline.patch_test.passes import read_passes
from pipeline.patch_test.patch_text import Compared, of_coarse, patch_text
from pipeline.patch_test.solve import HeadBefore, patch_test
from pipeline.readers.casts import with_cast
from pipeline.readers.dispatch import raw_parts
from pipeline.results.finished_run import FinishedRun
from pipeline.run.progress import Progress
from pipeline.run.workers import Workers, workers
from stages import ORDER
from stages.commands.answer import print_answer


def command(folder: Path, run_folder: Path | None, water_height_m: float | None, jobs: int | None) -> int:
    """Print the angles of each head by passes over the bottom; return 1 if they are in doubt, or a run does not agree.

    Parameters
    ----------
    folder
        The session folder.
    run_folder
        A run, of this session or of another one of the same boat, whose mount is compared; None: none is.
    water_height_m
        Height of the water in the INS's datum; None: by the run, or about that of the sonar.
    jobs
        Number of workers.
    """
    session = load_session(folder, with_cast)
    run = None if run_folder is None else FinishedRun.read(run_folder, ORDER, several_heads=True)
    if session.sonar.svp is not None and water_height_m is None and run is None:
        raise ConfigError(
            "--water-height: is missing: mbes.svp counts depths from the water; give its height in the INS's datum, or "
            "--run RUN, which has it"
        )
    if run is not None and water_height_m is None:
        target = run.settings.pool.target
        water_height_m = target.origin.height_m + target.water_level_m
    said, well = [], True
    with workers(jobs, None) as pool, Progress().shown("reading the soundings, and adjusting the angles"):
        for name, mbes in session.heads.items():
            text, is_well = _head(folder, session, (name, mbes), run, water_height_m, pool)
            said.append(f"{translated('head')} {name}\n\n{text}" if len(session.heads) > 1 else text)
            well &= is_well
    return print_answer("\n\n".join(said), well)


def _head(
    folder: Path,
    session: SessionConfig,
    head: tuple[str, Mbes],
    run: FinishedRun | None,
    water_height_m: float | None,
    pool: Workers,
) -> tuple[str, bool]:
    """Return what is said of one head, and whether all is well: nothing is in doubt, and the run agrees."""
    name, mbes = head
    before, beside = HeadBefore.of(session, mbes), of_coarse(HeadBefore.of(session, mbes).coarse)
    if run is not None:
        if name not in run.heads:
            raise ConfigError(f"--run {run.path}: has no head {name}; name a run of this boat")
        calibrated = run.of_head(name).result["methods"]["adjustment"]
        beside = _compared(calibrated, run)
        before = before.with_lever_arm(calibrated["mount"], np.array(calibrated["covariance_total"])[3:, 3:])
    ins = Stream(raw_parts("ins", session.ins, folder), pool.map, pool.here)
    soundings = Stream(raw_parts("mbes", mbes, folder), pool.map, pool.here)
    passes = read_passes(ins, soundings, session, narrow(SonarPlacement, mbes), water_height_m)
    found = patch_test(passes, before, pool.here)
    return patch_text(found, beside, passes.read), beside.agrees(found) and not found.doubtful


def _compared(calibrated: dict[str, Any], run: FinishedRun) -> Compared:
    if calibrated["mount"] is None:
        raise ConfigError(f"--run {run.path}: has no result to be compared; name an accepted run")
    return Compared(run.path.name, calibrated["mount"], np.array(calibrated["covariance_total"]))
