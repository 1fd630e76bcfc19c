"""``poolcal target --bottom``: flat pieces of the bottom, found with a run's mount, beside the walls of its target."""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.artefacts.catalogue.points import PASSES, POOL_FRAME, POSES
from pipeline.artefacts.catalogue.results import DRIFT
from pipeline.artefacts.catalogue.target import TARGET_POSE
from pipeline.artefacts.from_tables import trajectory_in_target, trajectory_without_drift
from pipeline.artefacts.streams import Stream
from pipeline.atomic_files import write_text
from pipeline.config.stage_settings import SonarPlacement, narrow
from pipeline.config.target import Faces
from pipeline.errors import ConfigError
from pipeline.finding.bottom import APART_M, BottomPiece, bottom_pieces, serving
from pipeline.finding.kept_points import EVERYWHERE
from pipeline.finding.kept_soundings import KeptSoundings, kept_soundings
from pipeline.finding.pool_file import FIRST_OF_BOTTOM, walls_of, with_bottom_yaml
from pipeline.georeference.pool_context import PoolContext, pool_frame_of
from pipeline.language.speaking import say
from pipeline.maths.target.model import TargetModel
from pipeline.readers.dispatch import raw_parts
from pipeline.results.finished_run import FinishedRun
from pipeline.run.output_files import refuse_output
from pipeline.run.results import Tables
from pipeline.run.workers import Workers, workers
from pipeline.target.design import target_of
from pipeline.target.surface import ClosestSurface
from pipeline.text_table import text_table
from stages import ORDER

AWAY_M = 0.7  # of a sounding from the target's faces


def command(folder: Path, run_folder: Path, out: Path | None, jobs: int | None) -> int:
    """Print the pieces of the bottom that were found; write them, with the run's target, as a pool's config.

    Parameters
    ----------
    folder
        The session folder.
    run_folder
        A run of this session.
    out
        The config to write; None: none is written.
    jobs
        Number of workers.
    """
    refuse_output("--out", out, suffix=".yaml", begins=FIRST_OF_BOTTOM.encode())
    run = FinishedRun.read(run_folder, ORDER)
    target = _target(run, folder)
    with workers(jobs, None) as pool:
        soundings = _soundings(run, pool)
    level_m, walls = target.water_level_m, target.model_copy(update={"faces": walls_of(target.faces)})
    far = _away_from(target_of(walls), soundings.points_m)
    pieces = bottom_pieces(soundings.points_m[far], soundings.number_of_pass[far], level_m)
    used = serving(pieces)
    say(_table(pieces, used, soundings.read), sys.stdout)
    if out is not None:
        if not used:
            raise ConfigError(f"--out {out}: not written: no piece of the bottom can serve; the table says why")
        write_text(out, with_bottom_yaml(run.settings.pool, used))
        say(f"\nWritten: {out}", sys.stdout)
    return 0


def _target(run: FinishedRun, folder: Path) -> Faces:
    """Return the target of a run of this session, whose mount can place the bottom; else raise ConfigError."""
    target, where = run.settings.pool.target, f"--bottom {run.path}"
    if run.settings.session_folder.resolve() != folder.resolve():
        raise ConfigError(f"{where}: is of the session {run.settings.session_folder}; name a run of {folder}")
    if not isinstance(target, Faces):
        raise ConfigError(f"{where}: its target has letters, which determine all without the bottom; it takes faces")
    if run.grave_reasons or run.result["methods"]["adjustment"]["mount"] is None:
        raise ConfigError(
            f"{where}: was rejected for {', '.join(run.grave_reasons)}: its mount may be wrong, and would put the "
            "bottom elsewhere; mend that first"
        )
    return target


def _soundings(run: FinishedRun, pool: Workers) -> KeptSoundings:
    """Return a sample of the session's soundings in the target frame, placed by the run's mount."""
    tables, session = Tables(run.path), run.settings.session
    trajectory = trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE))
    passes = tables.table(PASSES)
    context = PoolContext(
        frame=pool_frame_of(tables.table(POOL_FRAME)),
        trajectory=trajectory_without_drift(trajectory, tables.table(DRIFT)),
        starts_ns=passes["start_ns"].to_numpy(),
        ends_ns=passes["end_ns"].to_numpy(),
        box_low_m=EVERYWHERE[0],
        box_high_m=EVERYWHERE[1],
    )
    calibrated = run.result["methods"]["adjustment"]["mount"]
    mbes = session.sonar.model_copy(update={"mount": session.sonar.mount.model_copy(update=calibrated)})
    stream = Stream(raw_parts("mbes", session.sonar, run.settings.session_folder), pool.map, pool.here)
    return kept_soundings(stream, context, narrow(SonarPlacement, mbes), run.settings.pool.target.water_level_m)


def _away_from(model: TargetModel, points_m: np.ndarray) -> np.ndarray:
    """Return the rows of the points that are far enough from the target's faces, whose echoes are louder."""
    nearest, _ = ClosestSurface(model)(points_m)
    return np.flatnonzero(np.linalg.norm(points_m - nearest, axis=1) > AWAY_M)


def _table(pieces: Sequence[BottomPiece], used: Sequence[BottomPiece], read: int) -> str:
    """Return the pieces as text: those that serve by their names, then the others, which have reasons, by number."""
    rows = [_row(f"bottom-{k}", piece) for k, piece in enumerate(used, start=1)]
    names = {id(piece) for piece in used}
    spare = f"not needed: {len(used)} are enough"
    rows += [
        _row("-", piece, f"refused: {piece.refused}" if piece.refused else spare)
        for piece in pieces
        if id(piece) not in names
    ]
    heads = ["face", "depth m", "slope °", "uneven mm", "apart mm", "passes", "soundings", ""]
    said = f"{read:,} soundings: {len(used)} of {len(pieces)} pieces of the bottom can serve."
    largest = f"Apart: by how much the means of passes differ, {1000 * APART_M:.0f} mm at most."
    return "\n".join([said, "", *text_table("  <10>9>9>11>10>8>11  <1", heads, rows), largest])


def _row(name: str, piece: BottomPiece, why: str = "") -> list[str]:
    return [
        name,
        f"{piece.depth_m:.2f}",
        f"{piece.slope_deg:.1f}",
        f"{1000 * piece.uneven_m:.0f}",
        f"{1000 * piece.apart_m:.0f}",
        str(len(piece.passes)),
        f"{piece.soundings:,}",
        why,
    ]
