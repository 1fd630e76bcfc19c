"""``poolcal patch``: the sonar's angles by passes over the bottom alone, and whether a run agrees with them."""

from pathlib import Path

import numpy as np

from pipeline.artefacts.streams import Stream
from pipeline.config.load import session_in, session_yaml
from pipeline.config.session import Mbes, SessionConfig
from pipeline.config.stage_settings import SonarPlacement, narrow
from pipeline.config.yaml_file import YamlFile
from pipeline.console import plural
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
    session = session_in(YamlFile.read(session_yaml(folder)), with_cast, several_heads=True)
    run = None if run_folder is None else _run(run_folder, session)
    if run is not None and water_height_m is None and run.settings.session_folder.resolve() == folder.resolve():
        target = run.settings.pool.target
        water_height_m = target.origin.height_m + target.water_level_m
    if session.sonar.svp is not None and water_height_m is None:
        raise ConfigError(
            "--water-height: is missing: mbes.svp counts depths from the water; give its height in the INS's datum"
        )
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
    before = HeadBefore.of(session, mbes)
    beside = of_coarse(before.coarse)
    if run is not None:
        calibrated = run.of_head(name).result["methods"]["adjustment"]
        beside = Compared(run.path.name, calibrated["mount"], np.array(calibrated["covariance_total"]))
        before = before.with_lever_arm(calibrated["mount"], np.array(calibrated["covariance_total"])[3:, 3:])
    ins = Stream(raw_parts("ins", session.ins, folder), pool.map, pool.here)
    soundings = Stream(raw_parts("mbes", mbes, folder), pool.map, pool.here)
    passes = read_passes(ins, soundings, session, narrow(SonarPlacement, mbes), water_height_m)
    found = patch_test(passes, before, pool.here)
    agrees = run is None or beside.agrees(found)
    return patch_text(found, beside, passes.read), agrees and not found.doubtful


def _run(path: Path, session: SessionConfig) -> FinishedRun:
    """Return a run whose mounts can be compared with this session's heads; else raise ConfigError."""
    run = FinishedRun.read(path, ORDER, several_heads=True)
    if len(run.heads) != len(session.heads):
        raise ConfigError(
            f"--run {path}: has {plural(len(run.heads), 'head')}, this session {len(session.heads)}; name a run of "
            "this boat with the same heads"
        )
    if run.grave_reasons:
        raise ConfigError(
            f"--run {path}: was rejected for {', '.join(run.grave_reasons)}: its lever arm, which the patch test "
            "takes from it, may be wrong; mend that first"
        )
    return run
